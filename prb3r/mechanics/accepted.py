"""The accepted states along a load path, kept for derivatives, which have to follow the same path."""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.chain import Chain
from prb3r.mechanics.kernel import kernel


@bundle
class AcceptedStates(NamedTuple):
    """Up to `e` accepted states of a chain of `n` plates and `m` cables: rest, then the end of each sub-step."""

    noted: np.ndarray
    """(1,) number of accepted states; those for which there is no room are counted but not kept."""
    row: np.ndarray
    """(e,) load step to which the sub-step belongs, from 1; 0 is rest."""
    share: np.ndarray
    """(e,) part of the way from the last solved step to this one at which the sub-step ends."""
    q: np.ndarray
    """(e, n, nodes) node angles, rad."""
    slip: np.ndarray
    """(e, n, m) slip at the holes."""


def room_for_states(chain: Chain, room: int = 0) -> AcceptedStates:
    """Arrays for up to `room` accepted states of a chain, none noted yet; with a room of 0, states are only counted."""
    return AcceptedStates(
        noted=np.zeros(1, np.int64),
        row=np.zeros(room, np.int64),
        share=np.zeros(room),
        q=np.zeros((room, *chain.stiffness.shape)),
        slip=np.zeros((room, *chain.offset.shape)),
    )


@kernel
def keep_state(accepted, row, share, state):
    """Note that `state` was accepted at `share` of the way to load step `row`; copy its node angles and slip as long as
    there is room."""
    e = accepted.noted[0]
    accepted.noted[0] += 1
    if e < len(accepted.row):
        accepted.row[e], accepted.share[e] = row, share
        for i in range(accepted.q.shape[1]):
            for k in range(accepted.q.shape[2]):
                accepted.q[e, i, k] = state.q[i, k]
            for j in range(accepted.slip.shape[2]):
                accepted.slip[e, i, j] = state.slip[i, j]
