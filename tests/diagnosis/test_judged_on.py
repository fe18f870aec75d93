"""A diagnosis judged on another recording: what the effects are worth there, and a blunder that both files have."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.planted import in_kilograms, other_cables
from diagnosis.simulated import WEAK, Case, diagnosed, recorded

from prb3r import SpecError
from prb3r.diagnosis import stages
from prb3r.diagnosis.library import SUSPECTS, hypotheses
from prb3r.diagnosis.result.design_prediction import predict_design
from prb3r.diagnosis.result.other_recordings import is_missed
from prb3r.diagnosis.result.rig_remarks import off_drawing
from prb3r.diagnosis.result.transfer import on_other
from prb3r.diagnosis.run import diagnosis_of, joint_diagnosis_of
from prb3r.recording.recording import Sharing, Tolerance

LOSSY = {"kind": "pulley_friction", "efficiency": 0.85}
HIDDEN = tuple(tuple(effect.items()) for effect in (LOSSY, WEAK))
SUSPECTED = {
    "pulley_friction", "weakened_plate", "hole_offset", "precurvature", "segment_stiffness", "gravity", "dead_cable",
    "tension_offset",
}  # fmt: skip
"""The two and kinds that a wrong offset could be taken for: with all of them the two diagnoses take six times as long.
"""


def turned(recording):
    """With the offset of cable 3 on the wrong side in the manipulator file."""
    return other_cables(recording, cable_3={"offset_m": 0.021})


def other(seed=4):
    return replace(recorded(Case(hidden=HIDDEN, seed=seed)), name="the other")


def as_workshops_make(recording):
    """With the tolerances of a file that states none."""
    return replace(recording, tolerance=Tolerance())


def diagnosed_among_few(recording, holdout):
    """The diagnosis of a recording by the `SUSPECTED` kinds alone, judged on others."""
    left_out = frozenset(SUSPECTS) - SUSPECTED
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "hypotheses", lambda scope, without: hypotheses(scope, without | left_out))
        return diagnosis_of(recording, holdout=holdout)


@pytest.fixture(scope="module")
def judged():
    """The diagnosis of a file with an offset on the wrong side, judged on another recording of that file and on one of
    the right file."""
    wrong = turned(recorded(Case(hidden=HIDDEN, seed=3)))
    return diagnosed_among_few(wrong, [turned(other()), replace(other(5), name="the third")])


@pytest.mark.long
def test_another_recording_of_a_file_with_a_blunder_is_judged_with_it_mended(judged):
    assert judged.verdict == "set-up"
    held = judged.heldout
    assert held.rmse_explained_m < 1.1 * held.noise_m < held.rmse_calibrated_m
    assert "the other is judged with its manipulator file mended too" in judged.remarks
    assert not [text for text in judged.remarks if "the third" in text]  # its file is as the mended one


@pytest.mark.long
def test_nothing_is_predicted_for_the_file_with_the_blunder(judged):
    """Its wrong offset would be taken for that of another design, and bands would not hold the rig."""
    right = recorded(Case(hidden=HIDDEN, seed=3)).manipulator
    wrong, further = (
        other_cables(other(), cable_3={"offset_m": 0.021}).manipulator,
        right.replace("cable.1.offset_m", 0.02),
    )
    steps = {"sequence": "a", "step": [1], "cable_1_n": [20.0]}
    with pytest.raises(
        SpecError, match="the blunder that the diagnosis found in it; give the mended one, mended/manip"
    ):
        predict_design(judged, wrong, steps)
    for design in (right, further):
        assert np.isfinite(predict_design(judged, design, steps, draws=40).positions["x_m"]).all()


@pytest.mark.long
def test_each_effect_has_its_gain_on_the_other_recordings(judged):
    """Either effect moves readings by many times the noise, so that without it hardly any of the error is explained."""
    gains = {effect.kind: effect.heldout_gain for effect in judged.effects}
    assert set(gains) == {"pulley_friction", "weakened_plate"}
    assert all(0.9 < gain <= 1 for gain in gains.values())
    prediction = on_other(judged, other(5))
    for without in prediction.without:  # the other effect alone explains more than none, and less than both
        assert 2 * prediction.heldout.chi2_explained < without.chi2_calibrated < prediction.heldout.chi2_calibrated


def test_a_rig_without_an_effect_does_not_tell_what_it_is_worth():
    """A weak plate is a fault of one rig: on one with longer clamps the constants found beside it alone are judged."""
    plain = recorded(Case(hidden=(), seed=5))
    longer = plain.manipulator.replace("segment.1.clamp_m", 0.0085)
    same, another = (on_other(diagnosed(), replace(plain, manipulator=rig)) for rig in (plain.manipulator, longer))
    assert [error is None for error in same.without] == [False]
    assert another.left_behind[0].startswith("weakened plate")
    assert another.without == (None,)


@pytest.mark.long
def test_a_recording_of_another_arm_is_predicted_on_the_bench_unless_its_file_says_otherwise():
    """The zero of one force sensor, and an arm with longer clamps that was read with it and without."""
    zero = (("kind", "tension_offset"), ("offset_n", 12.0), ("cables", ("1",)))
    found = diagnosed(Case(hidden=(zero,), seed=3))
    assert [effect.kind for effect in found.effects] == ["tension_offset"]
    errors = {}
    for bench in (True, False):
        for hidden in ((zero,), ()):
            arm = recorded(Case(hidden=hidden, seed=5))
            longer = replace(arm, manipulator=arm.manipulator.replace("segment.1.clamp_m", 0.0081))
            carried = on_other(found, replace(longer, sharing=Sharing(bench=bench)))
            errors[bench, bool(hidden)] = carried.heldout.rmse_explained_m
            assert carried.of_the_bench == (("tension offset",) if bench else ())
            assert bool(carried.left_behind) != bench
    assert errors[True, True] < 0.7 * errors[False, True]
    assert errors[False, False] < 0.7 * errors[True, False]


@pytest.mark.long
def test_a_blunder_in_the_steps_may_not_be_in_another_recording():
    """Weights in kilograms are no part of a manipulator file."""
    wrong = in_kilograms(recorded(Case(hidden=HIDDEN, seed=3)))
    found = diagnosed_among_few(wrong, [other()])
    assert found.verdict == "set-up"
    assert found.heldout.rmse_explained_m < 1.1 * found.heldout.noise_m
    said = "the other is judged as it was recorded: whether the same blunder was made there was not looked for"
    assert said in found.remarks


@pytest.mark.long
def test_another_recording_that_is_missed_is_said_to_be():
    """A weak plate that was named is not weak on another day: it had been changed."""
    changed = replace(recorded(Case(hidden=(), seed=5)), name="changed")
    found = diagnosed_among_few(recorded(Case(seed=3)), [replace(recorded(Case(seed=4)), name="same"), changed])
    missed = [remark for remark in found.remarks if "diagnose it too, or both --together" in remark]
    assert [remark.partition(" is missed by ")[0] for remark in missed] == ["changed"]


def test_a_part_that_was_changed_is_named():
    """Plate 2 was changed for one of 0.85 times the stiffness, in a recording that is else as the diagnosed one."""
    changed = (("kind", "weakened_plate"), ("plate", 2), ("factor", 0.85))
    odd = on_other(diagnosed(), as_workshops_make(recorded(Case(hidden=(tuple(WEAK.items()), changed), seed=5)))).odd
    assert odd.name == "plate 2 stiffness"
    assert np.exp(odd.size) == pytest.approx(0.85, abs=0.03)
    assert odd.suffices
    assert off_drawing(odd).startswith("plate 2 stiffness about 0.8")


def test_one_part_does_not_make_up_for_two():
    changed = ((("kind", "weakened_plate"), ("plate", plate), ("factor", 0.6)) for plate in (2, 6))
    odd = on_other(diagnosed(), as_workshops_make(recorded(Case(hidden=(tuple(WEAK.items()), *changed), seed=5)))).odd
    assert odd.name in ("plate 2 stiffness", "plate 6 stiffness")
    assert not odd.suffices


def test_no_part_makes_up_for_weights_in_kilograms():
    prediction = on_other(diagnosed(), in_kilograms(as_workshops_make(recorded(Case(seed=5)))))
    assert prediction.heldout.rmse_explained_m > 5 * prediction.heldout.noise_m
    assert prediction.odd is None


def test_no_part_is_named_of_the_same_rig_on_another_day():
    for seed in range(4, 10):
        assert on_other(diagnosed(), as_workshops_make(recorded(Case(seed=seed)))).odd is None


@pytest.mark.parametrize(
    ("size", "readings", "common", "missed"),
    [
        (1.09, 800, 0.0, True),
        (1.09, 100, 0.0, False),
        (1.04, 10**6, 0.0, False),
        (1.09, 800, 0.1, False),
        (2.1, 9, 0.1, True),
    ],
)
def test_another_recording_is_missed_where_that_is_no_chance(size, readings, common, missed):
    """The mean square of 800 readings is 3.8 of its standard deviations, sqrt(2 / 800), above one, that of 100 is 1.3.
    Where readings share noise, they are fewer than they seem."""
    noise = SimpleNamespace(common=common, lasting=0.0, serial=0.0)
    assert is_missed(size, readings, SimpleNamespace(noise=noise, settings={})) == missed


def test_no_recording_is_judged_on_itself():
    """By whatever name."""
    known, copy, third = (replace(other(), name=name) for name in ("known", "copy", "third"))
    with pytest.raises(SpecError, match=r"holdout: copy has the readings that are diagnosed"):
        diagnosis_of(known, holdout=[other(5), copy])
    with pytest.raises(SpecError, match=r"holdout: copy has the readings that are diagnosed"):
        joint_diagnosis_of([replace(other(5), name="b"), third], holdout=[copy])
