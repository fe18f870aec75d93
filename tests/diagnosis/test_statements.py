"""What is stated of constants and markers is doubted where less explains all without it."""

import re
from dataclasses import replace

import numpy as np
import pytest

from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.run import diagnosis_of
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import leaves_something, to_search, to_test, with_wider_markers
from prb3r.model.effects import EFFECT_KINDS
from prb3r.recording.recording import Kind, Prior, Recording, Tolerance
from tests.diagnosis.simulated import LOSSY, WEAK, Case, recorded

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


SENSORS = {3: (-3.6e-3, -3e-3), 6: (4.2e-3, -1.5e-3)}
"""Places of sensors on their disks, in whose frames they lie ahead and across, m."""
KEPT = frozenset({"pulley_friction", "weakened_plate", "precurvature", "lens_distortion"})
"""Kinds of effects that are sought: one of the rig, and three that move single markers."""


def read_by_two_sensors(recording: Recording, places: dict[int, tuple[float, float]]) -> Recording:
    """The recording as two sensors at `places` on their disks read it, which are stated to be within 0.3 mm."""
    readings = recording.readings.where(np.isin(recording.readings.disk, list(places)))
    angle = {(s, d): a for s, d, k, a in zip(*(field.tolist() for field in readings), strict=True) if k == Kind.ANGLE}
    shift = {(d, k): places[d][k] for d in places for k in (Kind.X, Kind.Y)}

    def moved(step: int, disk: int, kind: int) -> float:
        if kind == Kind.ANGLE:
            return 0.0
        cos, sin = np.cos(angle[step, disk]), np.sin(angle[step, disk])
        along, across = shift[disk, Kind.X], shift[disk, Kind.Y]
        return cos * along - sin * across if kind == Kind.X else sin * along + cos * across

    by = [moved(*each) for each in zip(*(field.tolist() for field in readings[:3]), strict=True)]
    stated = Tolerance(marker_m=3e-4, marker_rad=0.003)
    return replace(recording, readings=readings._replace(value=readings.value + by), tolerance=stated)


@pytest.fixture
def searched_by_two_sensors():
    """The search of a rig with an effect, read by two sensors at given places."""

    def searched(effect, places, **given):
        rig = recorded(Case(hidden=(tuple(effect.items()),)))
        task = Task(read_by_two_sensors(rig, places), without=frozenset(EFFECT_KINDS) - KEPT, **given)
        return to_search(task, lambda stage: None, serially)

    return searched


@pytest.mark.parametrize("effect", [LOSSY, pytest.param(WEAK, marks=pytest.mark.long)], ids=lambda each: each["kind"])
def test_sensors_far_off_their_places_are_no_effects(searched_by_two_sensors, effect):
    as_stated = searched_by_two_sensors(effect, SENSORS)
    freed = with_wider_markers(as_stated, serially)
    (found,) = freed.choice.effects
    assert found.kind == effect["kind"]
    assert found in as_stated.choice.effects
    assert len(as_stated.choice.effects) > 1
    (told,) = (remark for remark in freed.tested.doubted.recording.remarks if "marker_m" in remark)
    size = float(re.findall(r"by some ([0-9.]+) mm, where 0.3 mm", told)[0])
    assert size == pytest.approx(1e3 * np.sqrt(np.mean([np.hypot(*place) ** 2 for place in SENSORS.values()])), rel=0.2)


def test_sensors_at_their_places_are_believed(searched_by_two_sensors):
    as_stated = searched_by_two_sensors(LOSSY, dict.fromkeys(SENSORS, (0.0, 0.0)))
    assert with_wider_markers(as_stated, serially) is as_stated


@pytest.mark.long
def test_effects_stand_where_a_wrong_statement_is_out_of_the_question(searched_by_two_sensors):
    as_stated = searched_by_two_sensors(LOSSY, SENSORS, settings=Settings(misstated=1e-300))
    assert with_wider_markers(as_stated, serially) is as_stated
