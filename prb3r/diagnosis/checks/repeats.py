"""How much sequences under the same loads scatter, compared with the stated noise."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.chance import chi2_critical
from prb3r.diagnosis.evidence.outliers import outlier_inflation
from prb3r.diagnosis.evidence.repeated_loads import Match, matches
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.covariance import noise_of
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording


class Scatter(NamedTuple):
    """The scatter of sequences that repeat one another."""

    factor: float
    """Scatter of repeated readings over that expected from stated noise and tension scatter; without gross outliers."""
    steps: int
    """Number of steps that were repeated."""
    beyond_chance: bool
    """Whether the scatter is significantly larger than stated; all readings of a step count as one number."""


def scatter(recording: Recording, settings: Settings) -> Scatter | None:
    """The scatter of sequences that repeat others; None if fewer than `Settings.fewest_repeats` steps are repeated.

    Raises
    ------
    OutOfBalance
        If nothing near the nominal manipulator is in balance under the recorded loads.
    """
    matched = list(matches(recording, settings))
    steps = len({match.step for _, match in matched})
    if steps < settings.fewest_repeats:
        return None
    predict = predictor(recording, settings)
    fitted = fit_constants(predict, settings=settings)
    noise = noise_of(recording, tension_response(predict, fitted.solved))
    misfit, variance = predict.misfit(fitted.solved.readings), noise.total_sd**2
    believed = (outlier_inflation(predict, fitted.solved.readings, settings) == 1) & np.isfinite(misfit)
    squares = []
    for change in _changes(recording, matched, believed):
        rows, weights = np.array(list(change)), np.array(list(change.values()))
        squares.append((weights @ misfit[rows]) ** 2 / (weights**2 @ variance[rows]))
    factor = float(np.sqrt(np.mean(squares))) if squares else 0.0
    chance = chi2_critical(settings.alarm_rate, steps)
    return Scatter(factor, steps, bool(factor**2 * steps > chance))


def _changes(
    recording: Recording, matches: Sequence[tuple[int, Match]], believed: np.ndarray
) -> Iterator[Counter[int]]:
    """How the difference of two repeated sequences changes from one matched step to the next.

    Each change is a weighted sum of readings, given as the weights by row of the reading.  A constant difference of
    whole sequences, as from a camera that was moved or plates that creep, is no noise and nearly cancels in it.

    Parameters
    ----------
    believed : (r,) whether a reading is predicted and no gross outlier.
    """
    step, disk, kind, _ = (field.tolist() for field in recording.readings)
    row = {key: k for k, key in enumerate(zip(step, disk, kind, strict=True)) if believed[k]}
    before: dict[tuple[int, int, int], Counter[int]] = {}  # by pair of sequences, disk and kind
    for pair, match in matches:
        for place in {(d, k) for s, d, k in row if s == match.step}:
            at_step, first, last = (row.get((at, *place)) for at in (match.step, match.before, match.after))
            if at_step is None or first is None or last is None:
                continue
            apart = Counter({at_step: 1.0})
            apart.subtract({first: 1 - match.share})
            apart.subtract({last: match.share})
            if (key := (pair, *place)) in before:
                change = Counter(apart)
                change.subtract(before[key])
                yield change
            before[key] = apart
