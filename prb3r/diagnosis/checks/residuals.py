"""Whether what the best model leaves looks like noise: chances of as much or more if the model is right."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.chance import chi2_tail, normal_tail
from prb3r.diagnosis.checks.heldout import JudgedSequence
from prb3r.diagnosis.evidence.neighbours import NEIGHBOURS_ALONG, Line, neighbours
from prb3r.diagnosis.search.selection import Choice
from prb3r.recording.recording import Recording

ALONG_STEPS = "neighbours along steps"
"""The check of what lasts from one step to the next."""


class ModelCheck(NamedTuple):
    """One test of the best model."""

    name: str
    p: float
    """Chance of as much or more if the model is right."""


def model_checks(choice: Choice, judged: Sequence[JudgedSequence]) -> tuple[ModelCheck, ...]:
    """Size, structure and neighbourhood of the residuals, the noise that is needed, and sequences set aside."""
    fitted, settings = choice.fitted, choice.fitted.model.settings
    recording = fitted.model.predict.recording
    left = fitted.residual[: recording.readings.count]
    checks = [
        ModelCheck("chi-square", float(chi2_tail(fitted.chi2, fitted.freedom))),
        ModelCheck("scale of the noise", by_chance(choice.level.reading.value, settings.noise_log_sd)),
        ModelCheck("scatter of the tensions", by_chance(choice.level.tension.value, settings.tension_log_sd)),
        ModelCheck("largest score", choice.scores_of_best.chance),
        ModelCheck("smooth missing moments", choice.smooth_moments),
        *(ModelCheck(f"neighbours along {line}", neighbours_alike(recording, left, line)) for line in NEIGHBOURS_ALONG),
    ]
    return (*checks, *(ModelCheck(f"sequence {sequence.name}, set aside", sequence.p) for sequence in judged))


def by_chance(factor: float, log_sd: float) -> float:
    """Prior chance that what is stated is off by as much as `factor`, or more, either way."""
    return float(2 * normal_tail(abs(np.log(factor)) / log_sd))


def neighbours_alike(recording: Recording, left: np.ndarray, line: Line) -> float:
    """Chance that whitened residuals `left` (r,) of neighbours along a line are so much alike, or more, by chance."""
    first, second = neighbours(recording, line)
    return float(normal_tail(left[first] @ left[second] / max(np.sqrt(len(first)), 1.0)))
