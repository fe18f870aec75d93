"""Equilibria side by side: those that are found one by one, and none that depends on what is beside it."""

import numpy as np
import pytest
from numba import typeof
from prototype import ELASTICA, PRB_1R, PRB_3R, prototype, random_chain

from prb3r.mechanics import equilibrium
from prb3r.mechanics.chain import Chain, loads
from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.lanes.number import LANES
from prb3r.mechanics.plate_law import Contact, Law
from prb3r.mechanics.records import pack
from prb3r.mechanics.side_by_side import lane_space, stand_alone

SEED = 20261124
FIELDS = ("outcome", "reached", "iterations", "work", "residual", "q", "x", "y", "angle", "tension", "moment")


def pulls(count, most=80.0, seed=SEED):
    """Tensions of all cables, a third of them idle, and slips either way."""
    rng = np.random.default_rng(seed)
    tension = rng.uniform(0, most, (count, 4)) * (rng.random((count, 4)) > 1 / 3)
    return tension, rng.choice([-1.0, 0.0, 1.0], (count, 4))


def one_by_one(monkeypatch, chain, steps, **options):
    with monkeypatch.context() as patched:
        patched.setattr(equilibrium, "stand_alone", lambda chain, rows, anew, eigenvalue: np.zeros(len(anew), bool))
        return solve_chain(chain, steps, **options)


def chains():
    plain = prototype(0.3)
    yield "prb3r", plain
    yield "frictionless", prototype(0.0)
    yield "prb1r", prototype(0.3, plate=PRB_1R)
    yield "elastica", prototype(0.3, first_segment=2.0, plate=ELASTICA)
    yield "edges", plain._replace(edges=True, wrap_saturation=0.5)
    yield "clearance", plain._replace(clearance=5e-4)
    yield "pulley", plain._replace(pulley=np.array([0.9, 1.0, 0.8, 0.95]))
    yield "touching", plain._replace(contact=Contact(0.06, 5.0))
    yield "bent at rest", plain._replace(rest=np.full_like(plain.rest, 0.01))
    yield "broken cable", plain._replace(reach=np.array([0, 7, 7, 14]))


@pytest.mark.parametrize(("name", "chain"), list(chains()), ids=lambda value: value if isinstance(value, str) else "")
def test_they_are_those_that_are_found_one_by_one(monkeypatch, name, chain):
    steps = loads(chain, *pulls(5 * LANES + 3))
    options = {"from_rest": True, "eigenvalue": True}
    beside, alone = solve_chain(chain, steps, **options), one_by_one(monkeypatch, chain, steps, **options)
    assert (beside.outcome == alone.outcome).all()
    assert (beside.outcome == Outcome.CONVERGED).sum() > 5
    for field in ("x", "y", "angle", "q"):
        np.testing.assert_allclose(getattr(beside, field), getattr(alone, field), atol=1e-10, rtol=0)
    for field in ("tension", "moment", "lowest_eigenvalue"):
        np.testing.assert_allclose(getattr(beside, field), getattr(alone, field), rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("plate", [PRB_3R, ELASTICA])
def test_no_load_depends_on_those_beside_it(plate):
    """To the last bit: in another order, fewer of them, beside loads that take more steps or have no equilibrium."""
    chain = prototype(0.3, plate=plate)
    tension, slip = pulls(4 * LANES)
    tension[::5] *= 40.0
    everything = solve_chain(chain, loads(chain, tension, slip), from_rest=True, eigenvalue=True)
    order = np.random.default_rng(SEED).permutation(len(tension))[: 2 * LANES + 1]
    some = solve_chain(chain, loads(chain, tension[order], slip[order]), from_rest=True, eigenvalue=True)
    for field in (*FIELDS, "lowest_eigenvalue"):
        np.testing.assert_array_equal(getattr(everything, field)[order], getattr(some, field), err_msg=field)


def test_loads_that_take_more_go_the_way_of_one_load(monkeypatch):
    """Plates turn farther than one step may take them, or no equilibrium is there."""
    chain = prototype(0.3, first_segment=0.05)
    tension, slip = pulls(3 * LANES, most=60.0)
    steps = loads(chain, tension, slip)
    beside = solve_chain(chain, steps, from_rest=True, eigenvalue=True)
    alone = one_by_one(monkeypatch, chain, steps, from_rest=True, eigenvalue=True)
    assert len(set(beside.outcome)) > 1
    assert (beside.outcome == alone.outcome).all()
    np.testing.assert_allclose(beside.reached, alone.reached, rtol=1e-9)
    np.testing.assert_allclose(beside.x, alone.x, atol=1e-10)


def taken(chain: Chain, steps, from_rest):
    anew = np.array(from_rest)
    return stand_alone(chain, equilibrium.acting(chain, steps, anew), anew, True).tolist()


def test_only_steps_that_stand_alone_are_taken():
    chain = prototype(0.3)
    steps = loads(chain, np.full((4, 4), 5.0))
    assert taken(chain, steps, [True] * 4) == [True] * 4
    assert taken(chain, steps, [True, False, True, True]) == [False, False, True, True]
    dead = steps._replace(tip=np.array([[0, 0], [0, 1.0], [0, 0], [0, 0]]))
    assert taken(chain, dead, [True] * 4) == [True, False, True, True]
    for change in (
        {"presliding": 3e-5},
        {"law": Law(knee=np.full((14, 2), 5.0), ratio=0.1)},
        {"tied": True},
        {"umbilical": 0.1},
        {"softening": 0.01},
        {"friction_exponent": 0.2},
    ):
        assert not any(taken(chain._replace(**change), steps, [True] * 4)), change


def test_kernels_are_compiled_once_for_any_number_of_cables():
    """What they are compiled for is the type of what they are given."""
    rng, kinds = np.random.default_rng(SEED), set()
    for cables in (1, 2, 4):
        packed = pack(random_chain(rng, cables=cables))
        kinds.add((typeof(packed), typeof(lane_space(packed))))
    assert len(kinds) == 1
