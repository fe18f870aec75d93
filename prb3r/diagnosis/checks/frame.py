"""The frame of the camera where a recording does not state how exactly it is known.

Such a frame is held at zero. A camera that stands elsewhere then looks like missing physics, although one rotation and
one shift of everything would do.
"""

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
    What a recording states is never replaced, nor is 0, which says that the frame is known.
    """
    lacking = _lacking(recording, settings)
    if not lacking:
        return {}
    try:
        held, _ = without_outliers(fit_constants(predictor(recording, settings), settings=settings))
    except OutOfBalance:
        return {}
    free = Model(predictor(with_frame(recording, lacking), settings), held.model.noise, settings=settings)
    moved = fit(free, np.array([getattr(held.constants, name) for name in free.varied]))
    if moved is None or not moved.balanced:
        return {}
    more = len(free.varied) - len(held.model.varied)
    fall, chance = held.chi2 - moved.chi2, float(chi2_critical(settings.blunder_rate, more))
    most = max(settings.frame_share * (held.chi2 - held.freedom), chance)
    near = moved.reduced < float(np.exp(2 * settings.far_noise))
    return lacking if near and fall > most else {}


def with_frame(recording: Recording, stated: dict[str, float]) -> Recording:
    """The recording with these standard deviations of the frame, by their names."""
    return replace(recording, measurement=recording.measurement.model_copy(update=stated))


def _lacking(recording: Recording, settings: Settings) -> dict[str, float]:
    """The standard deviations that the recording does not state and its readings tell, as they would be taken: an angle
    by eye, and a share of the arm's length to one digit."""
    length = sum(segment.plates * segment.length_m for segment in recording.manipulator.segment)
    taken = {
        "frame_rotation_sd_rad": settings.frame_rotation,
        "frame_position_sd_m": float(f"{settings.frame_shift * length:.0e}"),
    }
    known = varied_constants(recording)
    return {
        name: sd
        for name, sd in taken.items()
        if name not in recording.measurement.model_fields_set
        and varied_constants(with_frame(recording, {name: sd})) != known
    }
