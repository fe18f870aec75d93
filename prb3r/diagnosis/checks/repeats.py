"""How much repeated sequences scatter: what the stated noise is held against.

Two sequences repeat one another where they carry the same loads at the same length of their paths through load space,
even if they were read at other loads: in between, what the model leaves changes steadily.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2 as chi2_law

from prb3r.diagnosis.evidence.outliers import outlier_inflation
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.covariance import noise_of
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording


class Scatter(NamedTuple):
    """What repeated sequences show."""

    factor: float
    """Scatter of repeated readings, gross outliers left out, over what the stated noise lets expect."""
    steps: int
    """How many steps were repeated."""
    beyond_chance: bool
    """Whether it is larger than stated; all readings of a step count as one."""


class Match(NamedTuple):
    """A step that lies on the load path of another sequence."""

    step: int
    before: int
    after: int
    """Steps of the other sequence between which it lies; the same where it meets one."""
    share: float
    """Of the way from one to the other."""


def scatter(recording: Recording, settings: Settings) -> Scatter | None:
    """The scatter of sequences that repeat others; None where too few steps do.

    Raises
    ------
    ValueError
        If nothing near the nominal manipulator is in balance under the recorded loads.
    """
    matched = list(matches(recording, settings))
    steps = len({match.step for _, match in matched})
    if steps < settings.fewest_repeats:
        return None
    predict = predictor(recording)
    fitted = fit_constants(predict, settings=settings)
    noise = noise_of(recording, tension_response(predict, fitted.solved))
    misfit, variance = predict.misfit(fitted.solved.readings), noise.total_sd**2
    believed = outlier_inflation(predict, fitted.solved.readings, settings) == 1
    squares = []
    for change in _changes(recording, matched, believed):
        rows, weights = np.array(list(change)), np.array(list(change.values()))
        squares.append((weights @ misfit[rows]) ** 2 / (weights**2 @ variance[rows]))
    factor = float(np.sqrt(np.mean(squares))) if squares else 0.0
    chance = chi2_law.isf(settings.alarm_rate, steps)
    return Scatter(factor, steps, bool(factor**2 * steps > chance))


def _changes(recording: Recording, found: Sequence[tuple[int, Match]], believed: np.ndarray) -> Iterator[Counter[int]]:
    """From one matched step to the next, how the difference of two sequences changes: weights of readings by row.

    What sets whole sequences apart (a camera that was moved, plates that creep) is no noise, and cancels nearly.
    """
    step, disk, kind, _ = (field.tolist() for field in recording.readings)
    row = {key: k for k, key in enumerate(zip(step, disk, kind, strict=True)) if believed[k]}
    before: dict[tuple[int, int, int], Counter[int]] = {}  # by pair of sequences, disk and kind
    for pair, match in found:
        for place in {(d, k) for s, d, k in row if s == match.step}:
            own, first, last = (row.get((at, *place)) for at in (match.step, match.before, match.after))
            if own is None or first is None or last is None:
                continue
            apart = Counter({own: 1.0})
            apart.subtract({first: 1 - match.share})
            apart.subtract({last: match.share})
            if (key := (pair, *place)) in before:
                change = Counter(apart)
                change.subtract(before[key])
                yield change
            before[key] = apart


def matches(recording: Recording, settings: Settings) -> Iterator[tuple[int, Match]]:
    """Every step on the path of a later sequence with the same loads as far as both go; by number of the pair."""
    loads = recording.loads
    every = np.concatenate([loads.tension, loads.tip, loads.force.reshape(loads.steps, -1)], axis=1)
    rows = [np.flatnonzero(recording.of_sequence == k) for k in range(len(recording.sequences))]
    for pair, (first, second) in enumerate(combinations(rows, 2)):
        yield from ((pair, match) for match in _on_path(every, first, second, settings))


def _on_path(loads: np.ndarray, first: np.ndarray, second: np.ndarray, settings: Settings) -> list[Match]:
    """Matches of the steps `first` on the path of the steps `second`; none if their loads differ anywhere."""
    here, there = (np.vstack([np.zeros(loads.shape[1]), loads[rows]]) for rows in (first, second))
    far, along = (np.append(0.0, np.cumsum(np.abs(np.diff(path, axis=0)).sum(1))) for path in (here, there))
    found, highest = [], np.abs(loads[[*first, *second]]).max()
    tolerance = settings.same_loads * highest
    for own, at, load in zip(first, far[1:], here[1:], strict=True):
        if at > along[-1] + tolerance:
            break
        k = max(min(int(np.searchsorted(along, at)), len(second)), 1)
        way = along[k] - along[k - 1]
        share = float(np.clip((at - along[k - 1]) / way, 0, 1)) if way > 0 else 1.0
        if np.abs((1 - share) * there[k - 1] + share * there[k] - load).max() > tolerance:
            return []
        if share == 1.0:
            found.append(Match(int(own), int(second[k - 1]), int(second[k - 1]), share))
        elif k > 1 and way <= settings.closely_read * highest:  # at rest nothing is read
            found.append(Match(int(own), int(second[k - 2]), int(second[k - 1]), share))
    return found
