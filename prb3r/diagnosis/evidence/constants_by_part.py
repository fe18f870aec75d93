"""Stiffness and friction estimated from each part of a recording alone: differences betray missing physics."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.fit.model import Fit
from prb3r.recording.recording import Recording

MOST_CONDITION = 1e8
"""Condition number of the normal matrix above which a part cannot tell its constants apart; for the derivatives, whose
condition number is its square root, the limit is 1e4."""


@dataclass(frozen=True)
class Clue:
    """The constants estimated from one part of the readings alone: one Gauss-Newton step from the calibrated ones, with
    the camera frame held and without priors."""

    by: str
    """What the readings are divided by: direction, segment, amplitude or sequence."""
    part: str
    """Name of the part, such as `disks 1 to 7`."""
    stiffness: float
    """Factor on the calibrated stiffness."""
    stiffness_sd: float
    """Of that factor."""
    friction: float | None
    """Factor on the calibrated friction; None where friction is not calibrated."""
    friction_sd: float | None


def parts(recording: Recording, most_segments: int) -> Iterator[tuple[str, str, np.ndarray]]:
    """Parts of a recording: what it is divided by, the name of the part, and a mask (r,) of the readings in it.

    `most_segments`: largest number of segments, from the base, that are parts.
    """
    tension, step, disk = recording.loads.tension, recording.readings.step, recording.readings.disk
    change = np.diff(tension.sum(1), prepend=0.0)
    change[recording.begins] = tension.sum(1)[recording.begins]
    yield "direction", "tensions rise", (change > 0)[step]
    yield "direction", "tensions fall", (change < 0)[step]
    first = 1
    for number, end in enumerate(recording.manipulator.segment_ends, 1):
        yield "segment", f"disks {first} to {end}", (disk >= first) & (disk <= end)
        first = end + 1
        if number >= most_segments:
            break
    pull = tension.max(1, initial=0.0)
    ends = np.quantile(pull[pull > 0], [0, 1 / 3, 2 / 3, 1]) if (pull > 0).any() else np.zeros(4)
    for low, high, name in zip(ends, ends[1:], ("small loads", "middle loads", "large loads"), strict=False):
        yield "amplitude", name, ((pull >= low) & (pull <= high))[step]
    for k, name in enumerate(recording.sequences):
        yield "sequence", name, (recording.of_sequence == k)[step]


def clues(calibrated: Fit) -> list[Clue]:
    """The constants of every proper part, in the order of :func:`parts`.

    Parts with fewer than `Settings.fewest_readings_of_part` readings are left out, as are those whose constants cannot
    be told apart (`MOST_CONDITION`) or have a standard deviation above `Settings.part_sd`.
    """
    settings, varied = calibrated.model.settings, calibrated.model.varied
    factors = [k for k, name in enumerate(varied) if name.startswith("log_")]
    count = calibrated.recording.readings.count
    constants = []
    for by, part, mask in parts(calibrated.recording, settings.most_segments_told):
        columns, residual = calibrated.jacobian[:count][mask][:, factors], calibrated.misfit[mask]
        normal = columns.T @ columns
        if mask.all() or mask.sum() < settings.fewest_readings_of_part or np.linalg.cond(normal) > MOST_CONDITION:
            continue
        covariance = np.linalg.inv(normal)
        step = -covariance @ (columns.T @ residual)
        sd = np.sqrt(np.diag(covariance))
        if sd.max() > settings.part_sd:
            continue
        friction = len(factors) > 1
        constants.append(
            Clue(
                by,
                part,
                float(np.exp(step[0])),
                float(np.exp(step[0]) * sd[0]),
                float(np.exp(step[1])) if friction else None,
                float(np.exp(step[1]) * sd[1]) if friction else None,
            )
        )
    return constants
