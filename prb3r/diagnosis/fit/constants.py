"""The constants that calibration adjusts: which of them a recording leaves free, their priors, and how far they go."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.friction import CableFriction
from prb3r.model.files.plausible import MODULI, STRONGEST_FRICTION
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Kind, Recording

FRAME = ("rotation", "x", "y")
"""Constants of the camera's frame: they change the readings, not the states."""
CONSTANTS_IN_WORDS = {"log_stiffness": "Young's modulus", "log_friction": "the friction coefficient"}
"""The other constants, by name, in words."""
RUBBING = "cable_friction"
"""Kind of the effect that replaces the friction coefficient of all cables or of some."""
WITHIN = np.array([1 + 1e-9, 1 - 1e-9])
"""Factors on the bounds of Young's modulus: drawn in by 1e-9, so that rounding of the ln does not pass them."""


class Constants(NamedTuple):
    """The constants that calibration adjusts: factors on the nominal ones, and the frame of the camera."""

    log_stiffness: float = 0.0
    """ln of the factor on every plate's bending stiffness."""
    log_friction: float = 0.0
    """ln of the factor on the nominal friction coefficient."""
    rotation: float = 0.0
    """Rotation of the camera's frame, anticlockwise as seen by the camera, rad."""
    x: float = 0.0
    """Shift of what the camera sees, m; likewise `y`."""
    y: float = 0.0


def varied_constants(recording: Recording) -> tuple[str, ...]:
    """Names of the constants that a recording leaves free, in the order in which they are fitted."""
    measurement, readings = recording.measurement, recording.readings
    turned, moved = measurement.frame_rotation_sd_rad > 0, measurement.frame_position_sd_m > 0
    positions, angles = bool(readings.is_position.any()), bool((readings.kind == Kind.ANGLE).any())
    return (
        "log_stiffness",
        *(("log_friction",) if recording.manipulator.friction.coefficient > 0 else ()),
        *(("rotation",) if turned and (positions or angles) else ()),
        *(("x", "y") if moved and positions else ()),
    )


def prior_deviations(recording: Recording, settings: Settings) -> Mapping[str, float]:
    """Prior standard deviation of every constant by its name; infinite: flat.

    Stiffness is known as of handbooks where nothing loads the arm, and friction where no cable is pulled: no reading
    tells them then.
    """
    measurement, prior, loads = recording.measurement, recording.prior, recording.loads
    pulled = bool(loads.tension.any())
    loaded = pulled or bool(loads.force.any() or loads.tip.any() or recording.manipulator.effect)
    return {
        "log_stiffness": prior.youngs_modulus or (np.inf if loaded else settings.modulus_sd),
        "log_friction": prior.friction_coefficient or (np.inf if pulled else settings.friction_sd),
        "rotation": measurement.frame_rotation_sd_rad,
        "x": measurement.frame_position_sd_m,
        "y": measurement.frame_position_sd_m,
    }


def widest_factors(manipulator: Manipulator, settings: Settings) -> Mapping[str, tuple[float, float]]:
    """Lowest and highest ln of the factors on stiffness and friction, by name of the constant.

    Factors stay within `Settings.widest_factor`, and the constants within those of real materials.
    """
    far = settings.farthest
    soft, stiff = np.log(np.array(MODULI) * WITHIN / manipulator.youngs_modulus_pa).tolist()
    rough = float(np.log(STRONGEST_FRICTION / (manipulator.friction.coefficient or STRONGEST_FRICTION)))
    return {"log_stiffness": (max(-far, soft), min(far, stiff)), "log_friction": (-far, min(far, rough))}


def friction_beside(manipulator: Manipulator, scale: float, pairs: Iterable[tuple[Hypothesis, np.ndarray]]) -> float:
    """Friction coefficient of all holes that no effect singles out.

    Parameters
    ----------
    scale : factor on the nominal coefficient.
    pairs : hypotheses, each with its free parameters `u`.
    """
    coefficient = manipulator.friction.coefficient * scale
    for effect in manipulator.effect:
        if isinstance(effect, CableFriction) and not effect.cables:
            coefficient = effect.coefficient
    for hypothesis, share in pairs:
        if hypothesis.kind == RUBBING and not hypothesis.place:
            coefficient = hypothesis.free[0].value(share[0])
    return coefficient
