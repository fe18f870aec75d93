"""Where cables are pulled harder and where they are let go, by the tensions that were noted at the steps."""

import numpy as np

from prb3r.recording.recording import Recording

FELT_CHANGE = 3.0
"""Change of a tension that is more than the scatter of a cable that is held, in standard deviations of a difference of
two tensions.  Choice: a cable that is held seems to move once in 370 steps."""


def felt_changes(recording: Recording) -> np.ndarray:
    """(s, m) sign of the change of each tension since it last changed, or since rest: 1 pulled harder, -1 let go.

    It is 0 where a tension differs by no more than the scatter of tensions, `tension_sd_relative`: load cells never
    read the same twice.
    """
    tension, begins = recording.loads.tension, recording.begins
    error = FELT_CHANGE * recording.measurement.tension_sd_relative
    out, held = np.zeros_like(tension), np.zeros(tension.shape[1])
    for s, now in enumerate(tension):
        if begins[s]:
            held = np.zeros(len(now))
        felt = np.abs(now - held) > error * np.hypot(now, held)
        out[s] = np.where(felt, np.sign(now - held), 0.0)
        held = np.where(felt, now, held)
    return out


def slips_by_tension(recording: Recording) -> np.ndarray:
    """(s, m) slip of each cable as its tension says: 1 paid out where it is let go, -1 drawn in where it is pulled
    harder, as at the step before where it is held; -1 until its tension first changes."""
    slip = -felt_changes(recording).astype(int)
    for s, begins in enumerate(recording.begins):
        before = -1 if begins else slip[s - 1]
        slip[s] = np.where(slip[s] == 0, before, slip[s])
    return slip


def turns_back(recording: Recording) -> np.ndarray:
    """(s, m) whether the tension of each cable turns back at a step: that its last change was of the other sign, in the
    same sequence."""
    change = felt_changes(recording)
    turned, last = np.zeros(change.shape, bool), np.zeros(change.shape[1])
    for s, begins in enumerate(recording.begins):
        last = last * (not begins)
        turned[s] = change[s] * last < 0
        last = np.where(change[s] == 0, last, change[s])
    return turned
