"""Checks of the residuals of a model: p-values of the misfit and of the structure that it leaves."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.chance import chi2_tail, normal_tail
from prb3r.diagnosis.checks.unseen import JudgedSequence
from prb3r.diagnosis.evidence.neighbours import NEIGHBOURS_ALONG, Line, neighbours
from prb3r.diagnosis.search.selection import Choice
from prb3r.recording.recording import Recording

ALONG_STEPS = "neighbours along steps"
"""Name of the check for positive correlation of residuals from one step to the next."""


class ModelCheck(NamedTuple):
    """The result of one test of a model."""

    name: str
    p: float
    """The p-value: chance of a result as large or larger if the model is right."""


def model_checks(choice: Choice, judged: Sequence[JudgedSequence]) -> tuple[ModelCheck, ...]:
    """Checks of the chosen model: chi-square, noise level, scores, correlated residuals, and sequences set aside.

    The largest score and the smooth missing moments are those of the most probable model (`Choice`).

    Parameters
    ----------
    judged : the sequences set aside, as they are predicted.
    """
    fitted, settings = choice.fitted, choice.fitted.model.settings
    recording = fitted.recording
    left = fitted.misfit
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
    """Prior chance that a stated standard deviation is wrong by `factor` or more, either way.

    `log_sd` is the prior standard deviation of the ln of that factor.
    """
    return float(2 * normal_tail(abs(np.log(factor)) / log_sd))


def neighbours_alike(recording: Recording, left: np.ndarray, line: Line) -> float:
    """The p-value of a positive correlation between neighbours along a line of the whitened residuals `left` (r,)."""
    first, second = neighbours(recording, line)
    return float(normal_tail(left[first] @ left[second] / max(np.sqrt(len(first)), 1.0)))
