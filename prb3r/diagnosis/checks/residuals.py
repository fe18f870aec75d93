"""Whether what the best model leaves looks like noise: chances of as much or more if the model is right."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2 as chi2_law
from scipy.stats import norm

from prb3r.diagnosis.checks.heldout import JudgedSequence
from prb3r.diagnosis.search.selection import Choice
from prb3r.recording.recording import Readings


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
        ModelCheck("chi-square", float(chi2_law.sf(fitted.chi2, fitted.freedom))),
        ModelCheck(
            "scale of the noise", float(2 * norm.sf(abs(np.log(choice.level.level.scale)) / settings.noise_log_sd))
        ),
        ModelCheck("largest score", choice.scores.chance),
        *(
            ModelCheck(
                f"neighbours along {line}", neighbours_alike(recording.readings, left, line, recording.of_sequence)
            )
            for line in ("disks", "steps")
        ),
    ]
    return (*checks, *(ModelCheck(f"sequence {sequence.name}, set aside", sequence.p) for sequence in judged))


def neighbours_alike(readings: Readings, left: np.ndarray, line: str, of_sequence: np.ndarray) -> float:
    """Chance that whitened residuals `left` (r,) of neighbours along a line are so much alike, or more, by chance."""
    held, place = (readings.step, readings.disk) if line == "disks" else (readings.disk, readings.step)
    sequence = of_sequence[readings.step]
    order = np.lexsort((place, held, sequence, readings.kind))
    keys = np.stack([readings.kind, sequence, held])[:, order]
    alike = (np.diff(keys, axis=1) == 0).all(0)
    products = (left[order][1:] * left[order][:-1])[alike]
    return float(norm.sf(products.sum() / max(np.sqrt(len(products)), 1.0)))
