r"""Derivatives along a load path: what is differenced, what is solved, what holes remember.

See `sensitivity.py` for the method and `response.py` for the rows of the arrays.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.attempt import blend
from prb3r.mechanics.chain import Loads
from prb3r.mechanics.drift import Scratch
from prb3r.mechanics.feedback import Sweep, sweep
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.newton import solve_block
from prb3r.mechanics.records import Packed
from prb3r.mechanics.response import Room, respond, unbalance
from prb3r.mechanics.tangent import chain_tangent


class Steps(NamedTuple):
    """States to differentiate, in the order in which the chain went through them."""

    row: np.ndarray
    """(e,) load step that a state is on the way to, counted from 1; 0 is rest."""
    last: np.ndarray
    """(e,) load step that it comes from."""
    share: np.ndarray
    """(e,) part of the way."""
    fresh: np.ndarray
    """(e,) whether it is the first after rest."""
    write: np.ndarray
    """(e,) step whose derivatives these are, -1 for none."""
    q: np.ndarray
    """(e, n, nodes)."""
    slip: np.ndarray
    """(e, n, m); no cables where slip is declared."""


class Memory(NamedTuple):
    """What holes remember of the last accepted state, and its derivatives."""

    slip: np.ndarray
    """(n, m)."""
    dslip: np.ndarray
    """(n, m, p)."""
    dbeyond: np.ndarray
    """(n, m, p) of the cable lengths beyond the holes."""


class Space(NamedTuple):
    """Working space of :func:`differentiate`."""

    now: Loads
    handed: np.ndarray
    """(b, 1) moment of the dead loads about the world origin; none where none act."""
    slack: np.ndarray
    """(b, m) whether the tension is negative in sum."""
    memory: Memory
    at_rest: Memory
    held: np.ndarray
    """(n, rows) of one problem, at the held shape."""
    partial: np.ndarray
    """(b, n, rows, p)."""
    left: np.ndarray
    """(b, p) derivative of the moment left at the tip."""
    room: Room
    sweep: Sweep
    work: Scratch


@kernel
def put_loads(packed, rows, steps, e, loaded, now):
    """Loads of state `e`, tensions below zero included, dead loads where any are (`loaded`)."""
    last, row, share = steps.last[e], steps.row[e], steps.share[e]
    blend(rows.tension, last, row, share, now.tension)
    blend(rows.slip, row, row, 1.0, now.slip)
    if loaded:
        blend(rows.force, last, row, share, now.force)
        blend(rows.tip, last, row, share, now.tip)
    if packed.model[0].extra:
        start, target = rows.moment[last], rows.moment[row]
        for i in range(len(target)):
            packed.plate[i].extra = start[i] + share * (target[i] - start[i])


@kernel
def put_state(packed, steps, e, rest):
    """Shape and slip of state `e`.

    Where angles are tied (`rest` is not None) those beyond the stress-free ones are held, else the angles are.
    """
    history = packed.model[0].presliding != 0.0
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
def recall(packed, sides, apart, memory, partial):
    """What the memory of every hole that sticks adds to its slip, in the rows of `partial`."""
    n, m, presliding = packed.plate[0].q.shape[0], len(packed.cable), packed.model[0].presliding
    for d in range(len(apart)):
        longer = (sides.model[2 * d, 0].presliding - sides.model[2 * d + 1, 0].presliding) / apart[d]
        for i in range(len(packed.span)):
            for j in range(m):
                hole, slip = packed.span[i, j], 0.0
                if hole.sticks:
                    length = partial[i, n + 3 + m + j, d] - memory.dbeyond[i, j, d]
                    length -= (hole.new_slip - memory.slip[i, j]) * longer
                    slip = memory.dslip[i, j, d] + length / presliding
                partial[i, n + 3 + 2 * m + j, d] = slip


@kernel
def remember(packed, partial, memory):
    """Take the state just differentiated as the one that holes remember."""
    n, m = packed.plate[0].q.shape[0], len(packed.cable)
    for i in range(len(packed.span)):
        for j in range(m):
            memory.slip[i, j] = packed.span[i, j].new_slip
            for d in range(partial.shape[2]):
                memory.dbeyond[i, j, d] = partial[i, n + 3 + m + j, d]
                memory.dslip[i, j, d] = partial[i, n + 3 + 2 * m + j, d]


@kernel
def copy_memory(source, into):
    into.slip[:] = source.slip
    into.dslip[:], into.dbeyond[:] = source.dslip, source.dbeyond


@kernel
def tie(packed, now, modes, work, partial):
    """Put the answer of tied node angles in the place of the residuals' derivatives in `partial`."""
    chain_tangent(packed, now.tension, now.slip, now.force, now.tip, modes, work)
    plates, n, columns = modes.shape
    p = partial.shape[2]
    system = np.zeros((columns, columns + p))
    for c in range(columns):
        for d in range(columns):
            system[c, d] = work.system[c, d]
        for d in range(p):
            for i in range(plates):
                for k in range(n):
                    system[c, columns + d] -= modes[i, k, c] * partial[i, k, d]
    solve_block(system, columns, columns + p)
    for i in range(plates):
        for k in range(n):
            for d in range(p):
                partial[i, k, d] = 0.0
                for c in range(columns):
                    partial[i, k, d] += modes[i, k, c] * system[c, columns + d]


@kernel
def hand_back(packed, now, handed, outer, still, out):
    """Moment of the dead loads about the world origin in the present shape; the last three are working space."""
    if len(handed) > 0:
        handed[0] = 0.0
        handed[0] = -unbalance(packed, now, handed, outer, still, out)


@kernel
def difference(packed, sides, side_rows, v, apart, steps, first, states, modes, space):
    """Rows of problem `v` at the held shapes of `states` states from `first`, in `space.partial`.

    Those of a problem behind turn what is there, of the one ahead, into derivatives; they are `apart`.
    """
    now, out, partial, outer, still = space.now, space.held, space.partial, space.room.outer, space.room.still
    d, loaded = v // 2, space.handed.shape[1] > 0
    side = Packed(sides.model[v], sides.plate[v], sides.span[v], sides.cable[v])
    r = side_rows
    rows = Loads(r.tension[v], r.slip[v], r.force[v], r.tip[v], r.moment[v])
    for e in range(states):
        handed = space.handed[e]
        put_loads(side, rows, steps, first + e, loaded, now)
        for j in range(len(now.tension)):
            if space.slack[e, j]:
                now.tension[j] = 0.0
        if modes is None:
            put_state(side, steps, first + e, None)
        else:
            put_state(side, steps, first + e, packed.plate)
            hand_back(side, now, handed, outer, still, out)
        over = unbalance(side, now, handed, outer, still, out)
        space.left[e, d] = over if v == 2 * d else (space.left[e, d] - over) / apart
        for i in range(out.shape[0]):
            for r in range(out.shape[1]):
                partial[e, i, r, d] = out[i, r] if v == 2 * d else (partial[e, i, r, d] - out[i, r]) / apart


@kernel
def differentiate(packed, sides, rows, side_rows, apart, steps, modes, space, out):
    """Derivatives of all states of `steps`, written to `out` (s, plates, rows, p) where they end a load step.

    `sides` and `side_rows` are the problems ahead and behind of every parameter, in turn.
    """
    now, block, history = space.now, len(space.partial), packed.model[0].presliding != 0.0
    loaded, outer, still = space.handed.shape[1] > 0, space.room.outer, space.room.still
    for first in range(0, len(steps.row), block):
        states = min(block, len(steps.row) - first)
        for e in range(states):
            put_loads(packed, rows, steps, first + e, loaded, now)
            put_state(packed, steps, first + e, None)
            hand_back(packed, now, space.handed[e], outer, still, space.held)
            for j in range(len(now.tension)):
                space.slack[e, j] = now.tension[j] < 0.0
        for d in range(len(apart)):
            difference(packed, sides, side_rows, 2 * d, apart[d], steps, first, states, modes, space)
            difference(packed, sides, side_rows, 2 * d + 1, apart[d], steps, first, states, modes, space)
        for e in range(states):
            partial, left, handed = space.partial[e], space.left[e], space.handed[e]
            if steps.fresh[first + e]:
                copy_memory(space.at_rest, space.memory)
            put_loads(packed, rows, steps, first + e, loaded, now)
            put_state(packed, steps, first + e, None)
            for j in range(len(now.tension)):
                now.tension[j] = max(now.tension[j], 0.0)
            if modes is not None:
                tie(packed, now, modes, space.work, partial)
            if history:
                unbalance(packed, now, handed, outer, still, space.held)
                recall(packed, sides, apart, space.memory, partial)
                sweep(packed, now, partial, left, space.room.gain, space.sweep)
            respond(packed, now, handed, partial, left, modes is not None, space.room)
            if history:
                remember(packed, partial, space.memory)
                if steps.row[first + e] == 0:
                    copy_memory(space.memory, space.at_rest)
            if steps.write[first + e] >= 0:
                out[steps.write[first + e]] = partial
