"""Readings and weights that are wrong by themselves, told from physics by being alone.

An effect moves neighbouring disks and neighbouring steps alike; a slip of the eye or of a label does not.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from prb3r.recording.calibrate import Fit, Model, fit
from prb3r.recording.covariance import Noise, noise_of, reading_sd
from prb3r.recording.locate import Direction, direction
from prb3r.recording.recording import Readings

ALONE = 5.0
"""A reading this many sd away from whatever its neighbours lead to expect is a gross outlier."""
MOST = 0.1
"""A larger share than this is not outliers."""
FREEDOM = 4.0
"""Of the Student distribution that weighs outliers down."""
LISTED = 4.0
"""Readings further off than this many sd are listed."""


def field(readings: Readings, values: np.ndarray, kind: int, steps: int) -> np.ndarray:
    """(s, n + 1) mean of `values` of one kind by step and disk; NaN where nothing was read."""
    own, disks = readings.kind == kind, int(readings.disk.max(initial=0)) + 1
    place = readings.step[own] * disks + readings.disk[own]
    count = np.bincount(place, minlength=steps * disks)
    total = np.bincount(place, values[own], minlength=steps * disks)
    with np.errstate(invalid="ignore"):
        return (total / count).reshape(steps, disks)


def expectations(table: np.ndarray) -> list[np.ndarray]:
    """What the neighbours along the columns of `table` lead to expect: between them, and beyond them."""
    padded = np.pad(table, ((0, 0), (3, 3)), constant_values=np.nan)
    count = table.shape[1]
    at = lambda shift: padded[:, 3 + shift : 3 + shift + count]  # noqa: E731
    between = [(at(-1) + at(1)) / 2, (4 * (at(-1) + at(1)) - at(-2) - at(2)) / 6]
    beyond = [weights for side in (1, -1) for weights in (2 * at(side) - at(2 * side),)]
    bent = [3 * at(side) - 3 * at(2 * side) + at(3 * side) for side in (1, -1)]
    return [*between, *beyond, *bent]


def lonely(readings: Readings, deviation: np.ndarray, of_sequence: np.ndarray) -> np.ndarray:
    """(r,) by how many sd each reading misses what its neighbours lead to expect; 0 where they are too few to tell."""
    out, steps = np.zeros(readings.count), len(of_sequence)
    for kind in np.unique(readings.kind):
        own = readings.kind == kind
        table = field(readings, deviation, kind, steps)
        guesses = expectations(table)
        for k in np.unique(of_sequence):
            rows = of_sequence == k
            along = np.full((len(guesses), *table.shape), np.nan)
            along[:, rows] = [guess.T for guess in expectations(table[rows].T)]
            guesses += list(along)
        guess = np.stack(guesses)[:, readings.step[own], readings.disk[own]]
        away = np.abs(deviation[own] - guess)
        enough = np.isfinite(away).sum(0) >= 3
        nearest = np.where(enough, np.nanmin(np.where(np.isfinite(away), away, np.inf), axis=0), 0.0)
        out[own] = nearest
    return out


def student(deviation: np.ndarray) -> np.ndarray:
    """Factor on the standard deviation by which a Student distribution weighs a reading down; at least 1."""
    return np.sqrt(np.maximum((FREEDOM + deviation**2) / (FREEDOM + 1), 1.0))


def distrust(fitted: Fit) -> np.ndarray:
    """(r,) factor on the standard deviation of every reading: 1 but for gross outliers."""
    recording = fitted.model.predict.recording
    deviation = fitted.model.predict.misfit(fitted.predicted()) / reading_sd(recording)
    off = lonely(recording.readings, deviation, recording.of_sequence)
    gross = off > ALONE
    if gross.mean() > MOST:
        return np.ones(len(off))
    return np.where(gross, student(np.maximum(off, np.abs(deviation))), 1.0)


class Weight(NamedTuple):
    """A weight that could have been noted wrongly."""

    step: int
    """Row of the load step."""
    cable: int


def wrong_weights(fitted: Fit, sensitivity: np.ndarray) -> list[Direction]:
    """The direction of every weight that could be wrong."""
    tension, basis = fitted.model.predict.recording.loads.tension, fitted.basis
    return [
        direction(fitted, Weight(int(s), int(j)), sensitivity[:, s, j, None], basis)
        for s, j in zip(*np.nonzero(tension > 0), strict=True)
    ]


@dataclass(frozen=True)
class Trust:
    """What of a recording is believed."""

    distrust: np.ndarray
    """(r,) factor on the standard deviation of each reading."""
    doubted: tuple[Weight, ...] = ()
    """Weights that are not believed."""

    def noise(self, fitted: Fit, sensitivity: np.ndarray) -> Noise:
        doubted = sorted({weight.step for weight in self.doubted})
        return noise_of(fitted.model.predict.recording, sensitivity, self.distrust, doubted)


def refit(fitted: Fit, noise: Noise) -> Fit:
    """The same model under other noise."""
    model: Model = replace(fitted.model, noise=noise)
    return fit(model, fitted.p) or fitted


def far_off(fitted: Fit, trust: Trust) -> list[int]:
    """Readings beyond `LISTED` sd of the fitted model or weighed down."""
    count = fitted.model.predict.recording.readings.count
    beyond = np.abs(fitted.residual[:count]) > LISTED
    return np.flatnonzero(beyond | (trust.distrust > 1)).tolist()
