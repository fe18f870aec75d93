r"""Partial derivatives by parameters at a held shape: of residuals, positions, tensions and lengths.

The problems a little ahead and a little behind of every parameter are evaluated with the node angles, the slips and the
dead loads' moment of a state, and their rows (see `response.py`) are differenced.  Nothing is solved, so no derivatives
by the node angles are needed; and where a parameter does not touch the geometry, the shape is placed once for all.
"""

from typing import Any, NamedTuple

import numpy as np

from prb3r.mechanics.balance import place_plate
from prb3r.mechanics.bundle import alike, bundle
from prb3r.mechanics.derivatives.response import unbalance
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.load_row import LoadRow, blend, slip_from_the_start
from prb3r.mechanics.march import next_frame
from prb3r.mechanics.records import Packed
from prb3r.mechanics.relaxation import put_stiffness
from prb3r.mechanics.variation import unload


@bundle
class PathStates(NamedTuple):
    """The `e` states to differentiate, in the order in which the chain went through them."""

    row: np.ndarray
    """(e,) load step to which a state is on the way, counted from 1; 0 is rest."""
    last: np.ndarray
    """(e,) load step from which the way comes; 0 is rest."""
    share: np.ndarray
    """(e,) part of the way at which the state lies."""
    waited: np.ndarray
    """(e,) time since the last solved step, in steps; not used where plates do not relax."""
    fresh: np.ndarray
    """(e,) whether it is the first state after rest, whose memory is that of rest."""
    write: np.ndarray
    """(e,) row of the result to which its derivatives are written, -1: to none."""
    q: np.ndarray
    """(e, n, nodes) node angles, rad."""
    slip: np.ndarray
    """(e, n, m) slip at the holes; not used where slip is declared."""


@bundle
class Sides(NamedTuple):
    """The `v` = 2 p problems on both sides of `p` parameters: ahead and behind of the first, then of the second, ..."""

    packed: Packed
    """(v, ...) records with the shape held."""
    alike: np.ndarray
    """(v,) whether the same node angles give the same shape as in the chain itself."""
    rows: np.ndarray
    """(s + 1, v, l) loads at rest and at each step, as of `rows_of_loads`."""
    apart: np.ndarray
    """(p,) distance from behind to ahead, in the parameter's unit."""
    now: LoadRow
    """Loads in one state of one problem; working space."""
    out: np.ndarray
    """(2, n, rows) rows of the plates in the problems ahead and behind of one parameter; working space."""


@bundle
class HeldState(NamedTuple):
    """Loads and derivatives of one state whose shape is held; working space but for `rows`."""

    rows: np.ndarray
    """(s + 1, l) loads on the chain itself at rest and at each step, as of `rows_of_loads`."""
    now: LoadRow
    """Loads in the state."""
    handed: np.ndarray
    """(1,) moment of the dead loads about the world origin, N m; (0,) without dead loads."""
    outer: np.ndarray
    """(3,) force and moment (about the world origin) of the dead loads beyond a plate, N and N m."""
    partial: np.ndarray
    """(n, rows, p) derivatives of the rows of the plates; see `response.py`."""
    left: np.ndarray
    """(p,) derivative of the moment left at the tip, N m."""


@kernel
def put_loads(start, target, steps, e, now):
    """Write the loads of state `e` of `steps`, on the way between two rows, to `now`; tensions may be below zero."""
    blend(start, target, steps.share[e], now)
    if steps.last[e] == 0:
        slip_from_the_start(target, now)


@kernel
def put_state(packed, steps, e, now, rest):
    """Write node angles and slips of state `e` of `steps` to the records, and with its loads `now` the plates' extra
    moments and remaining stiffness.

    Where angles are tied, `rest` holds the plates of the chain itself, and the angles beyond its stress-free ones are
    held; with None the angles themselves are held.
    """
    history = packed.model[0].presliding != 0.0
    put_stiffness(packed, now.moment, now.elapsed[0], steps.waited[e])
    for i in range(len(packed.span)):
        for k in range(steps.q.shape[2]):
            packed.plate[i].q[k] = steps.q[e, i, k]
            if rest is not None:
                packed.plate[i].q[k] += packed.plate[i].rest[k] - rest[i].rest[k]
        if history:
            for j in range(len(packed.cable)):
                packed.span[i, j].new_slip = steps.slip[e, i, j]
                packed.span[i, j].sticks = steps.row[e] > 0 and abs(steps.slip[e, i, j]) < 1.0


@kernel
def place_chain(packed):
    """Place all plates and frames of the chain for its node angles."""
    model = packed.model[0]
    for i in range(len(packed.span)):
        place_plate(model, packed.plate[i])
        next_frame(model, packed.plate[i], packed.plate[i + 1])


@kernel
def place_alike(packed, like):
    """Place all plates and frames of the chain by copying from `like`, a chain of the same shape."""
    for i in range(len(packed.span)):
        plate, other = packed.plate[i], like.plate[i]
        plate.bend = other.bend
        for d in range(2):
            plate.end[d], plate.axis[d] = other.end[d], other.axis[d]
            for k in range(plate.q.shape[0]):
                plate.node[d, k] = other.node[d, k]
        for d in range(5):
            packed.plate[i + 1].frame[d] = like.plate[i + 1].frame[d]


@kernel
def hand_back(packed, now, handed, outer):
    """Write the moment of the dead loads about the world origin, in the present shape, to `handed` if it has room.

    `outer` is working space.
    """
    if len(handed) > 0:
        outer[2] = 0.0
        for i in range(len(packed.span)):
            unload(packed, i, now.force, now.tip, outer)
        handed[0] = -outer[2]


@kernel
def difference(held, sides, steps, e, state, rest):
    """Write the derivatives at the held shape of state `e` of `steps` to `state.partial` and `state.left`.

    `held` is the chain itself in that state under its loads; slack cables stay slack.  `rest` is that of `put_state`.
    """
    packed, out, acting, partial, left = sides.packed, sides.out, sides.now, state.partial, state.left
    start, target = sides.rows[steps.last[e]], sides.rows[steps.row[e]]
    for v in range(len(sides.alike)):
        d, behind = v // 2, v % 2
        side: Any = alike(held, (packed.model[v], packed.plate[v], packed.span[v], packed.cable[v]))  # type: ignore[call-arg]
        put_loads(start[v], target[v], steps, e, acting)
        for j in range(len(state.now.tension)):
            if state.now.tension[j] < 0.0:
                acting.tension[j] = 0.0
        put_state(side, steps, e, acting, rest)
        if sides.alike[v]:
            place_alike(side, held)
        else:
            place_chain(side)
        if rest is not None:
            hand_back(side, acting, state.handed, state.outer)
        over = unbalance(side, acting, state.handed, state.outer, out[behind])
        if not behind:
            left[d] = over
            continue
        left[d] = (left[d] - over) / sides.apart[d]
        for i in range(partial.shape[0]):
            for r in range(partial.shape[1]):
                partial[i, r, d] = (out[0, i, r] - out[1, i, r]) / sides.apart[d]
