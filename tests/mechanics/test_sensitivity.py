"""Derivatives by parameters: against differences of whole solves, against closed forms, and against exact laws."""

import pickle

import numpy as np
import pytest
from prototype import ELASTICA, PRB_3R, RIGIDITY, prototype, random_chain, random_loads

from prb3r.mechanics.chain import Contact, Law, Term, loads
from prb3r.mechanics.derivatives.sensitivity import chain_sensitivities, direction
from prb3r.mechanics.derivatives.sensitivity import derivatives as derivatives_along
from prb3r.mechanics.derivatives.solved_path import solve_path
from prb3r.mechanics.equilibrium import Outcome, solve_chain

STEP = 1e-5


def parameters(chain, steps):
    """Problems as functions of one number each, which is 1 for the chain and the loads themselves."""
    first = np.arange(len(chain.reach)) == 0
    plate = (np.arange(chain.plates) == 1)[:, None]
    pulley = np.ones(len(chain.reach)) * chain.pulley
    return {
        "stiffness": lambda v: (chain._replace(stiffness=chain.stiffness * v), steps),
        "one plate": lambda v: (chain._replace(stiffness=chain.stiffness * (1 + (v - 1) * plate)), steps),
        "friction": lambda v: (chain._replace(friction=chain.friction + (v - 1)), steps),
        "offset": lambda v: (chain._replace(offset=chain.offset + 0.01 * (v - 1) * first), steps),
        "length": lambda v: (chain._replace(arc=chain.arc * v, stiffness=chain.stiffness / v), steps),
        "clamp": lambda v: (chain._replace(clamp=chain.clamp + 0.01 * (v - 1)), steps),
        "disk": lambda v: (chain._replace(disk=chain.disk + 0.01 * (v - 1)), steps),
        "rest": lambda v: (chain._replace(rest=chain.rest + 0.01 * (v - 1)), steps),
        "pulley": lambda v: (chain._replace(pulley=pulley * v), steps),
        "clearance": lambda v: (chain._replace(clearance=chain.clearance + 1e-3 * (v - 1)), steps),
        "law": lambda v: (chain._replace(law=chain.law._replace(cubic=chain.law.cubic + 0.1 * (v - 1))), steps),
        "tension": lambda v: (chain, steps._replace(tension=steps.tension * v)),
        "force": lambda v: (chain, steps._replace(force=steps.force + 0.1 * (v - 1))),
        "moment": lambda v: (chain, steps._replace(moment=steps.moment + 0.1 * (v - 1))),
        "tip": lambda v: (chain, steps._replace(tip=steps.tip + (v - 1))),
    }


def good(chain, steps, **options):
    found = solve_chain(chain, steps, **options)
    assert (found.outcome == Outcome.CONVERGED).all()
    return found


def derivatives(chain, steps, problems, **options):
    """(p, ...) x, y, angles and tensions of all steps in one row a parameter."""
    found = chain_sensitivities(
        chain, steps, [direction(problem, 1.0, STEP) for problem in problems.values()], **options
    )
    fields = found.dx, found.dy, found.dangle, found.dtension
    return [np.moveaxis(field, -1, 0) for field in fields]


def worst_errors(chain, steps, names=None, step=1e-4, **options):
    """{parameter: largest difference to central differences of whole solves, of the largest derivative}.

    Solves stop at 1e-11 rad; where they stop depends on parameters, too, which shows in derivatives below 0.01.
    """
    problems, worst = parameters(chain, steps), {}
    problems = {name: problems[name] for name in names or problems}
    found = derivatives(chain, steps, problems, **options)
    for k, (name, problem) in enumerate(problems.items()):
        ahead, behind = (good(*problem(1 + side * step), **options) for side in (1, -1))
        pairs = zip(found, ("x", "y", "angle", "tension"), strict=True)
        errors = []
        for mine, field in pairs:
            difference = (getattr(ahead, field) - getattr(behind, field)) / (2 * step)
            errors.append(np.abs(mine[k] - difference).max() / (np.abs(difference).max() + 0.01))
        worst[name] = max(errors)
    return worst


# against differences of whole solves


@pytest.mark.parametrize("dead", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_declared_friction(dead, seed):
    rng = np.random.default_rng([seed, 8])
    chain = random_chain(rng)
    worst = worst_errors(chain, random_loads(rng, chain, 3, dead=dead))
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
    )
    worst = worst_errors(rich, steps)
    assert max(worst.values()) < 1e-5, worst


@pytest.mark.parametrize("dead", [0.0, 0.4])
def test_tied_angles(dead):
    rng = np.random.default_rng(10)
    chain = random_chain(rng, ELASTICA)._replace(tied=True, clearance=1e-3)
    worst = worst_errors(chain, random_loads(rng, chain, 3, dead=dead))
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


# friction that follows the cables' travel: derivatives remember, too


def loop(presliding, mu=0.3):
    """Pulled, let go, pulled again, then a second cable and a tip load: holes stick, slip and turn back."""
    chain = prototype(mu)._replace(presliding=presliding)
    table = np.zeros((5, 4))
    table[:, 0], table[3:, 2] = [100, 60, 80, 80, 30], [40, 70]
    tip = np.zeros((5, 2))
    tip[2:] = [0.5, -1.0]
    return chain, loads(chain, table, tip=tip)


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


@pytest.mark.parametrize(("presliding", "rich"), [(1e-4, {"edges": True, "pulley": 0.9}), (1e-3, {"clearance": 1e-3})])
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
