"""What one recording teaches about another: constants and effects carried over, the frame fitted anew.

On the same manipulator everything carries over.  Where the geometry differs only material and friction do: the factor
on Young's modulus, the friction coefficient, and the effects whose record in the library says so.  What does not is
named with its reason.
"""

from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut, compared, noise_under
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import FRAME, Model
from prb3r.diagnosis.fit.prediction import Constants, Predictor, predictor
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.diagnosis import Diagnosis, FittedModel
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording


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
    one, other = diagnosis.nominal, recording.manipulator
    alike = same_geometry(one, other)
    carried, left = [], []
    for effect in diagnosis.explained.effects:
        moved = effect if alike else SUSPECTS[effect.kind].transfer(effect, one, other)
        if isinstance(moved, str):
            left.append(moved)
        else:
            carried.append(moved)
    predict, settings = predictor(recording), Settings(**diagnosis.settings)
    after = predict.solve(_constants(predict, diagnosis.explained, one, other), carried)
    noise = noise_under(predict, after, settings)
    calibrated = _in_frame(predict, noise, _constants(predict, diagnosis.calibrated, one, other), [])
    explained = _in_frame(predict, noise, after.constants, carried)
    return Carried(compared(predict, noise, calibrated, explained), alike, tuple(carried), tuple(left))


def _constants(predict: Predictor, fitted: FittedModel, one: Manipulator, other: Manipulator) -> Constants:
    """Calibrated constants as factors on the other manipulator's nominal ones; the frame not yet."""
    stiffness = fitted.constants.log_stiffness + np.log(one.youngs_modulus_pa / other.youngs_modulus_pa)
    friction = 0.0
    if one.friction.coefficient > 0 and other.friction.coefficient > 0:
        friction = fitted.constants.log_friction + np.log(one.friction.coefficient / other.friction.coefficient)
    return Constants(log_stiffness=float(stiffness), log_friction=float(friction))


def _in_frame(predict: Predictor, noise: Noise, constants: Constants, effects: list[Effect]) -> np.ndarray:
    """(r,) readings with these constants and effects, in the frame that fits the recording best under its prior."""
    model = Model(predict, noise, tuple(given(effect) for effect in effects))
    start = np.array([getattr(constants, name) for name in model.varied])
    known = [k for k, name in enumerate(model.varied) if name not in FRAME]
    fitted = fit(model, start, fixed=known)
    return predict(constants, effects) if fitted is None else fitted.solved.readings


def given(effect: Effect) -> Hypothesis:
    """A known effect, nothing of it free."""
    plain = effect.model_dump(exclude={"kind"}, exclude_none=True)
    place = {name: tuple(value) if isinstance(value, list) else value for name, value in plain.items()}
    return Hypothesis(effect.kind, tuple(place.items()))
