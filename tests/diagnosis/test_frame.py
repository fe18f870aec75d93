"""The camera's frame where a recording does not state how exactly it is known, or states it too exactly."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.checks.frame import frame_misstated, frame_taken
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.plates import WeakenedPlate
from prb3r.recording.recording import Kind, Measurement, Recording

OFF = Constants(0.05, -0.1, 0.002, 0.006, 0.0)
"""A rig whose origin is 6 mm behind that of the camera."""
WEAK = WeakenedPlate(kind="weakened_plate", plate=4, factor=0.7)


def seen_with(constants: Constants, effects=(), **stated: float) -> Recording:
    """A recording of what constants and effects predict, with noise, which states `stated` of the frame alone."""
    recording = recorded(Case(hidden=()))
    plain = recording.measurement.model_dump(exclude_none=True)
    frameless = {name: sd for name, sd in plain.items() if not name.startswith("frame")}
    recording = replace(recording, measurement=Measurement(**frameless, **stated))
    exact = predictor(recording).solve(constants, effects).readings
    return recording.with_values(exact + reading_sd(recording) * np.random.default_rng(4).standard_normal(len(exact)))


def test_a_rigid_motion_that_removes_most_of_a_misfit_is_fitted_and_the_lines_are_asked_for():
    found = run_stages(Task(seen_with(OFF), hold_out=False))
    assert found.verdict == "adequate"
    assert found.frame.x_m == pytest.approx(0.006, abs=2e-4)
    (said,) = [remark for remark in found.remarks if "camera's frame" in remark]
    assert "frame_rotation_sd_rad = 0.05 and frame_position_sd_m = 0.009" in said
    assert f"a turn by {found.frame.rotation_rad:.2g} rad and a shift by {1e3 * found.frame.x_m:.2g} mm along x" in said


def test_where_only_angles_are_read_the_rotation_alone_is_asked_for():
    recording = seen_with(OFF._replace(rotation=0.03))
    angles = recording.readings.where(recording.readings.kind == Kind.ANGLE)
    assert frame_taken(replace(recording, readings=angles), Settings()) == {"frame_rotation_sd_rad": 0.05}


RIGHT = OFF._replace(rotation=0.0, x=0.0)
LINES = {"frame_rotation_sd_rad": 0.05, "frame_position_sd_m": 0.009}
"""What is taken of an arm of 18 cm."""


@pytest.mark.parametrize(
    ("constants", "effects", "stated", "taken"),
    [
        (OFF, (), {}, LINES),
        (OFF, (), {"frame_rotation_sd_rad": 0.005}, {"frame_position_sd_m": 0.009}),
        (OFF, (), {"frame_rotation_sd_rad": 0.005, "frame_position_sd_m": 0.002}, {}),
        (OFF, (), {"frame_rotation_sd_rad": 0.0, "frame_position_sd_m": 0.0}, {}),
        (RIGHT, (), {}, {}),
        (RIGHT, (WEAK,), {}, {}),
    ],
    ids=["none is stated", "one is stated", "stated", "known", "a right frame", "a weak plate in a right frame"],
)
def test_only_a_frame_of_which_nothing_is_stated_and_that_is_off_is_fitted(constants, effects, stated, taken):
    assert frame_taken(seen_with(constants, effects, **stated), Settings()) == taken


@pytest.mark.parametrize("stated", [pytest.param(0.0, marks=pytest.mark.long), 5e-4])
def test_a_frame_that_is_stated_too_exactly_is_no_effect_and_is_said(stated):
    """Held at zero or within half a millimetre, the arm would have to sag or to be bent."""
    lines = {"frame_rotation_sd_rad": stated, "frame_position_sd_m": stated}
    found = run_stages(Task(seen_with(OFF, **lines), hold_out=False))
    assert (found.verdict, found.effects) == ("adequate", ())
    assert found.frame.x_m == pytest.approx(0.006, abs=2e-4)
    (said,) = [remark for remark in found.remarks if "camera's frame" in remark]
    assert f"frame_rotation_sd_rad = {stated:g} and frame_position_sd_m = {stated:g}" in said
    assert "it is wrong with a probability of 1.00" in said


@pytest.mark.parametrize(
    ("constants", "effects", "stated", "taken"),
    [
        (OFF, (), {"frame_rotation_sd_rad": 0.0, "frame_position_sd_m": 0.0}, LINES),
        (OFF, (), {"frame_position_sd_m": 0.0}, {"frame_position_sd_m": 0.009}),
        (OFF, (), {"frame_rotation_sd_rad": 0.1, "frame_position_sd_m": 0.02}, {}),
        (RIGHT, (), {"frame_rotation_sd_rad": 0.0, "frame_position_sd_m": 0.0}, {}),
        (OFF, (), {"frame_rotation_sd_rad": 0.1, "frame_position_sd_m": 0.0}, {"frame_position_sd_m": 0.009}),
        (RIGHT, (WEAK,), {"frame_rotation_sd_rad": 0.0, "frame_position_sd_m": 0.0}, {}),
    ],
    ids=[
        "known, and wrong",
        "of the position alone",
        "wider than by eye",
        "known, and right",
        "one is wider",
        "a weak plate",
    ],
)
def test_only_what_is_stated_more_exactly_than_by_eye_and_far_off_is_misstated(constants, effects, stated, taken):
    assert frame_misstated(seen_with(constants, effects, **stated), Settings()) == taken
