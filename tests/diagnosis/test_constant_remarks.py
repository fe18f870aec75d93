"""What is remarked on of the constants: Young's modulus, friction and the frame of the camera."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.check import check
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.constant_remarks import (
    excludes_nominal,
    far_constants,
    far_frame,
    frame_of_constants_alone,
)
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.stages import to_search
from prb3r.recording.recording import Prior, Recording


def with_nominal_friction(recording: Recording, coefficient: float) -> Recording:
    """The recording as one whose manipulator file has another friction coefficient, without priors."""
    friction = recording.manipulator.friction.model_copy(update={"coefficient": coefficient})
    return replace(
        recording, manipulator=recording.manipulator.model_copy(update={"friction": friction}), prior=Prior()
    )


def at_the_bound(recording: Recording):
    """The constants of a recording with friction at its lowest, which a fit leaves no more."""
    fitted = fit_constants(predictor(recording))
    p = fitted.p.copy()
    number = fitted.model.varied.index("log_friction")
    p[number] = fitted.model.widest["log_friction"][0]
    return fit(fitted.model, p, most_steps=0)


def loading_only(recording: Recording) -> Recording:
    """The recording with tensions that only grow from step to step."""
    loads = recording.loads._replace(tension=np.maximum.accumulate(recording.loads.tension, axis=0))
    return replace(recording, loads=loads)


@pytest.mark.parametrize(("rotation", "said"), [(-0.0144, True), (0.0144, True), (0.012, False)])
def test_a_frame_three_standard_deviations_off_is_said_with_what_was_stated(rotation, said):
    """0.005 rad is stated: 0.0144 is 2.9 of it, as a rig with bent plates had."""
    fitted = fit_constants(predictor(recorded(Case(hidden=()))))
    p = fitted.p.copy()
    p[fitted.model.varied.index("rotation")] = rotation
    remarks = far_frame(replace(fitted, p=p))
    assert len(remarks) == said
    for remark in remarks:
        assert f"the camera's rotation ends at {rotation} rad, 2.9 standard deviations" in remark
        assert "frame_rotation_sd_rad = 0.005: look at the camera's axes" in remark


def test_constants_that_come_near_by_moving_the_camera_are_told():
    fitted = fit_constants(predictor(recorded(Case(hidden=()))))
    p = fitted.p.copy()
    p[fitted.model.varied.index("rotation")] = 0.05
    (said,) = frame_of_constants_alone(replace(fitted, p=p))
    assert "only by moving the camera: the camera's rotation by 0.05 rad (10 standard deviations)" in said
    assert frame_of_constants_alone(fitted) == frame_of_constants_alone(None) == []


def test_a_shift_that_is_off_is_among_the_remarks_of_a_diagnosis():
    recording = recorded(Case(hidden=()))
    measurement = recording.measurement.model_copy(update={"frame_position_sd_m": 1e-4})
    shifted = recording.with_values(recording.readings.value + 1e-3 * (recording.readings.kind == 0))
    remarks = check(to_search(Task(replace(shifted, measurement=measurement)), lambda stage: None, serially)).remarks
    assert any("the camera's shift along x ends at" in remark for remark in remarks)


def test_a_modulus_far_from_what_is_stated_is_said_with_its_distance():
    """The rig's is 5 % above the nominal one, where 1 % is stated."""
    recording = replace(recorded(Case(hidden=())), prior=Prior(youngs_modulus=0.01))
    (remark,) = far_constants(fit_constants(predictor(recording)))
    assert remark.startswith("Young's modulus ends at 1.0")
    assert remark.endswith("standard deviations from what the recording states of it")
    assert not far_constants(fit_constants(predictor(recorded(Case(hidden=())))))


def test_friction_that_is_not_told_is_nothing_wrong():
    """Of readings with a standard deviation of metres none tells friction; of those as they are all do."""
    known = replace(recorded(Case(hidden=())), prior=Prior())
    blind = replace(
        known, measurement=known.measurement.model_copy(update={"position_sd_m": 3.0, "angle_sd_rad": 50.0})
    )
    (remark,) = far_constants(at_the_bound(blind))
    assert remark.startswith("the friction coefficient ends at 0.02 times the nominal one, but the nominal one fits")
    assert remark.endswith("this recording does not tell it")
    (remark,) = far_constants(at_the_bound(loading_only(blind)))
    assert remark.endswith("does not tell it, as cables are only drawn in: let them out in steps too")


def test_friction_several_times_the_nominal_one_is_said():
    """The rig's is 0.27: 5.4 times one of 0.05, 1.8 times one of 0.15."""
    known = recorded(Case(hidden=()))
    far = fit_constants(predictor(with_nominal_friction(known, 0.05)))
    assert excludes_nominal(far, "log_friction")
    (remark,) = far_constants(far)
    assert remark.startswith("the friction coefficient ends at 5.")
    assert "and the nominal one does not fit" in remark
    assert not far_constants(fit_constants(predictor(with_nominal_friction(known, 0.15))))
