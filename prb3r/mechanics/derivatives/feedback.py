r"""First-order response of a chain whose holes stick, by a sweep from the tip back to the base (a Riccati sweep).

Where friction follows the cables' travel, a cable's length beyond a hole acts on its tension there, and tension acts
on everything nearer to the tip.  In a march from base to tip this feedback grows from plate to plate, tenfold where the
presliding length is short, and rounding errors with it; in a sweep from the tip it does not.  All that lies beyond a
plate responds to what is handed to it, the variation `y` of tensions, directions and frame, by

    z = R y + s,     z: cable lengths and moment of the dead loads beyond

so that each plate, with its node angles and its own `z` as unknowns, is one small linear system.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.derivatives.response import no_variation
from prb3r.mechanics.elimination import solve_block
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.records import Packed
from prb3r.mechanics.variation import Variation, clear, enter, feel, shed, transmit


@bundle
class Sweep(NamedTuple):
    """Working space of :func:`sweep` for `p` parameters and plates of `n` nodes with `m` cables.

    Columns: ``u = n + m + 1`` unknowns (node angles, cable lengths and moment beyond), then ``y = 2 m + 3`` variations
    handed in (log tensions, directions, frame), then the parameters.
    """

    change: Variation
    """Variation with u + y + p columns."""
    column: np.ndarray
    """(n, u + y + p) node angles."""
    felt: np.ndarray
    """(n, u + y + p) residuals."""
    block: np.ndarray
    """(u, u + y + p) linear system of one plate."""
    beyond: np.ndarray
    """(m + 1, y + p) `R` and `s` of all that lies beyond the plate."""
    outer: np.ndarray
    """(3,) force of the dead loads beyond the plate, N; the third number is not used."""
    none: np.ndarray
    """(3,) sum of dead loads that `shed` needs; not used."""


def sweep_room(packed: Packed, parameters: int) -> Sweep:
    """Working space of :func:`sweep` for the chain of `packed`, all zero."""
    cables, n = packed.span.shape[1], packed.plate["q"].shape[1]
    u, y = n + cables + 1, 2 * cables + 3
    return Sweep(
        change=no_variation(cables, u + y + parameters),
        column=np.zeros((n, u + y + parameters)),
        felt=np.zeros((n, u + y + parameters)),
        block=np.zeros((u, u + y + parameters)),
        beyond=np.zeros((cables + 1, y + parameters)),
        outer=np.zeros(3),
        none=np.zeros(3),
    )


@kernel
def hand_in(packed, i, partial, room):
    """Set the variations of plate `i` to a unit of each unknown and of each quantity handed in; in the columns of the
    parameters, to what memory adds to the log tensions through the slips."""
    change, column, n, m = room.change, room.column, packed.plate[0].q.shape[0], len(packed.cable)
    u, y = n + m + 1, 2 * m + 3
    clear(change)
    for k in range(n):
        for d in range(column.shape[1]):
            column[k, d] = 1.0 if d == k else 0.0
    change.moment[n + m] = 1.0
    for k in range(3):
        change.frame[k, u + 2 * m + k] = 1.0
    for j in range(m):
        hole = packed.span[i, j]
        weight = hole.wrap / hole.passes - (packed.cable[j].pulley if i == 0 else 0.0)  # before the hole
        change.log_tension[j, u + j] = 1.0
        change.approach[j, u + m + j] = 1.0
        if hole.sticks:
            change.log_tension[j, n + j] = weight / packed.model[0].presliding
        for d in range(partial.shape[2]):
            change.log_tension[j, u + y + d] = weight * partial[i, n + 3 + 2 * m + j, d]


@kernel
def sweep(packed, now, partial, left, gain, room):
    """Write the linear response of every plate's unknowns to what it is handed and to the parameters to `gain`
    (plates, u, y + p).

    `packed` is in balance, and its records hold tangents and derivatives.  `partial` and `left` are those of `respond`.
    """
    model, change, block, beyond, felt = packed.model[0], room.change, room.block, room.beyond, room.felt
    n, m, p, outer, none = packed.plate[0].q.shape[0], len(packed.cable), partial.shape[2], room.outer, room.none
    u, y = n + m + 1, 2 * m + 3
    for k in range(3):
        outer[k] = none[k] = 0.0
    for r in range(m + 1):
        for d in range(y + p):
            beyond[r, d] = 0.0
    for d in range(p):
        beyond[m, y + d] = -left[d]
    for i in range(len(packed.span) - 1, -1, -1):
        plate, span = packed.plate[i], packed.span[i]
        tip = 1.0 if i + 1 == len(packed.span) else 0.0
        outer[0] += now.force[i, 0] + tip * now.tip[0]
        outer[1] += now.force[i, 1] + tip * now.tip[1]
        hand_in(packed, i, partial, room)
        enter(packed.cable, span, change)
        feel(plate, span, outer, change, felt, 0)
        transmit(model, plate, span, room.column, change)
        shed(packed, i, now.force, now.tip, none, change)
        for d in range(u + y + p):
            for k in range(n):
                block[k, d] = felt[k, d] + (plate.tangent[k, d] if d < n else 0.0)
                if d >= u + y:
                    block[k, d] += partial[i, k, d - u - y]
            for r in range(m + 1):  # length less the span's, moment less the disk's, are those beyond the next plate
                value = change.moment[d] if r == m else -change.passed[r, d]
                if r < m and d == n + r:
                    value += 1.0
                for j in range(m):
                    value -= beyond[r, j] * change.log_tension[j, d] + beyond[r, m + j] * change.approach[j, d]
                for k in range(3):
                    value -= beyond[r, 2 * m + k] * change.frame[k, d]
                if d >= u + y:
                    value -= beyond[r, d - u]
                block[n + r, d] = value
        solve_block(block, u, u + y + p)
        for r in range(u):
            for d in range(y + p):
                gain[i, r, d] = -block[r, u + d]
        for r in range(m + 1):
            for d in range(y + p):
                beyond[r, d] = -block[n + r, u + d]
