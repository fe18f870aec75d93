"""Readings that move on while loads are held: a rig that creeps, seen without any model."""

from collections.abc import Iterator
from math import comb

import numpy as np

from prb3r.recording.recording import Recording

HELD_CHANGE = 0.1
"""Largest change of the tensions while loads are held, over that of the step before.  Choice: what is read with it then
moves by as small a share of what that step moved."""
RATE = 0.005
"""Largest rate at which noise alone is told as a motion, so that eight holds are needed.  Choice."""
LEAST = 0.02
"""Least mean share of the motion of the step before that is told.  Choice: less changes no design."""


def creeping(recording: Recording) -> Iterator[str]:
    """A doubt if readings move on, in the direction in which the step before moved them, while loads are held.

    Noise alone has the same sign as often as the other one, or less often: that of the first reading under a held load
    makes the two motions opposite.
    """
    shares = np.array(list(_shares(recording)))
    count, onward = len(shares), int((shares > 0).sum())
    chance = sum(comb(count, k) for k in range(onward, count + 1)) / 2**count
    if chance < RATE and shares.mean() > LEAST:
        yield (
            f"readings move on while loads are held: at {count} holds by {100 * shares.mean():.0f} % of what the step "
            "before had moved them, on the average; something creeps or gives way with time, as polymers do "
            "(plate_relaxation): read at one time after each load, or note the times (time_s) and begin every sequence "
            "with a row without load"
        )


def _shares(recording: Recording) -> Iterator[float]:
    """For every hold, the motion during it over that of the step before, in the least-squares sense over all readings
    in units of their standard deviations."""
    readings, measurement = recording.readings, recording.measurement
    sd = np.where(readings.is_position, measurement.position_sd_m or 1.0, measurement.angle_sd_rad or 1.0)
    at = dict[int, dict[tuple[int, int], float]]()
    for step, disk, kind, value in zip(*(field.tolist() for field in readings), strict=True):
        at.setdefault(step, {})[disk, kind] = value
    scale = {(d, k): s for d, k, s in zip(readings.disk.tolist(), readings.kind.tolist(), sd.tolist(), strict=True)}
    for before, first, last in _holds(recording):
        read = [at.get(step, {}) for step in (before, first, last)]
        places = sorted(read[0].keys() & read[1].keys() & read[2].keys())
        values = np.array([[of[place] / scale[place] for place in places] for of in read])
        moved = values[1] - values[0] if places else np.zeros(0)
        if moved @ moved > 0:
            yield float((values[2] - values[1]) @ moved / (moved @ moved))


def _holds(recording: Recording) -> Iterator[tuple[int, int, int]]:
    """For every hold the numbers of the step before it, of its first and of its last step."""
    loads, number = recording.loads, recording.of_sequence
    other = np.concatenate([loads.force.reshape(len(number), -1), loads.tip.reshape(len(number), -1)], 1)
    first = 1
    while first < len(number):
        last, changed = first, np.abs(loads.tension[first] - loads.tension[first - 1]).max(initial=0.0)
        while (
            last + 1 < len(number)
            and number[last + 1] == number[first]
            and np.abs(loads.tension[last + 1] - loads.tension[first]).max(initial=0.0) <= HELD_CHANGE * changed
            and np.array_equal(other[last + 1], other[first])
            and np.array_equal(loads.slip[last + 1], loads.slip[first])  # not let go in between and pulled again
        ):
            last += 1
        if last > first and changed > 0 and number[first - 1] == number[first]:
            yield first - 1, first, last
        first = last + 1
