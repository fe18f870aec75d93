"""What one recording teaches about another: constants and effects carried over, the frame fitted anew.

On the same manipulator everything carries over.  Where the geometry differs only material and friction do: the factor
on Young's modulus, the friction coefficient, the way friction works, and the plates' bending law, which carries over
as strain (curvature times `outer_fibre_m`).  What does not is named.
"""

from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut, judge, noise_under
from prb3r.diagnosis.fit.prediction import Constants, Predictor, predictor
from prb3r.diagnosis.result.diagnosis import Diagnosis, FittedModel
from prb3r.model.effects.base import Effect
from prb3r.model.effects.plates import NonlinearPlate
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording

CARRIED = frozenset({"cable_friction", "pulley_friction", "slip_history", "edge_wrap", "tip_load_friction"})
"""Kinds that do not depend on the geometry; a bending law depends on it through the outer fibre."""
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


def carry(effect: Effect, one: Manipulator, other: Manipulator) -> Effect | str:
    """An effect on a manipulator of other geometry, or why it cannot be carried over."""
    if effect.kind in CARRIED and not getattr(effect, "cables", None):
        return effect
    if not isinstance(effect, NonlinearPlate):
        return f"{effect.kind}: depends on the geometry"
    here, there = one.outer_fibre, other.outer_fibre
    if not (np.isfinite(here).all() and np.isfinite(there).all()):
        return f"{effect.kind}: carries over as strain, which needs outer_fibre_m in both manipulator files"
    ratio = float(np.mean(there) / np.mean(here))  # the same strain is reached at a curvature so many times smaller
    if effect.law == "cubic":
        return effect.model_copy(update={"cubic_m2": (effect.cubic_m2 or 0.0) * ratio**2})
    return effect.model_copy(update={"knee_per_m": (effect.knee_per_m or np.inf) / ratio})


def on_other(diagnosis: Diagnosis, recording: Recording) -> Carried:
    """Predict another recording with what `diagnosis` found; before and after, as on held-out sequences."""
    one, other = diagnosis.nominal, recording.manipulator
    alike = same_geometry(one, other)
    carried, left = [], []
    for effect in diagnosis.explained.effects:
        moved = effect if alike else carry(effect, one, other)
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


def _constants(predict: Predictor, fitted: FittedModel, one: Manipulator, other: Manipulator) -> Constants:
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
