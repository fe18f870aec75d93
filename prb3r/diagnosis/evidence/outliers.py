"""Single wrong readings and weights: gross outliers, distinguished from missing physics by being isolated.

An effect moves neighbouring disks and neighbouring steps alike; a misreading or a wrong label does not.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.chance import normal_critical
from prb3r.diagnosis.evidence.neighbours import NEIGHBOURS_ALONG, neighbours
from prb3r.diagnosis.evidence.score_test import Alternative, alternatives_of
from prb3r.diagnosis.fit.covariance import AS_STATED, Noise, NoiseLevel, as_stated, noise_of, reading_sd
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.fit.tolerance import tolerances
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Readings, Recording

AT_ONCE = 256
"""Number of readings that are deleted in one go, which limits memory: 60 MB for ten thousand readings."""


def surprises(place: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(6, l, k) distance, in sd, of each of `k` values on each of `l` lines from six predictions by its neighbours.

    The predictions are the straight line through both neighbours, the parabola through three of them, and lines and
    parabolas through the neighbours on one side only.  NaN where there are too few neighbours.

    Parameters
    ----------
    place : (l, k) positions of the values on their lines.
    values : (l, k) with independent noise of unit variance.
    """
    length = values.shape[1]
    distances = np.full((6, *values.shape), np.nan)
    for row, shifts in enumerate([(-1, 1), (-2, -1, 1), (-1, -2), (1, 2), (-1, -2, -3), (1, 2, 3)]):
        first, last = max(0, -min(shifts)), length - max(0, *shifts)
        if last <= first:
            continue
        middle = np.arange(first, last)
        near = [middle + shift for shift in shifts]
        weights = np.ones((len(near), len(values), len(middle)))
        for a in range(len(near)):
            for b in range(len(near)):
                if a != b:
                    weights[a] *= (place[:, middle] - place[:, near[b]]) / (place[:, near[a]] - place[:, near[b]])
        guess = sum(weight * values[:, there] for weight, there in zip(weights, near, strict=True))
        distances[row][:, middle] = np.abs(values[:, middle] - guess) / np.sqrt(1 + (weights**2).sum(0))
    return distances


def surprise(readings: Readings, deviation: np.ndarray, of_sequence: np.ndarray, settings: Settings) -> np.ndarray:
    """(r,) distance, in sd, of each reading from the prediction by its neighbours; 0 if there are too few of these.

    Of several predictions the second nearest counts, as another gross outlier can spoil one of them.  A reading found
    to be a gross outlier is no longer used as a neighbour, and the distances of the others are computed again.

    Parameters
    ----------
    deviation : (r,) deviation of the readings from a model, in sd of the reading noise.
    of_sequence : (s,) number of the sequence of every step.
    """
    off, kept = np.zeros(readings.count), np.arange(readings.count)
    for _ in range(settings.outlier_rounds):
        away = np.sort(_surprises(readings.where(kept), deviation[kept], of_sequence), axis=0)  # NaN last
        known = np.isfinite(away).sum(0)
        first = np.where(known >= settings.fewest_expectations, away[0], 0.0)
        off[kept] = np.where(known >= settings.expectations_for_second, away[1], first)
        gross = off[kept] > settings.gross_sd
        kept = kept[~gross]
        if not gross.any():
            break
    return off


def _surprises(readings: Readings, deviation: np.ndarray, of_sequence: np.ndarray) -> np.ndarray:
    """(12, r) of :func:`surprises` along the disks of a step and along the steps of a sequence."""
    distances = np.full((2, 6, readings.count), np.nan)
    sequence = of_sequence[readings.step]
    for side, (line, place) in enumerate([(readings.step, readings.disk), (readings.disk, readings.step)]):
        order = np.lexsort((place, line, sequence, readings.kind))
        keys = np.stack([readings.kind, sequence, line])[:, order]
        ends = np.flatnonzero((np.diff(keys, axis=1) != 0).any(0)) + 1
        starts, lengths = np.concatenate([[0], ends]), np.diff([0, *ends, len(order)])
        for length in np.unique(lengths):  # all lines of one length at once
            series = order[starts[lengths == length, None] + np.arange(length)]
            series = series[(np.diff(place[series], axis=1) != 0).all(1)]
            distances[side][:, series] = surprises(place[series].astype(float), deviation[series])
    return distances.reshape(12, -1)


def usual_surprise(recording: Recording, settings: Settings) -> float:
    """Median :func:`surprise`, sd, of readings that hold nothing but the stated noise, from one random draw."""
    drawn = np.random.default_rng(0).standard_normal(recording.readings.count)
    usual = float(np.median(surprise(recording.readings, drawn, recording.of_sequence, settings)))
    return max(usual, settings.least_surprise)


def student(deviation: np.ndarray) -> np.ndarray:
    """Factor on the standard deviation of a reading that is `deviation` sd off: the weight that it has in a Student
    distribution of one degree of freedom."""
    return np.sqrt(1 + deviation**2)


def outlier_inflation(predict: Predictor, predicted: np.ndarray, settings: Settings, scale: float = 1.0) -> np.ndarray:
    """(r,) factor on the standard deviation of every reading: above 1 for gross outliers, else 1.

    All factors are 1 if a reading has no prediction, or if a larger share than `Settings.most_gross` would be outliers.

    Parameters
    ----------
    predicted : (r,) predicted readings, m and rad.
    scale : factor on the stated noise.  If the median :func:`surprise` is larger than under such noise, deviations are
        divided by the ratio of the two.
    """
    recording = predict.recording
    deviation = predict.misfit(predicted) / (scale * reading_sd(recording))
    median = float(np.median(surprise(recording.readings, deviation, recording.of_sequence, settings)))
    deviation /= max(1.0, median / usual_surprise(recording, settings))
    off = surprise(recording.readings, deviation, recording.of_sequence, settings)
    gross = off > settings.gross_sd
    if not np.isfinite(predicted).all() or gross.mean() > settings.most_gross:
        return np.ones(len(off))
    return np.where(gross, student(np.maximum(off, np.abs(deviation))), 1.0)


class NotedWeight(NamedTuple):
    """A weight that could have been noted wrongly."""

    step: int
    """Row of the load step."""
    cable: int
    """Column of the cable."""


def weight_alternatives(fitted: Fit, sensitivity: np.ndarray) -> list[Alternative]:
    """The alternative of every weight above 0, that it is wrong; `sensitivity` (r, s, m) is that of
    `tension_response`."""
    weights = np.argwhere(fitted.recording.loads.tension > 0).tolist()
    moved = [sensitivity[:, s, j, None] for s, j in weights]
    return alternatives_of(fitted, [NotedWeight(s, j) for s, j in weights], moved)


@dataclass(frozen=True, eq=False)
class Doubts:
    """The readings and weights of a recording that are not believed, and the level of its noise."""

    inflation: np.ndarray
    """(r,) factor on the standard deviation of each reading; 1 for those that are believed."""
    weights: tuple[NotedWeight, ...] = ()
    """Weights that are not believed."""
    level: NoiseLevel = AS_STATED
    """The estimated level of the noise."""

    @classmethod
    def as_stated(cls, recording: Recording, inflation: np.ndarray) -> "Doubts":
        """Doubts of readings alone, with the noise as it is stated (:func:`as_stated`)."""
        return cls(inflation, level=as_stated(recording))

    def inflated(self, recording: Recording, settings: Settings) -> np.ndarray:
        """(r,) factor on the standard deviation of each reading; `Settings.disbelief` under a doubted weight."""
        doubted = np.isin(recording.readings.step, [weight.step for weight in self.weights])
        return np.where(doubted, settings.disbelief, self.inflation)

    def noise(self, predict: Predictor, solved: Solution, settings: Settings) -> Noise:
        """The covariance of the readings around a solution: reading noise, scatter of the tensions, tolerances."""
        recording, moved = predict.recording, tolerances(predict, solved).moved
        sensitivity = tension_response(predict, solved)
        return noise_of(recording, sensitivity, self.inflated(recording, settings), self.level, moved)


def lone_outliers(fitted: Fit, doubts: Doubts) -> np.ndarray:
    """(r,) factor on the standard deviation of every reading: above 1 if a fit misses it grossly and alone, else 1.

    Those of `doubts` come back if some step has no equilibrium.  See :func:`lone_inflation`.
    """
    if not fitted.balanced:
        return doubts.inflation
    model = fitted.model
    recording = model.recording
    return lone_inflation(recording, fitted.misfit, model.noise, doubts.inflation, model.settings)


def lone_inflation(
    recording: Recording, white: np.ndarray, noise: Noise, inflation: np.ndarray, settings: Settings
) -> np.ndarray:
    """(r,) factor on the standard deviation of every reading: above 1 if it is missed grossly and alone, else 1.

    Whether a misfit is gross is judged by the median of all, or by the noise if that is larger.  It is alone if it
    exceeds `Settings.lone_ratio` times the misfits that its neighbours along disks and steps have once the reading
    itself is deleted.  Missing physics moves neighbours the same way.  A wrong reading, in contrast, moves the misfits
    of its neighbours the other way as long as it is there, as the tensions adapt to it.

    A reading that was doubted before need not be alone, and does not count as a neighbour.  All factors stay as they
    are if a larger share than `Settings.most_gross` would be outliers.

    Parameters
    ----------
    white : (r,) whitened misfits, under the factors `inflation` (r,) used so far.
    noise : the covariance by which they are whitened.
    """
    scale = max(float(np.median(np.abs(white) * inflation)) / normal_critical(0.25), 1.0)
    suspected = np.flatnonzero(np.abs(white) * inflation > settings.gross_sd * scale)
    pairs = [neighbours(recording, line) for line in NEIGHBOURS_ALONG]
    here, there = np.hstack([*pairs, *((second, first) for first, second in pairs)])
    off, beside = np.zeros(len(white)), np.zeros(len(white))
    for some in np.array_split(suspected, len(suspected) // AT_ONCE + 1):
        deleted = _deletion_residuals(white, noise, some)
        off[some] = deleted.size * inflation[some] / scale
        left = np.where(inflation > 1, 0.0, np.abs(deleted.left).T / scale)
        asked = np.isin(here, some)
        np.maximum.at(beside, here[asked], left[np.searchsorted(some, here[asked]), there[asked]])
    gross = (off > settings.gross_sd) & ((off > settings.lone_ratio * beside) | (inflation > 1))
    if gross.mean() > settings.most_gross:
        return inflation
    return np.where(gross, student(off), 1.0)


class DeletionResiduals(NamedTuple):
    """Misfits after deletion of one reading at a time: its own, and those of the others."""

    size: np.ndarray
    """(k,) distance of each deleted reading from its prediction by all others, in standard deviations of that."""
    left: np.ndarray
    """(r, k) whitened misfits of all readings after each deletion."""


def _deletion_residuals(white: np.ndarray, noise: Noise, suspected: np.ndarray) -> DeletionResiduals:
    """The misfits after deletion of each of the `suspected` readings (k,), from the whitened misfits `white` (r,).

    This is the mean-shift outlier model of Cook and Weisberg, *Residuals and Influence in Regression* (1982), for
    correlated readings.
    """
    alone = np.zeros((len(white), len(suspected)))
    alone[suspected, np.arange(len(suspected))] = noise.sd[suspected]
    shift = noise.whiten(alone)
    shift /= np.linalg.norm(shift, axis=0)
    size = shift.T @ white
    return DeletionResiduals(np.abs(size), white[:, None] - shift * size)


def far_off(fitted: Fit, doubts: Doubts) -> list[int]:
    """Indices of the readings that are down-weighted, or whose whitened misfit exceeds `Settings.listed_sd`."""
    beyond = np.abs(fitted.misfit) > fitted.model.settings.listed_sd
    return np.flatnonzero(beyond | (doubts.inflation > 1)).tolist()
