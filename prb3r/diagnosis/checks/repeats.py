"""How much sequences under the same loads scatter, compared with the stated noise."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.chance import chi2_critical
from prb3r.diagnosis.evidence.outliers import outlier_inflation
from prb3r.diagnosis.evidence.repeated_loads import Match, matches
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.constants import Constants
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


def repeats_contradict(
    mended: tuple[Recording, Constants], as_noted: tuple[Recording, Constants], settings: Settings
) -> bool:
    """Whether loads that were repeated speak against a blunder, whatever physics the rig has: readings under the same
    loads are farther from one another once it is mended, by odds above `Settings.likelihood_ratio`.

    Parameters
    ----------
    mended, as_noted : a recording, and the constants that fit it best without effects.
    """
    (after, still), (before, known) = (_spread_of_repeats(*each, settings) for each in (mended, as_noted))
    count = min(still, known)
    if count < settings.fewest_repeats or min(after, before) == 0.0:
        return False
    return bool(count / 2 * np.log(after / before) > np.log(settings.likelihood_ratio))


def _spread_of_repeats(recording: Recording, constants: Constants, settings: Settings) -> tuple[float, float]:
    """How far readings of repeated loads are from one another beside what constants alone predict: the mean square in
    units of their noise, and how many independent readings it is of; gross outliers are left out.

    Of the readings of a step a share (`Settings.common_supposed`) is common to all.
    """
    matched = list(matches(recording, settings)) if recording.readings.count else []
    if len({match.step for _, match in matched}) < settings.fewest_repeats:
        return 0.0, 0.0
    predict = predictor(recording, settings)
    solved = predict.solve(constants)
    misfit = predict.misfit(solved.readings)
    variance = noise_of(recording, tension_response(predict, solved)).total_sd ** 2
    believed = (outlier_inflation(predict, solved.readings, settings) == 1) & np.isfinite(misfit)
    row, squares, steps = _row_of_reading(recording, believed), [], set[int]()
    for _, match in matched:
        for place in {(disk, kind) for step, disk, kind in row if step == match.step}:
            if (apart := _apart(row, match, place)) is not None:
                rows, weights = np.array(list(apart)), np.array(list(apart.values()))
                squares.append((weights @ misfit[rows]) ** 2 / (weights**2 @ variance[rows]))
                steps.add(match.step)
    if not squares:
        return 0.0, 0.0
    more = (len(squares) / len(steps) - 1) * settings.common_supposed
    return float(np.mean(squares)), len(squares) / (1 + more)


def _row_of_reading(recording: Recording, believed: np.ndarray) -> dict[tuple[int, int, int], int]:
    """The row of each believed reading by its step, disk and kind."""
    step, disk, kind, _ = (field.tolist() for field in recording.readings)
    return {key: k for k, key in enumerate(zip(step, disk, kind, strict=True)) if believed[k]}


def _apart(row: dict[tuple[int, int, int], int], match: Match, place: tuple[int, int]) -> Counter[int] | None:
    """The difference of a reading of a matched step and of that at the same loads in the other sequence, as the weights
    by row of the reading; None where one is missing.

    Parameters
    ----------
    place : disk and kind of the reading.
    """
    at_step, first, last = (row.get((at, *place)) for at in (match.step, match.before, match.after))
    if at_step is None or first is None or last is None:
        return None
    apart = Counter({at_step: 1.0})
    apart.subtract({first: 1 - match.share})
    apart.subtract({last: match.share})
    return apart


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
    row = _row_of_reading(recording, believed)
    before: dict[tuple[int, int, int], Counter[int]] = {}  # by pair of sequences, disk and kind
    for pair, match in matches:
        for place in {(d, k) for s, d, k in row if s == match.step}:
            apart = _apart(row, match, place)
            if apart is None:
                continue
            if (key := (pair, *place)) in before:
                change = Counter(apart)
                change.subtract(before[key])
                yield change
            before[key] = apart
