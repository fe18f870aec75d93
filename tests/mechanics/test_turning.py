"""Where a length turns within a step, from its values and rates at both ends; and steps without turns are exact."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from prototype import PRB_3R, prototype

from prb3r.mechanics import turning
from prb3r.mechanics.chain import loads
from prb3r.mechanics.derivatives.solved_path import solve_path
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.mechanics.kernel import entrance

turning_lengths = entrance(turning.turning_lengths.py_func)

SAMPLES = np.linspace(0, 1, 100_001)


@pytest.mark.parametrize(("at", "height"), [(0.1, 2.0), (0.5, -1.0), (0.8, 3.0)])
def test_a_parabola_turns_at_its_vertex(at, height):
    length = Polynomial([height, 0, -height / at**2])(Polynomial([-at, 1]))
    slope = length.deriv()
    assert turning_lengths(length(1), slope(0), slope(1)) == pytest.approx((at, height, height), abs=1e-12)


@pytest.mark.parametrize("side", [1, -1])
def test_a_length_that_swings_beyond_both_ends_turns_twice(side):
    length = side * Polynomial([0, 1, -4.5, 3])
    slope, sampled = length.deriv(), length(SAMPLES)
    turned, to_first, to_last = turning_lengths(length(1), slope(0), slope(1))
    assert turned == pytest.approx(SAMPLES[np.argmax(side * sampled)], abs=2e-5)
    assert side * to_first == pytest.approx((side * sampled).max(), abs=1e-9)
    assert side * to_last == pytest.approx((side * sampled).min(), abs=1e-9)


@pytest.mark.parametrize("travel", [0.3, 1.0, 5.0])
def test_what_is_passed_before_a_turn_vanishes_with_the_slope_that_leads_there(travel):
    """A cubic that ends steeply dips even if it begins without a slope; what rates jump to at a kink must not count."""
    for slope in (1e-3, 1e-6):
        for ends in ((-slope, 10.0), (10.0, -slope)):
            _, to_first, to_last = turning_lengths(travel, *ends)
            assert max(-to_first, to_last - travel) <= slope


def test_a_step_without_turns_is_exact_however_long():
    """A cable drawn in, then let go: all holes turn where the loads do, and no finer path ends elsewhere."""
    chain = prototype(plate=PRB_3R)._replace(presliding=3e-5)
    table = np.array([[100.0, 0, 0, 0], [40.0, 0, 0, 0]])
    solved = solve_path(chain, loads(chain, table))
    assert len(solved.states.row) == 1 + 2 * 4
    fine = np.interp(np.arange(1, 129), [0, 64, 128], [0, 100, 40])[:, None] * [1.0, 0, 0, 0]
    finely = solve_chain(chain, loads(chain, fine))
    for step, same in ((0, 63), (1, 127)):
        assert np.abs(solved.equilibria.x[step] - finely.x[same]).max() < 1e-9
        assert solved.equilibria.slip[step] == pytest.approx(finely.slip[same], abs=1e-6)
