"""What is stated of constants and markers is doubted where constants alone explain all without it."""

import re
from dataclasses import replace

import numpy as np
import pytest

from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.run import diagnosis_of
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.stages import leaves_something, to_test
from prb3r.recording.recording import Kind, Prior, Recording, Tolerance
from tests.diagnosis.simulated import Case, recorded

TRUE_OVER_FILED = 0.8
"""Young's modulus of the rig over that of the manipulator file."""


def misfiled(case: Case, true_over_filed: float = TRUE_OVER_FILED, **stated: float) -> Recording:
    """A recording whose manipulator file has another Young's modulus than the rig, with a `[prior]`."""
    recording = recorded(case)
    filed = recording.manipulator.youngs_modulus_pa / true_over_filed
    manipulator = recording.manipulator.model_copy(update={"youngs_modulus_pa": filed})
    return replace(recording, manipulator=manipulator, prior=Prior(**stated))


def doubts(diagnosis: Diagnosis) -> list[str]:
    return [remark for remark in diagnosis.remarks if "what [prior] states of" in remark]


@pytest.mark.long
def test_a_modulus_that_contradicts_what_is_stated_need_be_no_effect():
    """What constants alone say of the modulus is within the interval, though many standard deviations as stated off."""
    known, free = (diagnosis_of(misfiled(Case(hidden=()), **prior)) for prior in ({"youngs_modulus": 0.02}, {}))
    assert (free.verdict, doubts(free)) == ("adequate", [])
    modulus, told = known.constants["youngs_modulus_pa"], free.constants["youngs_modulus_pa"]
    assert modulus.low <= told.calibrated <= modulus.high
    (remark,) = doubts(known)
    assert "Young's modulus (within 2 %)" in remark
    assert "whether the clamps give way" in remark
    away = float(re.findall(r"is ([0-9.]+) standard deviations", remark)[0])
    assert away == pytest.approx(abs(np.log(told.calibrated / told.nominal)) / 0.02, rel=0.05)
    assert any(not model.effects for model in known.models)


@pytest.mark.long
def test_of_friction_it_is_said_too():
    recording = recorded(Case(hidden=()))
    filed = recording.manipulator.friction
    friction = filed.model_copy(update={"coefficient": 3 * filed.coefficient})
    rougher = replace(recording, manipulator=recording.manipulator.model_copy(update={"friction": friction}))
    (remark,) = doubts(diagnosis_of(replace(rougher, prior=Prior(friction_coefficient=0.1))))
    assert "what [prior] states of the friction coefficient (within 10 %)" in remark


@pytest.mark.long
def test_what_is_stated_is_not_doubted_where_it_is_near_or_constants_do_not_explain_all():
    assert doubts(diagnosis_of(misfiled(Case(hidden=()), youngs_modulus=0.2))) == []
    assert doubts(diagnosis_of(misfiled(Case(), youngs_modulus=0.05))) == []  # one plate is weak
    assert doubts(diagnosis_of(misfiled(Case(hidden=()), 8.0, youngs_modulus=0.5))) == []  # handbooks state more


def turned_on_disks(recording: Recording, sd: float) -> Recording:
    """The recording with every marker turned on its disk by an angle of its own, rad."""
    readings = recording.readings
    turns = sd * np.random.default_rng(3).standard_normal(readings.disk.max() + 1)
    absolute = readings.kind == Kind.ANGLE
    return recording.with_values(readings.value + np.where(absolute, turns[readings.disk], 0.0))


@pytest.mark.parametrize(("sd", "beyond"), [(0.002, False), (0.03, True)])
def test_markers_that_sit_askew_are_no_bent_plates(sd, beyond):
    recording = replace(recorded(Case(hidden=())), tolerance=Tolerance())
    tested = to_test(Task(turned_on_disks(recording, sd)), lambda stage: None, serially)
    assert not leaves_something(tested)
    told = [remark for remark in tested.doubted.recording.remarks if "marker_rad" in remark]
    assert bool(told) == beyond
    if beyond:
        size = float(re.findall(r"by some ([0-9.]+) degrees", told[0])[0])
        assert size == pytest.approx(np.degrees(sd), rel=0.5)


def test_a_bent_plate_is_no_marker_that_sits_askew():
    """It moves the disks beyond it too."""
    bent = {"kind": "precurvature", "plates": (2,), "curvature_per_m": 3.0}
    recording = replace(recorded(Case(hidden=(tuple(bent.items()),))), tolerance=Tolerance())
    tested = to_test(Task(recording), lambda stage: None, serially)
    assert leaves_something(tested)
    assert tested.doubted.recording.tolerance.marker_rad is None
