"""The accepted states along a load path, kept for what has to follow it once more."""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.chain import Chain
from prb3r.mechanics.kernel import kernel


class Trail(NamedTuple):
    """States of a chain of `n` plates and `m` cables where friction follows the travel: rest, then each sub-step."""

    noted: np.ndarray
    """(1,) states that were to be kept; more than there is room for are only counted."""
    row: np.ndarray
    """(e,) load step that the sub-step leads to, from 1; 0 is rest."""
    share: np.ndarray
    """(e,) part of the way there from the last good step."""
    q: np.ndarray
    """(e, n, nodes) node angles."""
    slip: np.ndarray
    """(e, n, m) slip at the holes."""


def empty_trail(chain: Chain, room: int = 0) -> Trail:
    """Room for `room` states."""
    return Trail(
        noted=np.zeros(1, np.int64),
        row=np.zeros(room, np.int64),
        share=np.zeros(room),
        q=np.zeros((room, *chain.stiffness.shape)),
        slip=np.zeros((room, *chain.offset.shape)),
    )


@kernel
def keep(trail, row, share, state):
    """Keep one accepted state."""
    e = trail.noted[0]
    trail.noted[0] += 1
    if e < len(trail.row):
        trail.row[e], trail.share[e] = row, share
        trail.q[e] = state.q
        trail.slip[e] = state.slip
