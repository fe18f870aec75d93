"""Doubts about a recording that is at odds with the drawing of its rig: exchanged axes, tensions in a wrong unit."""

from collections.abc import Iterator

import numpy as np

from prb3r.recording.recording import Kind, Recording

LITTLE = 0.3
"""Share of the largest load up to which a step counts as little loaded: the arm is nearly straight.  Choice."""
FEWEST_STRAIGHT = 3
"""Fewest readings of the arm little loaded for a doubt.  Choice: one or two may be slips."""
TOO_HARD = 30.0
"""Largest ratio between the turn of the tip that the tensions would cause and the one that is seen without a doubt.
Choice: between what friction and stops hold back and the 102 by which grams exceed newtons."""
WHOLE_TURN = 2 * np.pi


def at_odds(recording: Recording) -> Iterator[str]:
    """All doubts about a recording and the drawing of its rig, each a sentence."""
    yield from _exchanged_axes(recording)
    yield from _too_hard(recording)


def _exchanged_axes(recording: Recording) -> Iterator[str]:
    """A doubt if the arm lies along y where it is little loaded."""
    pull = (
        recording.loads.tension.sum(1) + np.abs(recording.loads.tip).sum(1) + np.abs(recording.loads.force).sum((1, 2))
    )
    little = pull <= LITTLE * pull.max(initial=0.0)
    table = _places(recording)
    seen = little[table[:, 0].astype(int)] & np.isfinite(table).all(1)
    x, y, along = table[seen, 2], table[seen, 3], _along(recording)[table[seen, 1].astype(int)]
    if seen.sum() < FEWEST_STRAIGHT:
        return
    if np.median(np.hypot(np.abs(y) - along, x) / along) < 1 / 4 < 3 / 4 < np.median(np.hypot(x - along, y) / along):
        yield (
            "the arm lies along y where it is loaded least, but a straight one along x; are x_m and y_m exchanged, "
            "or the pictures turned by a right angle?"
        )


def _too_hard(recording: Recording) -> Iterator[str]:
    """A doubt if the tensions would turn the tip many times as far as it is seen to turn, and by more than a turn."""
    chain, tension, readings = recording.manipulator.chain(), recording.loads.tension, recording.readings
    crossed = np.arange(chain.plates)[:, None] < chain.reach
    moment = np.abs(np.einsum("sm,nm->sn", tension, chain.offset * crossed))
    expected = moment @ (1 / chain.stiffness).sum(1)
    turned = np.zeros(len(tension))
    angles = readings.kind == Kind.ANGLE
    np.maximum.at(turned, readings.step[angles], np.abs(readings.value[angles]))
    table = _places(recording)
    table = table[np.isfinite(table).all(1)]
    chord = 2 * np.arctan2(np.abs(table[:, 3]), np.maximum(table[:, 2], 0.0))  # of an arc that begins along x
    np.maximum.at(turned, table[:, 0].astype(int), chord)
    hard = (expected > expected.max(initial=0.0) / 2) & (turned > 0)
    if not hard.any():
        return
    there, seen = float(np.median(expected[hard])), float(np.median(turned[hard]))
    if there > max(TOO_HARD * seen, WHOLE_TURN):
        yield (
            f"tensions of up to {tension.max():.3g} N would turn the tip by some {np.degrees(there):.3g} degrees "
            f"without friction, and it is seen to turn by {np.degrees(seen):.3g}; are they in grams, or is a "
            "stiffness wrong?"
        )


def _along(recording: Recording) -> np.ndarray:
    """(n + 1,) distance of every disk from the base along the straight arm, m."""
    chain = recording.manipulator.chain()
    return np.concatenate([[0.0], np.cumsum(chain.arc + 2 * chain.clamp + chain.disk)])


def _places(recording: Recording) -> np.ndarray:
    """(k, 4) step, disk, x and y (m) of every disk of which a coordinate was read; NaN where one was not, and of the
    base none."""
    step, disk, kind, value = recording.readings
    chosen = (kind <= Kind.Y) & (disk > 0)
    keys, row = np.unique(np.stack([step, disk])[:, chosen], axis=1, return_inverse=True)
    places = np.full((2, keys.shape[1]), np.nan)
    places[kind[chosen], row.ravel()] = value[chosen]
    return np.column_stack([keys.T, places.T])
