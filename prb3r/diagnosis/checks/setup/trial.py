"""A remedy against the recording as it is: what speaks for it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.checks.setup.remedy import Mended, Remedy
from prb3r.diagnosis.checks.setup.robust import Standing
from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Trial:
    """A remedy, and how the recording stands with its manipulator then."""

    remedy: Remedy
    mended: Mended
    standing: Standing
    gain: float
    """Logarithm of the likelihood ratio to the recording as it is."""
    total: float
    """Robust misfit of all photographs and improbability of the constants."""


def best_trial(here: Standing, remedy: Remedy, mended: Mended, standings: Sequence[Standing]) -> Trial:
    """A remedy with the constants for which most speaks, against the recording as it is.

    Of a photograph only what the blunder concerns counts, as one number, in units of how far off the rest of the
    photograph is: where all is wrong, it is no evidence that some of it is less so with other labels.

    Parameters
    ----------
    standings : of the mended recording with some constants each.
    """
    step, count = here.recording.readings.step, len(standings)
    photograph = np.arange(count)[:, None] * (step.max() + 1) + step  # each standing has photographs of its own

    def summed(values: np.ndarray) -> np.ndarray:
        """(c, s) of each photograph of each standing, of (c, r) or (r,) for all alike."""
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
    """(r,) whether its mending concerns a reading of a recording: its loads, its label or its value, or all of them
    where the manipulator is another one."""
    changed, before = mended.recording, recording.readings.where(mended.rows)
    if changed.manipulator is not recording.manipulator:
        return np.ones(recording.readings.count, bool)
    loads = zip(changed.loads, recording.loads, strict=True)
    moved = np.any([(a != b).reshape(len(a), -1).any(1) for a, b in loads if a is not None], axis=0)
    out = np.ones(recording.readings.count, bool)  # what belongs nowhere any more is concerned
    out[mended.rows] = moved[before.step] | np.any(
        [a != b for a, b in zip(changed.readings, before, strict=True)], axis=0
    )
    return out
