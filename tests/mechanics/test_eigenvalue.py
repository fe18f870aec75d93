"""The lowest eigenvalue of a long chain: Euler's, and that of its tangent written out."""

import numpy as np
import pytest
from prototype import ELASTICA, PRB_3R, cantilever, prototype, random_chain, random_loads

from prb3r.mechanics import eigenvalue, equilibrium
from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import Outcome, solve_chain

NO_CABLES = np.zeros((1, 0))


def test_a_column_of_20_000_plates_is_stable_up_to_the_load_of_euler():
    """Its tangent would take 29 GB."""
    column = cantilever(20_000)
    below, beyond = (
        solve_chain(column, loads(column, NO_CABLES, tip=(-share * np.pi**2 / 4, 0)), eigenvalue=True)
        for share in (0.999, 1.001)
    )
    assert (below.outcome[0], beyond.outcome[0]) == (Outcome.CONVERGED, Outcome.UNSTABLE)
    assert below.lowest_eigenvalue[0] == pytest.approx(-beyond.lowest_eigenvalue[0], rel=0.01)


@pytest.mark.parametrize("plate", [ELASTICA, PRB_3R])
@pytest.mark.parametrize("tip", [(-2.3, 0.1), (-2.6, 0), (0, 5), (50, 3)])
def test_it_is_that_of_the_tangent_written_out(monkeypatch, plate, tip):
    rod = cantilever(60, plate)
    steps = loads(rod, NO_CABLES, tip=tip)
    products = solve_chain(rod, steps, eigenvalue=True).lowest_eigenvalue
    monkeypatch.setattr(eigenvalue, "WRITTEN_OUT", 10_000)
    assert products == pytest.approx(solve_chain(rod, steps, eigenvalue=True).lowest_eigenvalue, rel=2e-4)


@pytest.mark.parametrize("presliding", [0.0, 1e-4])
def test_with_cables_and_friction_too(monkeypatch, presliding):
    """Where tangents have no symmetry."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        chain = random_chain(rng, plates=12)._replace(presliding=presliding) if seed else prototype()
        steps = random_loads(rng, chain, 2)
        whole = solve_chain(chain, steps, eigenvalue=True)
        with monkeypatch.context() as patched:
            patched.setattr(eigenvalue, "WRITTEN_OUT", 0)
            patched.setattr(eigenvalue, "SEARCHES", ((20, 100, 1e-9),))
            products = solve_chain(chain, steps, eigenvalue=True)
        assert products.outcome.tolist() == whole.outcome.tolist()
        assert products.lowest_eigenvalue == pytest.approx(whole.lowest_eigenvalue, rel=1e-7, nan_ok=True)


def test_moments_beyond_all_bounds_are_no_equilibrium():
    chain = prototype()._replace(presliding=3e-5)
    found = solve_chain(chain, loads(chain, [[5.0, 0, 0, 0]], moment=np.full((1, 14), 1e12)), eigenvalue=True)
    assert found.outcome[0] == Outcome.NO_EQUILIBRIUM


def test_its_sign_alone_marks_the_same_steps_and_takes_no_eigenvalue_of_stable_ones(monkeypatch):
    """Random chains with cables, friction and dead loads, and a column on both sides of Euler's load."""
    cases = [
        (cantilever(9), loads(cantilever(9), np.zeros((4, 0)), tip=[[-2.2, 0], [-2.46, 0], [-2.47, 0], [-3.1, 0]]))
    ]
    for seed in range(6):
        rng = np.random.default_rng(seed)
        chain = random_chain(rng, plates=8)
        cases.append((chain, random_loads(rng, chain, 12)))
    taken, lowest = [], equilibrium.lowest_under_load
    for chain, steps in cases:
        whole = solve_chain(chain, steps, from_rest=True, eigenvalue=True)
        with monkeypatch.context() as patched:
            patched.setattr(equilibrium, "lowest_under_load", lambda *given: taken.append(lowest(*given)) or taken[-1])
            signs = solve_chain(chain, steps, from_rest=True, eigenvalue=True, only_its_sign=True)
        assert signs.outcome.tolist() == whole.outcome.tolist()
        assert signs.lowest_eigenvalue is None
        np.testing.assert_array_equal(signs.angle, whole.angle)
    outcomes = np.concatenate([solve_chain(*case, from_rest=True, eigenvalue=True).outcome for case in cases])
    assert len(taken) < 0.5 * len(outcomes)
    assert {Outcome.CONVERGED, Outcome.UNSTABLE} <= set(outcomes.tolist())
