"""Derivatives by parameters: against differences of whole solves, against closed forms, and against exact laws."""

import pickle

import numpy as np
import pytest
from mechanics.differences import STEP, aging, derivatives, good, loop, parameters, worst_errors
from prototype import PRB_3R, RIGIDITY, prototype, random_chain, random_loads

from prb3r.mechanics.chain import Term, loads
from prb3r.mechanics.derivatives.sensitivity import chain_sensitivities, direction
from prb3r.mechanics.derivatives.sensitivity import derivatives as derivatives_along
from prb3r.mechanics.derivatives.solved_path import solve_path
from prb3r.mechanics.equilibrium import Outcome
from prb3r.mechanics.plate_law import Contact, Law

# against differences of whole solves


@pytest.mark.parametrize("dead", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_declared_friction(dead, seed):
    rng = np.random.default_rng([seed, 8])
    chain = random_chain(rng)
    worst = worst_errors(chain, aging(random_loads(rng, chain, 3, dead=dead)))
    assert max(worst.values()) < 1e-5, worst


@pytest.mark.parametrize("seed", range(2))
def test_everything_at_once(seed):
    rng = np.random.default_rng([seed, 9])
    chain = random_chain(rng)
    steps = random_loads(rng, chain, 3)
    rich = chain._replace(
        edges=True,
        clearance=1e-3,
        pulley=0.9,
        law=Law(1e-3),
        contact=Contact(0.05, 0.5),
        constant=random_loads(rng, chain)._replace(slip=steps.slip[:1]),
        tip_efficiency=0.8,
        friction_exponent=0.3,
        friction_tension=10.0,
        umbilical=0.5,
        softening=0.05,
        zero_drift=0.2,
    )
    worst = worst_errors(rich, aging(steps))
    assert max(worst.values()) < 1e-5, worst


# laws


def test_scaling_stiffness_and_all_loads_alike_changes_nothing():
    rng = np.random.default_rng(11)
    chain = random_chain(rng)
    steps = random_loads(rng, chain, 4)
    problems = {
        "stiffness": lambda v: (chain._replace(stiffness=chain.stiffness * v), steps),
        "loads": lambda v: (chain, type(steps)(*(field * v for field in steps))._replace(slip=steps.slip)),
    }
    dx, dy, dangle, dtension = derivatives(chain, steps, problems)
    for field in (dx, dy, dangle):
        assert field.sum(0) == pytest.approx(0, abs=1e-9 * np.abs(field).max())
    assert dtension.sum(0) == pytest.approx(good(chain, steps).tension, rel=1e-8)


def test_a_tip_couple_bends_in_inverse_proportion_to_stiffness():
    """Cable 1 without friction at small tension: all plates bend by T d l / EI, to first order in the bend."""
    chain, pull = prototype(mu=0.0), 1e-3
    steps = loads(chain, [[pull, 0, 0, 0]])
    (dangle,) = derivatives(chain, steps, {"E": lambda v: (chain._replace(stiffness=chain.stiffness * v), steps)})[2]
    springs = float((1 / PRB_3R.stiffness).sum())  # 0.9988: Chen's set, under a pure moment
    bend = 14 * pull * 0.0255 * 0.014 / RIGIDITY * springs
    assert dangle[0, -1] == pytest.approx(-bend, rel=1e-4)


def test_tension_behind_a_hole_falls_with_friction_by_the_capstan_law():
    """With the shape held by stiff plates, dT/dmu = -wrap T (Eq. 6): here by pre-bent plates."""
    chain = prototype(mu=0.2)
    stiff = chain._replace(stiffness=1e9 * chain.stiffness, rest=chain.rest + 0.06 / PRB_3R.stiffness)
    steps = loads(stiff, [[50.0, 0, 0, 0]])
    dmu = {"mu": lambda v: (stiff._replace(friction=stiff.friction + (v - 1)), steps)}
    (dtension,) = derivatives(stiff, steps, dmu)[3]
    found = good(stiff, steps)
    ahead = np.exp(1j * found.angle[0])
    hole, half = found.x[0] + 1j * found.y[0] + 0.0255j * ahead, chain.disk / 2 * ahead
    spans = (hole - half)[1:] - (hole + half)[:-1]
    wrap = np.cumsum(np.abs(np.angle(spans / np.append(1.0, spans[:-1]))))
    assert wrap == pytest.approx(0.06 * (np.arange(14) + 0.5), rel=0.05)  # half a plate's bend before the first span
    assert found.tension[0, :, 0] == pytest.approx(50 * np.exp(-0.2 * wrap), rel=1e-4)
    assert dtension[0, :, 0] == pytest.approx(-wrap * found.tension[0, :, 0], rel=1e-4)


def test_a_slack_cable_stays_slack_and_an_idle_one_can_be_pulled():
    chain = prototype()
    constant = loads(chain, np.zeros(4))
    steps = loads(chain, [[50.0, 0, 0, 0]])

    def offset(by):
        return chain._replace(constant=constant._replace(tension=constant.tension + by)), steps

    for nominal, change in ((0.0, 1.0), (-1.0, 0.0)):

        def problem(v, nominal=nominal):
            return offset(np.array([0, 0, 0, nominal + v]))

        found = chain_sensitivities(*problem(0.0), [direction(problem, 0.0, STEP)])
        ahead, here = good(*problem(1e-4)), good(*problem(0.0))
        assert found.dtension[0, 0, 3, 0] == pytest.approx(change, rel=0.1)
        assert found.dy[0, -1, 0] == pytest.approx((ahead.y[0, -1] - here.y[0, -1]) / 1e-4, rel=1e-3)


def test_a_failed_step_has_no_derivatives():
    chain = prototype(mu=0.0)
    steps = loads(chain, [[10.0, 0, 0, 0], [1e6, 0, 0, 0], [20.0, 0, 0, 0]])
    found = chain_sensitivities(chain, steps, [direction(parameters(chain, steps)["stiffness"], 1.0, STEP)])
    lost = found.equilibria.outcome == Outcome.NO_EQUILIBRIUM
    assert lost.tolist() == [False, True, False]
    for field in (found.dx, found.dy, found.dangle, found.dtension):
        assert (np.isnan(field).reshape(3, -1).all(1) == lost).all()
        assert np.isfinite(field[~lost]).all()


def test_parameters_do_not_disturb_each_other_however_many():
    chain = prototype()
    steps = loads(chain, np.linspace(5, 100, 20)[:, None] * [1, 0, 0.3, 0])
    directions = [direction(problem, 1.0, STEP) for problem in parameters(chain, steps).values()]
    many = chain_sensitivities(chain, steps, directions * 3)
    for k, one in enumerate(directions):
        assert chain_sensitivities(chain, steps, [one]).dy[..., 0] == pytest.approx(
            many.dy[..., k], rel=1e-12, abs=1e-15
        )
    assert many.dy.shape[-1] == 3 * len(directions) > 32


@pytest.mark.parametrize("presliding", [0.0, 1e-4])
def test_a_path_solved_once_has_the_derivatives_by_whatever_is_asked_later(presliding):
    chain, steps = loop(presliding)
    directions = [direction(problem, 1.0, STEP) for problem in parameters(chain, steps).values()]
    together = chain_sensitivities(chain, steps, directions, from_rest=[True, False, False, True, False])
    solved = solve_path(chain, steps, from_rest=[True, False, False, True, False])
    assert (solved.equilibria.x == together.equilibria.x).all()
    solved = pickle.loads(pickle.dumps(solved))
    for k, along in enumerate(directions):
        for name in ("dx", "dy", "dangle", "dtension", "dslip"):
            expected = getattr(together, name)[..., k]
            assert getattr(derivatives_along(solved, [along]), name)[..., 0] == pytest.approx(
                expected, rel=1e-9, abs=1e-11 * (1 + np.abs(expected).max(initial=0.0))
            )


def test_a_direction_may_change_numbers_only():
    chain = prototype()
    steps = loads(chain, [[50.0, 0, 0, 0]])
    broken = chain._replace(reach=np.array([0, 7, 7, 14]))
    with pytest.raises(ValueError, match="direction 0 changes the kind"):
        chain_sensitivities(chain, steps, [direction(lambda v: (broken, steps), 1.0, STEP)])
    closed = chain._replace(closure=(Term("bend", np.ones(14)),))
    with pytest.raises(ValueError, match="follow the state"):
        chain_sensitivities(closed, steps, [direction(lambda v: (closed, steps), 1.0, STEP)])
    with pytest.raises(ValueError, match="at least one"):
        chain_sensitivities(chain, steps, [])
