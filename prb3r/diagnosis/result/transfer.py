"""What one recording teaches about another: constants and effects carried over, the frame fitted anew.

On the same manipulator everything carries over.  Where the geometry differs only material and friction do: the factor
on Young's modulus, the friction coefficient, and the effects whose record in the library says so.  What does not is
named with its reason.
"""

from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut, judge, noise_under
from prb3r.diagnosis.fit.calibrate import Fit
from prb3r.diagnosis.fit.prediction import Constants, Predictor, predictor
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording

FRAME_STEPS = 4


@dataclass(frozen=True)
class Carried:
    """The prediction of another recording."""

    heldout: HeldOut
    same_geometry: bool
    effects: tuple[Effect, ...]
    left_behind: tuple[str, ...]
    """Effects that could not be carried over, each with the reason."""


def same_geometry(one: Manipulator, other: Manipulator) -> bool:
    """Whether two nominal manipulators are the same but for constants and names."""
    return one.segment == other.segment and one.cable == other.cable and one.disk == other.disk


def on_other(diagnosis: Diagnosis, recording: Recording) -> Carried:
    """Predict another recording with what `diagnosis` found; before and after, as on held-out sequences."""
    one, other = diagnosis.recording.manipulator, recording.manipulator
    alike = same_geometry(one, other)
    carried, left = [], []
    for effect in diagnosis.explained.effects:
        moved = effect if alike else SUSPECTS[effect.kind].transfer(effect, one, other)
        if isinstance(moved, str):
            left.append(moved)
        else:
            carried.append(moved)
    predict = predictor(recording)
    before = _constants(predict, diagnosis.calibrated, one, other)
    after = _constants(predict, diagnosis.explained, one, other)
    noise = noise_under(predict, after, carried)
    before = _framed(predict, before, [], noise)
    after = _framed(predict, after, carried, noise)
    heldout = judge(predict, noise, predict(before), predict(after, carried))
    return Carried(heldout, alike, tuple(carried), tuple(left))


def _constants(predict: Predictor, fitted: Fit, one: Manipulator, other: Manipulator) -> Constants:
    """Calibrated constants as factors on the other manipulator's nominal ones; the frame not yet."""
    stiffness = fitted.constants.log_stiffness + np.log(one.youngs_modulus_pa / other.youngs_modulus_pa)
    friction = 0.0
    if one.friction.coefficient > 0 and other.friction.coefficient > 0:
        friction = fitted.constants.log_friction + np.log(one.friction.coefficient / other.friction.coefficient)
    return Constants(log_stiffness=float(stiffness), log_friction=float(friction))


def _framed(predict: Predictor, constants: Constants, effects: list[Effect], noise) -> Constants:
    """The constants with the frame that fits the recording best, under its prior."""
    measurement = predict.recording.measurement
    sd = {
        "rotation": measurement.frame_rotation_sd_rad,
        "x": measurement.frame_position_sd_m,
        "y": measurement.frame_position_sd_m,
    }
    names = [name for name, width in sd.items() if width > 0]
    if not names:
        return constants
    states = predict.equilibria(constants, effects)
    for _ in range(FRAME_STEPS):
        middle = predict.read(states, constants, effects)
        moved = []
        for name in names:
            change = 1e-4 * sd[name]
            there = predict.read(states, constants._replace(**{name: getattr(constants, name) + change}), effects)
            moved.append((there - middle) / change)
        columns = noise.whiten(np.nan_to_num(np.stack(moved, 1)))
        residual = noise.whiten(np.nan_to_num(predict.misfit(middle)))
        width = np.array([sd[name] for name in names])
        now = np.array([getattr(constants, name) for name in names])
        normal = columns.T @ columns + np.diag(width**-2.0)
        step = np.linalg.solve(normal, columns.T @ residual - now / width**2)
        constants = constants._replace(**dict(zip(names, (now + step).tolist(), strict=True)))
    return constants
