r"""Derivatives of all states along a load path, in compiled code, and the memory that they carry from state to state.

In each state `partials.py` differences what a parameter leaves unbalanced at the held shape, `response.py` solves for
the answer of the shape, and `Memory` hands the derivatives of slips and sliders on to the next state.  See
`sensitivity.py` for the method and `response.py` for the rows of the arrays.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.derivatives.feedback import Sweep, sweep
from prb3r.mechanics.derivatives.loops import Sliders, drag_sliders, recall_sliders
from prb3r.mechanics.derivatives.partials import HeldState, difference, hand_back, place_chain, put_loads, put_state
from prb3r.mechanics.derivatives.relaxing import Relaxed, copy_relaxed, feel_relaxed, recall_relaxed, relax_on
from prb3r.mechanics.derivatives.response import Room, respond, unbalance
from prb3r.mechanics.elimination import solve_block
from prb3r.mechanics.kernel import entrance, kernel
from prb3r.mechanics.tangent import chain_tangent
from prb3r.mechanics.variation import Scratch


@bundle
class Memory(NamedTuple):
    """What the next state depends on: slips and sliders of the last accepted state, relaxed moments of the last solved
    step, and their derivatives by `p` parameters."""

    slip: np.ndarray
    """(n, m) slip at the holes."""
    dslip: np.ndarray
    """(n, m, p) derivatives of the slips."""
    dbeyond: np.ndarray
    """(n, m, p) derivatives of the cable lengths beyond the holes, m per unit."""
    sliders: Sliders
    """Sliders of the plates with their derivatives."""
    relaxed: Relaxed
    """Relaxed moments of the plates with their derivatives."""


@bundle
class DerivativeSpace(NamedTuple):
    """Working space of :func:`differentiate`."""

    state: HeldState
    memory: Memory
    """Memory of the last accepted state."""
    at_rest: Memory
    """Memory of the state at rest, with which every sequence begins."""
    room: Room
    sweep: Sweep
    work: Scratch
    """For the tangent of tied node angles."""
    tied: np.ndarray
    """(c, c + p) linear system in `c` modes."""
    out: np.ndarray
    """(s, n, rows, p) derivatives at the end of each load step: the result."""


@kernel
def recall(packed, sides, memory, partial):
    """Write the derivatives of every hole's slip at the held shape to the slip rows of `partial`: from memory and the
    length beyond the hole if it sticks, zero if it slips."""
    n, m, presliding = packed.plate[0].q.shape[0], len(packed.cable), packed.model[0].presliding
    model = sides.packed.model
    for d in range(len(sides.apart)):
        longer = (model[2 * d, 0].presliding - model[2 * d + 1, 0].presliding) / sides.apart[d]
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
    """Copy the slips of the state just differentiated, and the derivatives of slips and lengths, to `memory`."""
    n, m = packed.plate[0].q.shape[0], len(packed.cable)
    for i in range(len(packed.span)):
        for j in range(m):
            memory.slip[i, j] = packed.span[i, j].new_slip
            for d in range(partial.shape[2]):
                memory.dbeyond[i, j, d] = partial[i, n + 3 + m + j, d]
                memory.dslip[i, j, d] = partial[i, n + 3 + 2 * m + j, d]


@kernel
def copy_memory(source, into):
    """Copy all arrays of the memory `source` `into` another one of the same shapes."""
    for i in range(len(into.slip)):
        for j in range(into.slip.shape[1]):
            into.slip[i, j] = source.slip[i, j]
            for d in range(into.dslip.shape[2]):
                into.dslip[i, j, d], into.dbeyond[i, j, d] = source.dslip[i, j, d], source.dbeyond[i, j, d]
    at, change = into.sliders.at, into.sliders.change
    for i in range(len(at)):
        for k in range(at.shape[1]):
            for e in range(at.shape[2]):
                at[i, k, e] = source.sliders.at[i, k, e]
                for d in range(change.shape[3]):
                    change[i, k, e, d] = source.sliders.change[i, k, e, d]
    copy_relaxed(source.relaxed, into.relaxed)


@kernel
def tie(packed, now, modes, work, system, partial):
    """Replace the residuals' derivatives in `partial` by those of the node angles, which `modes` tie together.

    `system` is working space.
    """
    chain_tangent(packed, now.tension, now.slip, now.force, now.tip, modes, work)
    plates, n, columns = modes.shape
    p = partial.shape[2]
    for c in range(columns):
        for d in range(columns):
            system[c, d] = work.system[c, d]
        for d in range(p):
            system[c, columns + d] = 0.0
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


@entrance
def differentiate(packed, held, sides, steps, modes, space):
    """Differentiate all states of `steps` by the parameters of `sides`; write the ends of load steps to `space.out`.

    Parameters
    ----------
    packed : records of the chain.
    held : records of the same chain, with its shape held.
    modes : (n, nodes, c) modes that tie node angles together; None: the angles are free.
    """
    state, out = space.state, space.out
    now, handed, partial, left, outer = state.now, state.handed, state.partial, state.left, state.outer
    history, slides, tied = packed.model[0].presliding != 0.0, packed.model[0].elements > 0, modes is not None
    relaxes = packed.model[0].relaxation != 0.0
    remembers = history or slides or relaxes
    for e in range(len(steps.row)):
        if remembers and steps.fresh[e]:
            copy_memory(space.at_rest, space.memory)
        if relaxes:
            recall_relaxed(packed, held, sides, space.memory.relaxed)
        put_loads(state.rows[steps.last[e]], state.rows[steps.row[e]], steps, e, now)
        put_state(held, steps, e, now, None)
        place_chain(held)
        hand_back(held, now, handed, outer)
        if modes is None:
            difference(held, sides, steps, e, state, None)
        else:
            difference(held, sides, steps, e, state, held.plate)
        for j in range(len(now.tension)):
            now.tension[j] = max(now.tension[j], 0.0)
        put_state(packed, steps, e, now, None)
        if relaxes:
            feel_relaxed(packed, space.memory.relaxed, partial)
        if slides:
            recall_sliders(packed, sides, space.memory.sliders, tied, partial)
        if modes is not None:
            tie(packed, now, modes, space.work, space.tied, partial)
        if history:
            place_chain(packed)
            unbalance(packed, now, handed, outer, sides.out[0])
            recall(packed, sides, space.memory, partial)
            sweep(packed, now, partial, left, space.room.gain, space.sweep)
        respond(packed, now, handed, partial, left, tied, space.room)
        if history:
            remember(packed, partial, space.memory)
        if slides:
            drag_sliders(packed, sides, space.memory.sliders, tied, partial)
        if relaxes and steps.write[e] >= 0:
            relax_on(packed, sides, space.memory.relaxed, partial)
        if remembers and steps.row[e] == 0:
            copy_memory(space.memory, space.at_rest)
        if steps.write[e] >= 0:
            for i in range(partial.shape[0]):
                for r in range(partial.shape[1]):
                    for d in range(partial.shape[2]):
                        out[steps.write[e], i, r, d] = partial[i, r, d]
