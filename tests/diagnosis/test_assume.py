"""Starting from effects found before: refitted, dropped where contradicted, and nothing invented beside them."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import MU, Case, E, diagnosed, manipulator, recorded
from diagnosis.suspected import scope

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.run import diagnosis_of
from prb3r.diagnosis.search.assumed import assumed_of, hypothesis_at, known_states
from prb3r.model.effects.loads import Gravity
from prb3r.model.given import manipulator_of

WEAK = {"kind": "weakened_plate", "plate": 4, "factor": 0.7}


@pytest.fixture(scope="module")
def again():
    """The recording with a weak plate, diagnosed with its own explanation."""
    return run_stages(Task(recorded(), assumed=diagnosed().manipulators["explained"]))


@pytest.mark.long
def test_the_same_data_with_their_own_explanation_name_the_same_and_no_more(again):
    assert [effect.name for effect in again.effects] == [effect.name for effect in diagnosed().effects]
    factor, before = again.effects[0].parameters["factor"], diagnosed().effects[0].parameters["factor"]
    assert factor.value == pytest.approx(before.value, abs=0.1 * (before.high - before.low))
    assert factor.high - factor.low == pytest.approx(before.high - before.low, rel=0.1)  # nothing counted twice
    assert not any("assumed" in remark for remark in again.remarks)


def test_what_is_assumed_is_refitted_and_what_cannot_be_is_said():
    strange = [
        {**WEAK, "factor": 0.95},
        {"kind": "weakened_plate", "plate": 9, "factor": 0.9},
        {"kind": "empirical_moment", "terms": [{"of": "bend", "coefficient": 0.1}]},
    ]
    segment = manipulator()["segment"][0]
    longer = manipulator(effects=strange) | {"segment": [{**segment, "plates": 6}, segment]}
    found = diagnosis_of(recorded(), assume=longer)
    assert [effect.name for effect in found.effects] == ["weakened_plate (plate 4)"]
    factor = found.effects[0].parameters["factor"]
    assert factor.low < WEAK["factor"] < factor.high
    assert any("weakened_plate (plate 9): there is no plate 9, only 6" in remark for remark in found.remarks)
    assert any("empirical_moment: no effect that a diagnosis looks for" in remark for remark in found.remarks)


@pytest.mark.long
def test_what_the_data_contradict_is_dropped_and_said():
    assumed = manipulator_of(manipulator(effects=[{"kind": "weakened_plate", "plate": 2, "factor": 0.6}]))
    found = run_stages(Task(recorded(Case(hidden=(), seed=1)), assumed=assumed))
    assert found.verdict == "adequate"
    assert sum(model.probability for model in found.models if "weakened_plate (plate 2)" in model.effects) < 0.05
    (remark,) = [
        remark for remark in found.remarks if remark.startswith("assumed, but not found again: weakened_plate")
    ]
    assert "(plate 2): these data contradict its size, factor " in remark
    assert float(remark.split()[-6]) == pytest.approx(1.0, abs=0.05)
    assert remark.endswith("in the place of 0.6")


def test_what_the_nominal_manipulator_has_stays_with_it():
    recording = recorded()
    loss = {"kind": "pulley_friction", "efficiency": 0.9}
    with_loss = manipulator_of(manipulator(effects=[loss]))
    known = manipulator_of(manipulator(1.2 * E, MU / 2, [loss, {**WEAK, "factor": 0.8}]))
    chain = with_loss.plain_chain()
    bends = np.full((len(recording.steps), chain.plates), 0.1)
    library = hypotheses(Scope(replace(recording, manipulator=with_loss), chain, bends))
    assumed = assumed_of(known, with_loss, library)
    assert {hypothesis.name: values for hypothesis, values in assumed.values.items()} == {
        "weakened_plate (plate 4)": {"factor": 0.8}
    }
    assert not assumed.unknown
    assert np.exp(assumed.constants["log_stiffness"]) == pytest.approx(1.2)
    assert np.exp(assumed.constants["log_friction"]) == pytest.approx(0.5)


def test_effects_have_their_scales_by_the_bends_of_what_is_known():
    """Plates three times as stiff bend a third; where the known manipulator buckles constants alone have to do."""
    predict = predictor(recorded())
    stiff = manipulator_of(manipulator() | {"youngs_modulus_pa": 3 * E})
    bends = [
        np.abs(np.diff(known_states(known, predict).angle)).max() for known in (manipulator_of(manipulator()), stiff)
    ]
    assert bends[0] / bends[1] == pytest.approx(3, rel=0.1)
    assert known_states(manipulator_of(manipulator() | {"youngs_modulus_pa": E / 1e3}), predict) is None


@pytest.mark.parametrize(
    ("law", "coefficient"),
    [
        (
            {"kind": "load_dependent_friction", "exponent": 0.3, "tension_n": 40.0},
            lambda law, mu, t: mu * (t / law["tension_n"]) ** -law["exponent"],
        ),
        (
            {"kind": "rate_dependent_friction", "rate": 0.06, "reference_n_per_s": 3.0},
            lambda law, mu, v: mu * (1 + law["rate"] * np.log(v / law["reference_n_per_s"])),
        ),
    ],
    ids=["load", "rate"],
)
def test_a_law_with_another_reference_is_the_same_law_here(law, coefficient):
    """The recording refers to its own largest tension and its own median rate; friction is as it was at any of both."""
    here = scope()
    nominal, library = here.manipulator, hypotheses(here)
    own = next(dict(each.place) for each in library if each.kind == law["kind"])
    (name,) = own
    assert own[name] != law[name]
    known = manipulator_of(nominal.model_dump(exclude_none=True) | {"effect": [law]})
    assumed = assumed_of(known, nominal, library)
    ((hypothesis, sizes),) = assumed.values.items()
    assert not assumed.unknown
    mu = nominal.friction.coefficient
    there = mu * np.exp(assumed.constants["log_friction"])
    for at in (1.0, 20.0, 90.0):
        now = coefficient({**law, **dict(hypothesis.place), **sizes}, there, at)
        assert now == pytest.approx(coefficient(law, mu, at))


@pytest.mark.parametrize(("knee", "looked_for"), [(0.0005, True), (0.05, False)])
def test_a_size_beyond_what_a_recording_bends_to_is_not_looked_for_and_said(knee, looked_for):
    predict = predictor(recorded())
    library = hypotheses(Scope.of(predict.recording, predict.chain, predict.equilibria(Constants())))
    law = {"kind": "nonlinear_plate", "law": "bilinear", "knee_strain": knee, "ratio": 0.5}
    assumed = assumed_of(manipulator_of(manipulator(effects=[law])), predict.recording.manipulator, library)
    assert bool(assumed.values) == looked_for
    said = "nonlinear_plate (law bilinear): knee_strain = 0.05 is beyond what this recording can show"
    assert any(reason.startswith(said) for reason in assumed.unknown) != looked_for


def test_friction_is_assumed_where_the_nominal_file_has_it():
    """As the coefficient or, where that is 0, as an effect; found before as the other one."""
    rubbing, without = scope(), scope(friction={"coefficient": 0.0})
    effect = {"kind": "cable_friction", "coefficient": 0.2}
    as_effect, as_constant = (manipulator_of(manipulator(E, mu, known)) for mu, known in ((0.0, [effect]), (0.2, [])))
    for known in (as_effect, as_constant):
        assumed = assumed_of(known, rubbing.manipulator, hypotheses(rubbing))
        assert not assumed.values
        assert not assumed.unknown
        mu = rubbing.manipulator.friction.coefficient
        assert mu * np.exp(assumed.constants["log_friction"]) == pytest.approx(0.2)
        assumed = assumed_of(known, without.manipulator, hypotheses(without))
        assert {each.name: sizes for each, sizes in assumed.values.items()} == {"cable_friction": {"coefficient": 0.2}}
        assert not assumed.unknown


def test_gravity_along_one_axis_is_assumed_along_that_axis_alone():
    """A file of an earlier diagnosis states both components, one of them zero: the other form would free that too."""
    library = hypotheses(scope())
    along_one = Gravity(kind="gravity", x_m_s2=0.0, y_m_s2=-9.7)
    across = Gravity(kind="gravity", x_m_s2=-3.0, y_m_s2=-9.7)
    free = [[each.name for each in hypothesis_at(effect, library).free] for effect in (along_one, across)]
    assert free == [["y_m_s2"], ["x_m_s2", "y_m_s2"]]
