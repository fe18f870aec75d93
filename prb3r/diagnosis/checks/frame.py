"""The frame of the camera where a recording does not state how exactly it is known, or states it too exactly.

Such a frame is held at zero, or near it.  A camera that stands elsewhere then looks like missing physics, although one
rotation and one shift of everything would do.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.chance import chi2_critical
from prb3r.diagnosis.checks.doubt import without_outliers
from prb3r.diagnosis.fit.calibrate import OutOfBalance, fit_constants
from prb3r.diagnosis.fit.constants import varied_constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Model
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording


def frame_taken(recording: Recording, settings: Settings) -> dict[str, float]:
    """Standard deviations of the frame to be taken where the recording states none, rad and m by their line in
    `recording.toml`; empty where the frame stays as it is stated.

    They are taken if a rigid motion alone removes most of what constants leave beyond noise (`Settings.frame_share`),
    more than chance would, and leaves no more than noise that is not far off the stated one (`Settings.far_noise`).
    What a recording states is never replaced, nor is 0, which says that the frame is known: see `frame_misstated`.
    """
    stated = recording.measurement.model_fields_set
    lacking = {line: sd for line, sd in _by_eye(recording, settings).items() if line not in stated}
    return lacking if _moves_to_noise(recording, lacking, settings) else {}


def frame_misstated(recording: Recording, settings: Settings) -> dict[str, float]:
    """Standard deviations of the frame, as of `frame_taken`, for those that the recording states and that are smaller;
    empty where a rigid motion within them does not remove most of what constants leave and all but noise."""
    stated = recording.measurement
    closer = {
        line: sd
        for line, sd in _by_eye(recording, settings).items()
        if line in stated.model_fields_set and getattr(stated, line) < sd
    }
    return closer if _moves_to_noise(recording, closer, settings) else {}


def _moves_to_noise(recording: Recording, lines: dict[str, float], settings: Settings) -> bool:
    """Whether a rigid motion within these standard deviations of the frame removes most of what constants leave, more
    than chance would, and all but noise; False without `lines`."""
    if not lines:
        return False
    try:
        held, _ = without_outliers(fit_constants(predictor(recording, settings), settings=settings))
    except OutOfBalance:
        return False
    free = Model(predictor(with_frame(recording, lines), settings), held.model.noise, settings=settings)
    moved = fit(free, np.array([getattr(held.constants, name) for name in free.varied]))
    if moved is None or not moved.balanced:
        return False
    more = max(len(free.varied) - len(held.model.varied), 1)
    fall, chance = held.chi2 - moved.chi2, float(chi2_critical(settings.blunder_rate, more))
    most = max(settings.frame_share * (held.chi2 - held.freedom), chance)
    near = moved.reduced < float(np.exp(2 * settings.far_noise))
    return bool(near and fall > most)


def with_frame(recording: Recording, stated: Mapping[str, float]) -> Recording:
    """The recording with these standard deviations of the frame, by their names."""
    return replace(recording, measurement=recording.measurement.model_copy(update=stated))


def _by_eye(recording: Recording, settings: Settings) -> dict[str, float]:
    """The standard deviations of a frame that is known by eye, by their line, as far as readings tell that part of it:
    an angle, and a share of the arm's length to one digit."""
    length = sum(segment.plates * segment.length_m for segment in recording.manipulator.segment)
    taken = {
        "frame_rotation_sd_rad": settings.frame_rotation,
        "frame_position_sd_m": float(f"{settings.frame_shift * length:.0e}"),
    }
    held = with_frame(recording, dict.fromkeys(taken, 0.0))
    told = varied_constants(held)
    return {name: sd for name, sd in taken.items() if varied_constants(with_frame(held, {name: sd})) != told}
