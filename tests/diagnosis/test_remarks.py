"""What is remarked on beside a verdict."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.simulated import Case, diagnosed, recorded

from prb3r.diagnosis.check import check
from prb3r.diagnosis.checks.repeats import Scatter
from prb3r.diagnosis.checks.residuals import ModelCheck
from prb3r.diagnosis.evidence.noise_level import AS_STATED, EstimatedLevel, EstimatedScale
from prb3r.diagnosis.evidence.outliers import NotedWeight
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.tolerance import EstimatedTolerances
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.remarks import against_the_best, likely_too, not_ruled_out
from prb3r.diagnosis.result.rig_remarks import (
    bent_at_many_places,
    beyond_tolerance,
    far_rims,
    impossible_rims,
    misplaced_marker,
    noisy,
    scattered,
    uneven_plates,
    wrong_weights,
)
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.search.pool import Survivor
from prb3r.diagnosis.search.selection import simplest
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import calibrate, doubt, to_search
from prb3r.model.effects.plates import DiskContact, Precurvature, StiffnessGradient, WeakenedPlate
from prb3r.recording.recording import Kind, Tolerance

SAID = "the most probable model has 1 effect, as many as are sought"


@pytest.mark.long
def test_a_model_with_as_many_effects_as_are_sought_is_said_to_have_them():
    """One weak plate is there: of at most one effect it is the whole."""
    found = run_stages(Task(recorded(), hold_out=False, settings=Settings(most_effects=1)))
    assert [effect.kind for effect in found.effects] == ["weakened_plate"]
    assert any(remark.startswith(SAID) for remark in found.remarks)
    assert not any("as many as are sought" in remark for remark in diagnosed().remarks)


@pytest.mark.parametrize(
    ("degrees", "doubted", "impossible"),
    [(1.0, "802", True), *(pytest.param(*each, False, marks=pytest.mark.long) for each in ((9.0, "89.1"), (25.0, "")))],
)
def test_disks_that_could_touch_only_with_rims_far_outside_their_holes_are_doubted(degrees, doubted, impossible):
    """Arcs of 14 mm, holes at 25.5 mm: at 9 degrees the rims lie at 14 mm / 0.1571 = 89.1 mm, at 25 degrees at 32."""
    calibrated = to_search(Task(recorded()), lambda stage: None, serially).choice.calibrated
    touching = {"kind": "disk_contact", "angle_rad": degrees * np.pi / 180, "stiffness_n_m_per_rad": 1.0}
    solved = replace(calibrated.solved, effects=(DiskContact.model_validate(touching),))
    remarks = far_rims(replace(calibrated, solved=solved))
    assert len(remarks) == bool(doubted)
    said = f"rims {doubted} mm from the axis, where the farthest hole lies at 25.5 mm"
    assert all(said in remark for remark in remarks)
    assert impossible_rims(replace(calibrated, solved=solved)) == impossible


def test_of_a_weight_where_its_cable_turns_back_it_is_said_that_the_cable_may_have_stuck(calibrated):
    """Where slip is declared and something rubs: of steps with 30, 90, 60 and 25 N the third."""
    recording, chain = recorded(), calibrated.solved.chain
    assert recording.loads.tension[:4, 0].tolist() == [30, 90, 60, 25]
    told = wrong_weights(recording, [NotedWeight(step, 0) for step in range(4)], chain)
    assert [("had not yet slipped back" in remark) for remark in told] == [False, False, True, False]
    assert 'direction = "history" under [friction]' in told[2]
    assert all(remark.endswith("; it was not believed") for remark in told)
    for other in (chain._replace(presliding=1e-5), chain._replace(friction=0 * chain.friction)):
        (plain,) = wrong_weights(recording, [NotedWeight(2, 0)], other)
        said = "sequence out, step 3: the weight on cable 1, noted as 60 N, does not go with its readings"
        assert plain == f"{said}; it was not believed"


WEAK = [WeakenedPlate(kind="weakened_plate", plate=plate, factor=0.8) for plate in (2, 5)]
TAPERED = StiffnessGradient(kind="stiffness_gradient", tip_to_base=1.3)


@pytest.mark.parametrize(
    ("tolerance", "named", "asked"),
    [
        (Tolerance(), WEAK, True),
        (Tolerance(), [TAPERED], True),
        (Tolerance(), WEAK[:1], False),
        (Tolerance(), [], False),
        (Tolerance(thickness_relative=0.005), WEAK, False),
    ],
    ids=["two plates", "along the arm", "one plate", "nothing", "stated"],
)
def test_where_plates_differ_it_is_asked_how_exactly_they_are_made(tolerance, named, asked):
    """A single plate that is weak is a fault of that plate."""
    remarks = uneven_plates(replace(recorded(), tolerance=tolerance), named)
    assert len(remarks) == asked
    assert all("[tolerance] thickness_relative; 0.5 % is taken" in remark for remark in remarks)


def test_rest_curvature_at_many_places_is_said_to_be_one_form_perhaps():
    bent = [Precurvature(kind="precurvature", plates=[k], curvature_per_m=0.1 * k) for k in (1, 2, 3, 4)]
    assert bent_at_many_places(bent[:2], Settings()) == []
    (remark,) = bent_at_many_places(bent, Settings())
    assert remark.startswith("rest curvature is named at 4 places")


@pytest.mark.long
def test_one_weak_plate_alone_is_not_said_to_be_plates_that_differ():
    found = check(to_search(Task(replace(recorded(), tolerance=Tolerance())), lambda stage: None, serially))
    assert [named.hypothesis.kind for named in found.named] == ["weakened_plate"]
    assert not any("plates differ" in remark for remark in found.remarks)


@pytest.mark.parametrize(("apart", "said"), [(0.0, True), (0.05, True), (0.2, False)])
def test_two_effects_that_make_up_for_one_another_are_said_to_be_likely_only_both_at_once(apart, said):
    """Soft clamps and stiff cables: `apart` is the probability of soft clamps alone."""

    def survivor(probability, *kinds):
        return SimpleNamespace(probability=probability, kinds=frozenset(kinds), effects=frozenset(), log_evidence=0.0)

    survivors = [survivor(0.8 - apart, "clamp_compliance", "cable_bending"), survivor(apart, "clamp_compliance")]
    survivors.append(survivor(0.2, "hanger"))
    choice = SimpleNamespace(
        survivors=survivors, kinds=frozenset(), fitted=SimpleNamespace(model=SimpleNamespace(settings=Settings())),
        presence={"clamp_compliance": 0.8, "cable_bending": 0.8 - apart},
        likely={"clamp_compliance": 0.8, "cable_bending": 0.8 - apart},
    )  # fmt: skip
    told = [remark for remark in likely_too(choice) if "likely only both at once" in remark]
    assert bool(told) == said
    assert not said or told[0].startswith(
        f"cable_bending and clamp_compliance are likely only both at once (probability {0.8 - apart:.2f}"
    )


@pytest.mark.long
def test_what_is_likely_but_not_named_is_said_and_what_is_named_no_certainty():
    searched = to_search(Task(recorded()), lambda stage: None, serially)
    choice, library = searched.choice, searched.tested.doubted.search.library
    camera = next(one for one in library if one.kind == "camera_scale")
    only = replace(choice.survivors[0], probability=0.06)
    more = fit(choice.fitted.model.adding(camera), np.append(choice.fitted.p, 0.0))
    both = replace(only, probability=0.94, fitted=more)
    less = replace(choice, survivors=(replace(both, probability=0.7), replace(only, probability=0.3)))
    (remark,) = likely_too(replace(choice, survivors=(both, only)))
    assert remark.startswith("camera_scale is likely there too (probability 0.94)")
    assert not likely_too(choice)
    instead = fit(choice.calibrated.model.adding(camera), np.append(choice.calibrated.p, 0.0))
    (remark,) = likely_too(replace(choice, survivors=(only, replace(both, fitted=instead))))
    said = "camera_scale is likelier there than not (probability 0.94), in the place of weakened_plate"
    assert remark == said
    other = replace(both, fitted=instead, log_evidence=only.log_evidence + 3)  # and was passed over
    assert likely_too(replace(choice, survivors=(only, other))) == [
        f"{said}, though the more probable sets with it leave more than noise"
    ]
    nothing = replace(choice, fitted=choice.calibrated, survivors=(replace(both, fitted=instead),))
    (remark,) = likely_too(nothing)  # there is nothing beside which it could be there too
    assert remark == "camera_scale is likelier there than not (probability 0.94), though not sure enough to be named"
    for share, said in ((0.05, []), (0.2, ["not named, and not ruled out beside what is: camera scale (20 %)"])):
        models = replace(only, probability=1 - share), replace(both, probability=share)
        assert not_ruled_out(replace(choice, survivors=models)) == said
    none = replace(only, probability=0.8, fitted=choice.calibrated)
    few = replace(nothing, survivors=(none, replace(both, probability=0.2, fitted=instead)))
    assert not_ruled_out(few) == ["not named, and not ruled out: camera scale (20 %)"]
    verdicts = [check(replace(searched, choice=one)).verdict for one in (less, replace(choice, survivors=(both, only)))]
    assert verdicts == ["explained", "ambiguous"]


@pytest.mark.long
def test_a_second_effect_of_a_kind_is_as_probable_as_two_of_the_kind_and_one_at_its_place_is_likely():
    """Plates 4 and 2 are weakened in 80 %, plate 4 alone in 5 %, plates 4 and 3 in 15 %."""
    searched = to_search(Task(recorded()), lambda stage: None, serially)
    choice, library = searched.choice, searched.tested.doubted.search.library
    second, third = (next(o for o in library if o.name == f"weakened_plate (plate {n})") for n in (2, 3))
    one = replace(choice.survivors[0], probability=0.05)
    two, other = (
        replace(one, probability=share, fitted=fit(choice.fitted.model.adding(more), np.append(choice.fitted.p, 0.0)))
        for share, more in ((0.8, second), (0.15, third))
    )
    among = replace(choice, survivors=(two, other, one))
    assert among.likely == {"weakened_plate (plate 2)": pytest.approx(0.8)}
    (remark,) = likely_too(among)
    assert remark.startswith("weakened_plate (plate 2) is likely there too (probability 0.80)")
    both = replace(among, fitted=two.fitted)
    first, more = (both.probability_of(effect) for effect in both.fitted.model.hypotheses)
    assert (first, more) == (pytest.approx(1.0), pytest.approx(0.95))
    assert not both.likely


@pytest.mark.long
def test_of_what_a_rig_has_but_once_another_form_is_not_said_to_be_there_too():
    searched = to_search(Task(recorded()), lambda stage: None, serially)
    choice, library = searched.choice, searched.tested.doubted.search.library
    model, friction = choice.fitted.model, choice.fitted.model.friction(choice.fitted.p)
    forms = [next(o for o in library if o.name == f"hysteretic_plate{form}") for form in ("", " (elements 2)")]
    fits = [fit(model.adding(form), np.concatenate([choice.fitted.p, form.starts(friction)[0]])) for form in forms]
    named, other = (
        replace(choice.survivors[0], probability=p, fitted=each) for p, each in zip((0.2, 0.8), fits, strict=True)
    )
    assert not replace(choice, fitted=named.fitted, survivors=(other, named)).likely


def test_what_all_models_that_are_left_have_is_named_though_one_does_nearly_as_well_without():
    """Four models with ln evidence 0, -0.2, -0.4 and -2.9: what all but the last have is there with a probability of
    0.98; the smallest model within reach lacks it."""
    a, b, c, d = (Hypothesis(name) for name in "abcd")

    def survivor(evidence, *hypotheses):
        fitted = SimpleNamespace(model=SimpleNamespace(hypotheses=hypotheses))
        return Survivor(fitted, evidence, float(np.exp(evidence) / np.exp([0, -0.2, -0.4, -2.9]).sum()))

    most, *others = survivor(0, a, b), survivor(-0.2, b, c), survivor(-0.4, b, d)
    alone = survivor(-2.9, a)
    assert simplest([most, *others, alone], Settings()) is most.fitted
    assert simplest([most, alone], Settings(certain=0.99)) is alone.fitted


def with_markers_off(recording, *disks):
    """The recording with markers that sit 4 mm across their disks."""
    readings = recording.readings
    here = np.isin(readings.disk, disks)
    angle = np.zeros((len(recording.steps), recording.manipulator.plates + 1))
    turned = readings.kind == Kind.ANGLE
    angle[readings.step[turned], readings.disk[turned]] = readings.value[turned]
    across = np.array([-np.sin(angle), np.cos(angle)])[:, readings.step, readings.disk]
    moved = np.select([readings.kind == Kind.X, readings.kind == Kind.Y], across, 0.0)
    return recording.with_values(readings.value + 4e-3 * here * moved)


def test_a_marker_that_sits_off_its_disk_alone_is_remarked_on():
    """4 mm where the tolerance is 0.2 mm; two such markers are no fault of one, nor is a bent plate."""
    right = recorded(Case(hidden=()))
    bent = recorded(Case(hidden=(tuple({"kind": "precurvature", "curvature_per_m": 1.0, "plates": (3,)}.items()),)))
    cases = {"off": with_markers_off(right, 3), "two": with_markers_off(right, 3, 5), "right": right, "bent": bent}
    told = {}
    for name, recording in cases.items():
        doubted = doubt(calibrate(Task(replace(recording, tolerance=Tolerance(marker_m=2e-4)))), serially)
        told[name] = misplaced_marker(doubted.fitted, doubted.doubts)
    (remark,) = told["off"]
    assert "marker 3 across its disk would be off by 3" in remark or "would be off by 4" in remark
    assert told["two"] == told["right"] == told["bent"] == []


def test_parts_beyond_their_tolerance_are_told_the_farthest_first():
    names = ("marker 4 along its disk, m", "cable.1.offset_m", "segment.1.length_m", "marker 2 across its disk, m")
    value = np.array([-0.0026, 1e-4, 9e-4, 1.1e-3])
    told = EstimatedTolerances(names, value, np.full(4, 1e-4), np.array([3.4e-4, 2e-4, 1e-4, 3e-4]))
    (said,) = beyond_tolerance(told, Settings())
    assert said.startswith(
        "off its drawing: segment.1.length_m by 9.0 times its tolerance, marker 4 along its disk by 7.6 times its "
        "tolerance, marker 2 across its disk by 3.7 times its tolerance: measure it"
    )
    assert not beyond_tolerance(told._replace(value=value / 10), Settings())


def test_checks_that_speak_against_the_best_model_are_told_with_their_chances():
    checks = [
        ModelCheck("chi-square", 0.5),
        ModelCheck("neighbours along steps", 1e-9),
        ModelCheck("sequence d", 0.002),
    ]
    (said,) = against_the_best(checks, Settings())
    assert said.endswith("neighbours along steps (below 0.0001); sequence d (0.002)")
    assert not against_the_best(checks[:1], Settings())


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_only_noise_above_the_stated_one_is_looked_for_on_the_rig(factor):
    scale = EstimatedScale(factor, 0.9 * factor, 1.1 * factor)
    (readings, tensions) = noisy(EstimatedLevel(AS_STATED, scale, scale), Settings())
    for said, disturbed in ((readings, "the readings"), (tensions, "the tensions")):
        assert f"{factor:.2g} times the stated one" in said
        assert "state it so" in said
        assert (f"look for what disturbs {disturbed}" in said) == (factor > 1)
    (again,) = scattered(Scatter(factor, 44, factor > 1))
    assert ("more than chance allows" in again) == (factor > 1)
