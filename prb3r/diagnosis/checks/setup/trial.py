"""Trials of remedies: the evidence for each, from the misfits of the mended recording and of the recording as it is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.checks.setup.remedy import Mended, Remedy
from prb3r.diagnosis.checks.setup.robust import Standing
from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Trial:
    """A remedy, and how well the mended recording agrees with its manipulator."""

    remedy: Remedy
    mended: Mended
    standing: Standing
    """Of the mended recording."""
    gain: float
    """Logarithm of the likelihood ratio against the recording as it is, of the readings that the remedy concerns."""
    total: float
    """Robust misfit of all photographs, a photograph counting as one number, and improbability of the constants."""


def best_trial(here: Standing, remedy: Remedy, mended: Mended, standings: Sequence[Standing]) -> Trial:
    """The trial of a remedy at those constants of `standings` for which its gain is largest.

    Of a photograph only the readings that the remedy concerns count, as one number (of one that it does not concern,
    all).  Their misfit is in units of how far off the rest of the photograph is: where everything is wrong, it is no
    evidence that a part of it is less wrong with other labels.

    Parameters
    ----------
    here : the recording as it is.
    standings : the mended recording, at some constants each.
    """
    step, count = here.recording.readings.step, len(standings)
    photograph = np.arange(count)[:, None] * (step.max() + 1) + step  # each standing has photographs of its own

    def summed(values: np.ndarray) -> np.ndarray:
        """(c, s) sums over each photograph for each standing, of values (c, r), or (r,) if all have the same."""
        values = np.broadcast_to(values, photograph.shape).ravel()
        return np.bincount(photograph.ravel(), values, count * (step.max() + 1)).reshape(count, -1)

    after = np.repeat(here.loss[None], count, axis=0)
    after[:, mended.rows] = [there.loss for there in standings]
    concerned = touched(here.recording, mended)
    touches, others = summed(concerned)[0], summed(~concerned)[0]
    rest = summed(np.where(concerned, 0.0, after)) / np.maximum(others, 1)
    slack = _log(np.where(concerned, np.expm1(rest)[:, step], 0.0))
    fall = np.logaddexp(here.loss, slack) - np.logaddexp(after, slack)
    weight = np.where(touches[step] > 0, concerned, True) / np.where(touches > 0, touches, others)[step]
    improbable = np.array([there.improbable for there in standings])
    gain = (fall * weight).sum(1) + here.improbable - improbable
    total = (after / np.bincount(step)[step]).sum(1) + improbable
    best = int(np.argmax(gain))
    return Trial(remedy, mended, standings[best], float(gain[best]), float(total[best]))


def _log(values: np.ndarray) -> np.ndarray:
    """Natural logarithm of every value, in the shape of `values`; minus infinity for zero, without a warning."""
    return np.log(values, out=np.full(values.shape, -np.inf), where=values > 0)


def touched(recording: Recording, mended: Mended) -> np.ndarray:
    """(r,) whether mending changes the loads, the label or the value of each reading of a recording, or leaves it out;
    with another manipulator all readings are concerned."""
    changed, before = mended.recording, recording.readings.where(mended.rows)
    if changed.manipulator is not recording.manipulator:
        return np.ones(recording.readings.count, bool)
    loads = zip(changed.loads, recording.loads, strict=True)
    moved = np.any([(a != b).reshape(len(a), -1).any(1) for a, b in loads if a is not None], axis=0)
    out = np.ones(recording.readings.count, bool)  # readings that are left out are concerned
    out[mended.rows] = moved[before.step] | np.any(
        [a != b for a, b in zip(changed.readings, before, strict=True)], axis=0
    )
    return out
