"""Derivatives by parameters where friction follows the travel of the cables."""

import numpy as np
import pytest
from mechanics.differences import derivatives, good, loop, parameters, worst_errors

from prb3r.mechanics.chain import loads


@pytest.mark.parametrize("presliding", [1e-3, 1e-4])
def test_history_through_reversals(presliding):
    worst = worst_errors(*loop(presliding), step=1e-5)
    assert max(worst.values()) < 1e-5, worst


def test_history_with_a_short_presliding_length():
    """Differences carry the solver's tolerance over that length and jump where a hole turns at another sub-step."""
    chain, steps = loop(1e-5)
    names = ("stiffness", "friction", "offset", "length", "tension")
    worst = worst_errors(chain, steps, names, step=1e-4)
    assert max(worst.values()) < 1e-4, worst


LATER = {"friction_exponent": 0.3, "friction_tension": 50.0, "umbilical": 0.5, "softening": 0.02, "zero_drift": 0.5}


@pytest.mark.parametrize(
    ("presliding", "rich"),
    [(1e-4, {"edges": True, "pulley": 0.9}), (1e-3, {"clearance": 1e-3}), (1e-3, LATER | {"pulley": 0.9})],
)
def test_history_from_a_rest_under_constant_loads(presliding, rich):
    chain, steps = loop(presliding)
    rich = chain._replace(constant=loads(chain, [5.0, 0, 2, 0], 0.0, 0.05, [0.2, 0.3]), **rich)
    worst = worst_errors(rich, steps, step=1e-5)
    assert max(worst.values()) < 1e-5, worst


def test_history_by_the_presliding_length():
    chain, steps = loop(1e-4)
    problem = {"presliding": lambda v: (chain._replace(presliding=1e-4 * v), steps)}
    found = derivatives(chain, steps, problem)
    ahead, behind = (good(*problem["presliding"](1 + side * 1e-5)) for side in (1, -1))
    for mine, field in zip(found, ("x", "y", "angle", "tension"), strict=True):
        difference = (getattr(ahead, field) - getattr(behind, field)) / 2e-5
        assert mine[0] == pytest.approx(difference, abs=1e-5 * np.abs(difference).max())


@pytest.mark.parametrize("presliding", [1e-4, 1e-5])
def test_history_scaling_stiffness_and_all_loads_alike_changes_nothing(presliding):
    chain, steps = loop(presliding)
    problems = {
        "stiffness": lambda v: (chain._replace(stiffness=chain.stiffness * v), steps),
        "loads": lambda v: (chain, steps._replace(tension=steps.tension * v, tip=steps.tip * v)),
    }
    dx, dy, dangle, dtension = derivatives(chain, steps, problems)
    for field in (dx, dy, dangle):
        assert field.sum(0) == pytest.approx(0, abs=1e-7 * np.abs(field).max())
    assert dtension.sum(0) == pytest.approx(good(chain, steps).tension, rel=1e-5, abs=1e-5)


def test_history_sequences_from_rest_share_one_call():
    chain, steps = loop(1e-4)
    anew = np.array([True, False, False, True, False])
    together = derivatives(chain, steps, parameters(chain, steps), from_rest=anew)
    for part in (slice(0, 3), slice(3, 5)):
        own = type(steps)(*(field[part] for field in steps))
        alone = derivatives(chain, own, parameters(chain, own))
        for mine, other in zip(together, alone, strict=True):
            assert mine[:, part] == pytest.approx(other, rel=1e-12, abs=1e-15)


def test_holes_that_all_slip_have_forgotten():
    """Pulled once from rest, the derivatives are those of declared friction, but for holes that never moved."""
    chain, _ = loop(1e-5)
    steps = loads(chain, [[100.0, 0, 0, 0]])
    declared = chain._replace(presliding=0.0)
    for name in ("stiffness", "friction", "offset", "tension"):
        history, plain = (derivatives(kind, steps, {name: parameters(kind, steps)[name]}) for kind in (chain, declared))
        for mine, other in zip(history[:3], plain[:3], strict=True):
            assert mine == pytest.approx(other, rel=1e-4, abs=1e-6 * np.abs(other).max())
