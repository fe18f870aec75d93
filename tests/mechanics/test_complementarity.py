"""Complementarity on a box: whatever the matrix, what is found solves the problem."""

import numpy as np
import pytest

from prb3r.mechanics import complementarity
from prb3r.mechanics.kernel import entrance

solve_near, solve_from_afar = (
    entrance(solve.py_func) for solve in (complementarity.solve_near, complementarity.solve_from_afar)
)


def problem(rng, n, skew):
    """M, c of a random problem; `skew` makes M far from positive."""
    matrix = rng.normal(size=(n, n))
    return matrix @ matrix.T / n + skew * rng.normal(size=(n, n)), 2 * rng.normal(size=n)


def check(matrix, c, side, free, now):
    x, w = np.where(free, now, side), np.where(free, 0.0, now)
    assert matrix @ x + w == pytest.approx(c, abs=1e-8)
    assert np.abs(x).max() <= 1 + 1e-9
    assert (w[~free] * side[~free]).min(initial=0) > -1e-9
    return x


@pytest.mark.parametrize("skew", [0.0, 0.3, 1.0, 3.0])
def test_a_solution_is_found_for_any_matrix(skew):
    for seed in range(50):
        rng = np.random.default_rng(seed)
        matrix, c = problem(rng, 25, skew)
        side, free, now = rng.choice([-1.0, 1.0], 25), np.zeros(25, bool), np.zeros(25)
        assert solve_from_afar(matrix.copy(), c.copy(), np.zeros(25), side, free, now) > 0
        check(matrix, c, side, free, now)


def test_a_small_change_leads_to_the_solution_nearby():
    for seed in range(50):
        rng = np.random.default_rng(seed)
        matrix, c = problem(rng, 25, 0.0)
        side, free, now = rng.choice([-1.0, 1.0], 25), np.zeros(25, bool), np.zeros(25)
        assert solve_from_afar(matrix.copy(), c.copy(), np.zeros(25), side, free, now) > 0
        first = check(matrix, c, side, free, now)
        c = c + 1e-3 * rng.normal(size=25)
        assert solve_near(matrix.copy(), c.copy(), np.zeros(25), side, free, now) > 0
        assert np.abs(check(matrix, c, side, free, now) - first).max() < 0.1
