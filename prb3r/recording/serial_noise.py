r"""Noise that lasts from one reading to the next, as a log tells it by itself.

A tracker that filters what it sees, or a lamp that drifts, leaves errors that are alike in readings that follow one
another.  In a log the loads hardly change within a dozen steps, and whatever the physics, what is read changes along a
parabola then.  What is left beside the parabola is noise, and its likelihood under a correlation between steps `k`
apart of

.. math:: (1 - w) \delta_{k0} + w \exp(-k / \ell)

tells that a share `w` of the variance lasts, and roughly over how many steps :math:`\ell`: noise that lasts much longer
than a stretch looks alike beside a parabola.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from prb3r.recording.recording import NO_SERIAL_NOISE, Recording, SerialNoise

STEPS = 10
"""Steps of a stretch.  Choice: seven numbers are left beside a parabola, and loads change by little."""
MOST_CHANGE = 0.045
"""Change of the loads from one step to the next at most, over the largest load.  Choice: programs that are read step by
step have 5 % and more, and within ten such steps physics bends readings more than a parabola does."""
MOST_BENT = 0.01
"""Distance of the loads of a stretch from a straight line at most, over the largest load: beyond, they turn.  Choice:
more than most load cells scatter."""
FEWEST_STRETCHES = 8
"""Stretches of all disks, kinds of readings and sequences from which on the noise is told.  Choice."""
COUNTED = 0.9
"""Share of the stretches that is counted, those with the least left: others hold outliers or a kink.  Choice."""
SHARES, SPANS = (0.25, 0.5, 0.75, 0.98), (1.0, 1.4, 2.0, 2.8, 4.0, 5.7, 8.0, 11.0, 16.0)
"""Shares and steps that are tried."""
BETTER = 10.0
"""Fall of minus twice the ln of the likelihood from which on a share is believed: "very strong" (Kass and Raftery, J.
Am. Stat. Assoc. 90 (1995) 773)."""


def with_serial_noise(recording: Recording) -> Recording:
    """The recording with the noise that lasts from step to step, as :func:`serial_noise` tells it."""
    return replace(recording, serial_noise=serial_noise(recording))


def serial_noise(recording: Recording) -> SerialNoise:
    """The noise that lasts from step to step in a recording that is a log; none in others, or if it is not seen."""
    series = [stretches for each in _series(recording) if len(stretches := np.array(each)) >= 2]
    if sum(map(len, series)) < FEWEST_STRETCHES:
        return NO_SERIAL_NOISE
    at = np.linspace(-1, 1, STEPS)
    beside = np.linalg.qr(np.stack([at**0, at, at**2], 1), mode="complete")[0][:, 3:]
    left = [stretches @ beside for stretches in series]
    tried = {SerialNoise(w, span): _deviance(left, beside, w, span) for w in SHARES for span in SPANS}
    best = min(tried, key=tried.__getitem__)
    return best if tried[best] < _deviance(left, beside, 0.0, 1.0) - BETTER else NO_SERIAL_NOISE


def _deviance(left: list[np.ndarray], beside: np.ndarray, share: float, span: float) -> float:
    """Minus twice the ln of the likelihood of what parabolas leave, (stretches, d) of every series, at the likeliest
    standard deviation of each."""
    apart = np.abs(np.subtract.outer(np.arange(STEPS), np.arange(STEPS)))
    covariance = beside.T @ ((1 - share) * (apart == 0) + share * np.exp(-apart / span)) @ beside
    inverse, volume = np.linalg.inv(covariance), float(np.linalg.slogdet(covariance)[1])
    total = 0.0
    for stretches in left:
        size = np.sort(np.einsum("ki,ij,kj->k", stretches, inverse, stretches))
        kept = size[: max(int(np.ceil(COUNTED * len(size))), 1)]
        freedom = beside.shape[1] * len(kept)
        total += freedom * np.log(max(kept.sum() / freedom, 1e-300)) + len(kept) * volume
    return total


def _series(recording: Recording) -> Iterator[list[np.ndarray]]:
    """The stretches (STEPS,) of the readings of every disk and kind in every sequence that do not overlap, m or rad."""
    step, disk, kind, value = recording.readings
    largest = float(np.abs(recording.every_load).max(initial=0.0))
    for number in range(len(recording.sequences)):
        rows = np.flatnonzero(recording.of_sequence == number)
        begins = steady_stretches(recording.every_load[rows], largest)
        of_sequence = recording.of_sequence[step] == number
        for at in np.unique(np.stack([disk, kind])[:, of_sequence], axis=1).T if begins.any() else ():
            mine = of_sequence & (disk == at[0]) & (kind == at[1])
            read = np.full(len(rows), np.nan)
            read[step[mine] - rows[0]] = value[mine]
            found, first = [], 0
            while first + STEPS <= len(rows):
                stretch = read[first : first + STEPS]
                good = bool(begins[first] and np.isfinite(stretch).all())
                found += [stretch] * good
                first += STEPS if good else 1
            yield found


def steady_stretches(loads: np.ndarray, largest: float) -> np.ndarray:
    """(s,) whether the stretch of `STEPS` that begins with a step has `loads` (s, l), N, that change little and
    steadily in comparison with the `largest` load, N."""
    steady = np.zeros(len(loads), bool)
    if len(loads) < STEPS or largest <= 0:
        return steady
    stretches = np.lib.stride_tricks.sliding_window_view(loads / largest, STEPS, axis=0)
    at = np.linspace(-1, 1, STEPS)
    beside = np.linalg.qr(np.stack([at**0, at], 1), mode="complete")[0][:, 2:]
    change = np.abs(np.diff(stretches, axis=2)).max((1, 2), initial=0.0)
    bent = np.abs(stretches @ beside @ beside.T).max((1, 2), initial=0.0)
    steady[: len(stretches)] = (change <= MOST_CHANGE) & (bent <= MOST_BENT)
    return steady
