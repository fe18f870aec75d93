"""Tensions of a log without the noise of their readings.

A load cell that is read many times a second scatters about the tension.  Friction and play that follow the path of the
loads would take every such scatter for a turn back, and an effect that holds a tension within a band, as play in the
load cell does, would be found on rigs that have none.  Where tensions change steadily, each is taken from a parabola
through its neighbours.
"""

from dataclasses import replace

import numpy as np

from prb3r.model.files.cells import numbers
from prb3r.model.steps import loads_of
from prb3r.recording.recording import Recording
from prb3r.recording.serial_noise import STEPS, steady_stretches

MOST_SCATTER = 2.0
"""Root mean square of what parabolas leave of a stretch, in stated standard deviations, up to which it is noise: more
are changes of the tension.  Choice."""

NO_SCATTER = 1e-9
"""Root mean square of what parabolas leave, over the tension, up to which nothing scatters but the rounding of numbers,
as of weights: such a stretch is left as it is."""


def with_smooth_tensions(recording: Recording) -> Recording:
    """The recording with the tensions of steady stretches from parabolas; as it is where no scatter is stated.

    A stretch is steady if the tension goes along a straight line (:func:`steady_stretches`), and it is smoothed if what
    the parabola leaves is no more than the stated scatter.  The first and last steps of a sequence stay as they are,
    and so do tensions in kilograms, which no drive logs.
    """
    scatter = recording.measurement.tension_sd_relative
    if not scatter:
        return recording
    largest, smooth = float(recording.loads.tension.max(initial=0.0)), dict[str, np.ndarray]()
    for name in (f"cable_{name}_n" for name in recording.manipulator.cable_names):
        if name not in recording.steps:
            continue
        read = numbers(recording.steps[name]).to_numpy(float)
        parts = [read[recording.of_sequence == number] for number in range(len(recording.sequences))]
        through = np.concatenate([_smoothed(part, largest, scatter) for part in parts])
        if not np.array_equal(through, read, equal_nan=True):
            smooth[name] = through
    if not smooth:
        return recording
    steps, manipulator = recording.steps.assign(**smooth), recording.manipulator
    changed = replace(recording, steps=steps, loads=loads_of(manipulator, manipulator.chain(), steps))
    return changed.with_remark(
        "tensions that change steadily are taken from parabolas through ten steps each, as the load cell scatters from "
        "one to the next"
    )


def _smoothed(read: np.ndarray, largest: float, scatter: float) -> np.ndarray:
    """(s,) the tensions `read` (s,) of a sequence, N, each from the parabola of the stretch of which it is the middle.

    Parameters
    ----------
    largest : tension of the recording, N.
    scatter : stated standard deviation, over the tension.
    """
    out, at = read.copy(), np.arange(STEPS) - STEPS // 2
    powers = np.stack([at**0, at, at**2])
    onto = np.linalg.pinv(powers.T)
    for first in np.flatnonzero(steady_stretches(read[:, None], largest)).tolist():
        stretch = read[first : first + STEPS]
        curve = onto @ stretch
        left = stretch - curve @ powers
        size = np.sqrt(np.sum(left**2) / (STEPS - len(powers)))
        mean = np.abs(stretch).mean()
        if NO_SCATTER * mean < size <= MOST_SCATTER * scatter * mean:
            out[first + STEPS // 2] = max(curve[0], 0.0)
    return out
