"""Fitted moment laws: each term against another way to the same mechanics, and what happens where none exists."""

import numpy as np
import pandas as pd
import pytest
import tomli_w

from prb3r.errors import SpecError
from prb3r.mechanics.budget import Allowance
from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import Outcome
from prb3r.model.laws import self_consistent
from prb3r.model.laws.moment_law import influences, time_within
from prb3r.model.laws.self_consistent import MAX_PASSES, NOT_CLOSED, equilibria_of
from prb3r.model.manipulator import Manipulator, load_manipulator
from prb3r.model.solve import solve as solve_steps
from prb3r.study.cases import Family
from prb3r.study.measure import outcome_columns
from prb3r.study.work import solve_cases

RIGIDITY, ARC = 0.24, 0.014
PLATE = {"plates": 4, "length_m": 0.03, "clamp_m": 0.008, "bending_stiffness_n_m2": RIGIDITY}
CABLES = [
    {"name": "up", "offset_m": 0.02, "ends_at_segment": 1},
    {"name": "down", "offset_m": -0.02, "ends_at_segment": 1},
]
NAMES = ["bend", "bend_cubed", "tension", "wrap", "direction", "time"]


def manipulator(*terms, plates=4, mu=0.0, history=False, effects=(), segment=(), **top):
    friction = {"coefficient": mu, "direction": "history" if history else "declared", "presliding_m": 1e-4}
    law = [{"kind": "empirical_moment", "terms": [*terms]}] if terms else []
    data = {"name": "rig", "youngs_modulus_pa": 1e11, "model": "elastica", "disk": {"thickness_m": 0.004}}
    data |= {"segment": [PLATE | {"plates": plates} | dict(segment)], "cable": CABLES, "friction": friction}
    return Manipulator.model_validate(data | {"effect": [*effects, *law]} | top)


def term(of, coefficient, *plates):
    return {"of": of, "coefficient": coefficient} | ({"plates": list(plates)} if plates else {})


def state(rig, *pulls, slip=-1.0, tip=0.0, **options):
    """Equilibria for tensions of both cables, step by step."""
    chain = rig.chain()
    found = equilibria_of(chain, loads(chain, np.array(pulls or [(40, 0)], float), slip, tip=tip), **options)
    assert (found.outcome == Outcome.CONVERGED).all()
    return found


def same(a, b, tolerance=1e-9):
    return all(getattr(a, name) == pytest.approx(getattr(b, name), abs=tolerance) for name in ("x", "y", "angle"))


def test_a_constant_moment_makes_circles():
    found = state(manipulator(term("constant", 0.3)), (0, 0))
    assert np.diff(found.angle[0]) == pytest.approx(np.full(4, 0.3 * ARC / RIGIDITY), rel=1e-12)
    along = state(manipulator(term("position", 0.3), term("constant", 0.1, 2, 3)), (0, 0))
    moment = 0.3 * np.array([-1, -1 / 3, 1 / 3, 1]) + 0.1 * np.array([0, 1, 1, 0])
    assert np.diff(along.angle[0]) == pytest.approx(moment * ARC / RIGIDITY, rel=1e-12)


@pytest.mark.parametrize("share", [0.3, 0.9, -0.5, -6.0])
def test_a_moment_that_follows_the_bend_is_another_stiffness_in_pure_bending(share):
    """EI k = M + c bend and a circle: bend = M / (EI / l - c).  Opposite cables of equal pull leave no moment; a
    constant moment does."""
    stiffness = RIGIDITY / ARC
    found = state(manipulator(term("constant", 0.2), term("bend", share * stiffness)), (0, 0))
    assert np.diff(found.angle[0]) == pytest.approx(np.full(4, 0.2 / (stiffness * (1 - share))), rel=1e-7)


@pytest.mark.parametrize("history", [False, True])
def test_a_moment_that_follows_the_bend_is_nearly_another_stiffness_under_cables(history):
    """The moment is the plate's mean curvature's, so the shape within a plate differs in second order only."""
    law = manipulator(term("bend", 0.2 * RIGIDITY / ARC), mu=0.2, history=history)
    soft = manipulator(segment={"bending_stiffness_n_m2": 0.8 * RIGIDITY}, mu=0.2, history=history)
    pulls = [(20, 0), (40, 10), (15, 10)]
    assert same(state(law, *pulls), state(soft, *pulls), 2e-5)
    assert not same(state(law, *pulls), state(manipulator(mu=0.2, history=history), *pulls), 1e-3)


def test_a_moment_that_follows_the_tension_is_another_lever():
    """One plate, no friction, a short arc: the cable's moment hardly varies along it."""
    law = state(manipulator(term("tension", 0.25), plates=1), (40, 0))
    chain = manipulator(plates=1).chain()
    assert law.moment[0, 0] == pytest.approx(
        equilibria_of(chain, loads(chain, [40, 0], tip=0, moment=0.25 * 40 * 0.02)).moment[0, 0], rel=1e-9
    )
    bare = state(manipulator(plates=1), (40, 0)).moment[0, 0].mean()
    assert law.moment[0, 0].mean() / bare == pytest.approx(1.25, rel=2e-3)


def test_every_term_is_what_its_name_says():
    """The bending moment beyond that of the same loads without a law, on the same shape, is the law of that shape."""
    for history in (False, True):
        rig = manipulator(*(term(name, 0.03, 1, 3) for name in NAMES), mu=0.3, history=history)
        chain = rig.chain()
        steps = loads(chain, [[30, 5], [60, 5], [20, 25]], [[-1, 1], [-1, -1], [1, -1]])
        found = equilibria_of(chain, steps, number=np.array([2, 3, 8]))
        bend = np.diff(found.angle, axis=1)
        pull = 0.02 * (found.tension[..., 0] - found.tension[..., 1])
        slip = found.slip if history else steps.slip[:, None, :]
        direction = 0.02 * (slip[..., 0] * found.tension[..., 0] - slip[..., 1] * found.tension[..., 1])
        time = np.array([[0.25], [0.375], [1.0]])
        law = bend + bend**3 + pull * (1 + np.cumsum(np.abs(bend), 1)) + direction + time
        law *= 0.03 * np.array([1, 0, 1, 0])
        bare = chain._replace(closure=())
        again = equilibria_of(bare, steps._replace(moment=law))
        assert same(found, again, 1e-8)
        known = influences(chain, steps, found, time[:, 0])
        assert known["direction"] == pytest.approx(direction)
        assert known["position"][1] == pytest.approx([-1, -1 / 3, 1 / 3, 1])


@pytest.mark.parametrize("name", [*NAMES, "constant", "position"])
def test_a_law_of_no_size_changes_nothing(name):
    pulls = [(40, 10), (20, 30)]
    assert same(state(manipulator(term(name, 0.0), mu=0.3), *pulls), state(manipulator(mu=0.3), *pulls), 1e-12)


def test_the_law_acts_at_rest_where_the_path_begins():
    """Gravity bends the rig at rest: cables do not travel while a law of that bend comes to act."""
    sag = {"kind": "gravity", "y_m_s2": -30.0}
    rig = manipulator(term("bend", 8.0), effects=[sag], mu=0.3, history=True)
    rig = rig.model_copy(update={"disk": rig.disk.model_copy(update={"mass_kg": 0.05})})
    found = state(rig, (0, 0), (0, 0))
    assert np.abs(np.diff(found.angle[0])).min() > 1e-3
    assert found.slip == pytest.approx(0.0, abs=1e-5)


def test_sequences_in_one_call_are_those_one_by_one():
    rig = manipulator(term("time", 0.05), term("wrap", 0.3), mu=0.2)
    pulls = [(20, 0), (40, 0), (0, 30), (10, 30)]
    together = state(rig, *pulls, from_rest=np.array([True, False, True, False]))
    for part in (slice(0, 2), slice(2, 4)):
        alone = state(rig, *pulls[part])
        assert together.angle[part] == pytest.approx(alone.angle, abs=1e-9)
    assert time_within(np.array([1, 0, 1, 0, 0], bool)) == pytest.approx([0.5, 1, 1 / 3, 2 / 3, 1])
    cloud = state(rig, *pulls, from_rest=True, detail=False)
    assert cloud.angle[[1, 3]] == pytest.approx(together.angle[[1, 3]], abs=1e-9)
    assert len(cloud.tension) == 0


@pytest.mark.parametrize("model", ["prb3r", "constant-curvature"])
def test_laws_work_in_every_model(model):
    law, plain = (manipulator(*terms, model=model) for terms in ([term("tension", 0.2)], []))
    more = state(plain, (48, 0))
    assert state(law, (40, 0)).angle == pytest.approx(more.angle, rel=3e-3)


def test_a_law_that_pushes_further_than_the_plate_resists_has_no_equilibrium():
    for plates, history in ((4, False), (1, True)):
        rig = manipulator(term("bend", 1.2 * RIGIDITY / ARC, 1), plates=plates, mu=0.1, history=history)
        chain = rig.chain()
        steps = loads(chain, [[0, 0], [10, 0], [0, 0]])
        found = equilibria_of(chain, steps, eigenvalue=True)
        ending = Outcome.NO_EQUILIBRIUM if history else Outcome.CONVERGED
        assert found.outcome.tolist() == [Outcome.CONVERGED, Outcome.NO_EQUILIBRIUM, ending]
        assert found.closed.tolist() == [True, False, not history]
        assert np.isnan(found.x[1, 1:]).all()
        assert np.isnan(found.lowest_eigenvalue[1])
    assert MAX_PASSES >= 60


def test_a_law_beyond_all_reason_is_given_up_by_the_work_it_takes(monkeypatch):
    """A minute before, sixty passes along a path on which every step is lost."""
    rig = manipulator(term("bend", 1e9), mu=0.3, history=True)
    chain, pulls = rig.chain(), [[10.0 * k, 0] for k in (1, 3, 5, 2)]
    monkeypatch.setattr(self_consistent, "WORK_OF_SEQUENCE", 100_000)
    monkeypatch.setattr(self_consistent, "WORK_OF_STEP", 0)
    found = equilibria_of(chain, loads(chain, pulls), eigenvalue=True)
    assert found.outcome.tolist() == [Outcome.GAVE_UP] * 4
    assert found.reason(0).startswith("Given up")
    assert "nan" not in found.reason(0)
    one_pass = equilibria_of(manipulator(mu=0.3, history=True).chain(), loads(chain, pulls)).work.sum()
    assert one_pass < 100_000 < found.work.sum()
    monkeypatch.setattr(self_consistent, "WORK_OF_STEP", 10**9)
    fitted = manipulator(term("bend", 0.2 * RIGIDITY / ARC), mu=0.3, history=True).chain()
    assert (equilibria_of(fitted, loads(fitted, pulls)).outcome == Outcome.CONVERGED).all()


def test_all_iterations_together_may_take_what_is_allowed():
    """As in fits, where a path with a law may take no more than one without."""
    chain = manipulator(term("bend", 1e9), mu=0.3, history=True).chain()
    steps = loads(chain, [[10.0 * k, 0] for k in (1, 3, 5, 2)])
    work = {most: equilibria_of(chain, steps, allowance=Allowance(most, 0)).work.sum() for most in (100_000, 200_000)}
    assert 100_000 < work[100_000] < 200_000 < work[200_000] < 400_000


def test_solve_and_studies_know_the_law(monkeypatch):
    rig, steps = manipulator(term("time", 0.1)), [{"cable_up_n": 20.0}, {"cable_up_n": 40.0}]
    table = solve_steps(rig, pd.DataFrame([{"sequence": "a", "step": 5 * k} | row for k, row in enumerate(steps, 1)]))
    expected = state(rig, (20, 0), (40, 0))
    assert table["y_m"].to_numpy() == pytest.approx(expected.y.ravel(), abs=1e-12)
    settings = {"manipulator": rig.model_dump(exclude_none=True), "broken": [], "initial": {}, "cloud": {}, "reach": {}}

    def solved_case():
        family = Family(np.zeros(1, int), settings | {"step": steps})
        return solve_cases(family, family.manipulator(), family.manipulator().chain())

    solved = solved_case()
    assert solved.states.y == pytest.approx(expected.y, abs=1e-12)
    settings["manipulator"]["effect"][0]["terms"] = [term("bend", 40.0)]
    row = outcome_columns(solved_case())
    assert (row["outcome"][0], row["reason"][0]) == ("no equilibrium", NOT_CLOSED)
    monkeypatch.setattr(self_consistent, "WORK_OF_SEQUENCE", 0)
    monkeypatch.setattr(self_consistent, "WORK_OF_STEP", 0)
    row = outcome_columns(solved_case())
    assert (row["outcome"][0], row["reason"][0]) == ("gave up", Outcome.GAVE_UP.sentence)


@pytest.mark.parametrize(
    ("terms", "said"),
    [
        ([], "at least 1"),
        ([term("bent", 1.0)], "'bend'.*not \"bent\""),
        ([term("bend", 1.0, 5)], "term 1: there is no plate 5, only 4"),
        ([{"of": "bend"}], "'coefficient' is missing"),
        ([term("bend", "much")], "a number"),
        ([term("bend", 1.0) | {"unit": "N m"}], "unknown key 'unit'"),
    ],
)
def test_bad_terms_are_refused(terms, said, tmp_path):
    path = tmp_path / "m.toml"
    effect = {"kind": "empirical_moment", "terms": terms}
    path.write_text(tomli_w.dumps(manipulator().model_dump(exclude_none=True) | {"effect": [effect]}))
    with pytest.raises(SpecError, match=said):
        load_manipulator(path)
