"""Readings that stay the same to the last digit while loads change: a picture that was taken once and read again."""

from collections.abc import Iterator

import numpy as np

from prb3r.markdown import listed
from prb3r.recording.recording import Recording

FEWEST_THE_SAME = 4
"""Fewest readings that have to be the same and not zero.  Choice: single ones are the same by chance where instruments
show few digits."""
CHANGED = 0.02
"""Least change of a load, over the largest one of its kind.  Choice: less may move nothing that is read."""


def frozen(recording: Recording) -> Iterator[str]:
    """A doubt for each sequence of which steps under other loads than the step before have all its readings."""
    readings, number = recording.readings, recording.of_sequence
    at = dict[int, dict[tuple[int, int], float]]()
    for step, disk, kind, value in zip(*(field.tolist() for field in readings), strict=True):
        at.setdefault(step, {})[disk, kind] = value
    loads = recording.loads
    acting = np.hstack([loads.tension, loads.force.reshape(len(number), -1), loads.tip])
    largest = np.abs(acting).max(0, initial=0.0)
    again = dict[int, list[int]]()
    for step in np.flatnonzero(~recording.begins).tolist():
        before, now = at.get(step - 1, {}), at.get(step, {})
        same = before == now and sum(value != 0 for value in now.values()) >= FEWEST_THE_SAME
        if same and (np.abs(acting[step] - acting[step - 1]) > CHANGED * largest).any():
            again.setdefault(int(number[step]), []).append(int(recording.steps["step"].iloc[step]))
    for sequence, steps in again.items():
        which = f"step{'s' * (len(steps) > 1)} {listed([str(step) for step in steps])}"
        has = "have" if len(steps) > 1 else "has"
        yield (
            f"sequence {recording.sequences[sequence]}: {which} {has} the readings of the step before to the last "
            "digit, under other loads; was a picture read twice, or did the camera stand still? leave them out"
        )
