r"""First-order response of a chain in equilibrium to parameters of the chain or its loads (implicit differentiation).

With `q` the node angles, `W` the moment of the dead loads about the world origin (see `newton.py`) and `p` a parameter,
the equilibrium ``r(q, W, p) = 0`` and its closure ``c(q, W, p) = 0`` at the tip give

    [ dr/dq  dr/dW ] [ q' ]     [ dr/dp ]
    [ dc/dq  dc/dW ] [ W' ] = - [ dc/dp ]

The right side is differenced from what :func:`unbalance` finds with the parameter changed but the shape, `W` and the
slip held; the system is solved from base to tip like a Newton step, for all parameters at once.  What is observed, such
as positions, changes by its own derivative at the held shape plus that through the shape.

Rows of a plate in the arrays here, for `n` nodes and `m` cables: `n` residuals or node angles; the distal disk's
centre x, y and angle; `m` tensions over the plate; then, where slip follows the travel, `m` cable lengths beyond the
proximal disk and `m` slips at its holes.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.balance import balance_plate
from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.elimination import solve_block
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import at_base, depart, next_frame
from prb3r.mechanics.records import Packed
from prb3r.mechanics.variation import Variation, clear, enter, feel, local_load, shed, transmit, unload


@bundle
class Room(NamedTuple):
    """Working space of :func:`respond` for `p` parameters.

    There are `c` columns: one for `W` if dead loads act on free node angles, then one for each parameter.
    """

    change: Variation
    """Variation with `c` columns."""
    outer: np.ndarray
    """(3,) force and moment (about the world origin) of the dead loads further out, N and N m."""
    block: np.ndarray
    """(n, n + c) linear system of one plate."""
    column: np.ndarray
    """(n, c) response of the node angles of one plate."""
    answer: np.ndarray
    """(plates, rows, c) response of all rows through the shape."""
    arriving: np.ndarray
    """(y, p) variation that a plate is handed from the base side; see `feedback.py`."""
    gain: np.ndarray
    """(plates, n + m + 1, y + p) linear response of each plate to that, by `sweep`; (0, ...) where slip is declared."""


def no_variation(cables: int, columns: int) -> Variation:
    """A `Variation`, all zero, for so many cables with so many columns."""
    arrays = [np.zeros((cables, columns)) for _ in range(4)]
    return Variation(arrays[0], arrays[1], np.zeros((3, columns)), np.zeros(columns), arrays[2], arrays[3])


def room(packed: Packed, dead: int, parameters: int, history: bool) -> Room:
    """Working space of :func:`respond`.

    Parameters
    ----------
    dead : 1 if dead loads act and node angles are free, else 0.
    history : whether slip follows the cables' travel.
    """
    (plates, cables), n = packed.span.shape, packed.plate["q"].shape[1]
    c, arriving = dead * (not history) + parameters, 2 * cables + 3
    return Room(
        change=no_variation(cables, c),
        outer=np.zeros(3),
        block=np.zeros((n, n + c)),
        column=np.zeros((n, c)),
        answer=np.zeros((plates, n + 3 + (3 if history else 1) * cables, c)),
        arriving=np.zeros((arriving, parameters)),
        gain=np.zeros((plates * history, n + cables + 1, arriving + parameters)),
    )


@kernel
def begin(packed, now, handed, outer):
    """Set what the first plate is handed: the sum of the dead loads in `outer`, and the cables before the base disk."""
    outer[0] = outer[1] = outer[2] = 0.0
    if len(handed) > 0:
        outer[0], outer[1], outer[2] = now.tip[0], now.tip[1], handed[0]
        for i in range(len(packed.span)):
            outer[0] += now.force[i, 0]
            outer[1] += now.force[i, 1]
    if packed.model[0].presliding != 0.0:
        for j in range(len(packed.cable)):
            now.slip[j] = packed.span[0, j].new_slip
    at_base(now.tension, now.slip, packed.cable)


@kernel
def arrive(model, plate, span, cable, outer, loaded):
    """Write the dead loads further out to the plate if `loaded`, and to the cables the slip of its proximal holes."""
    plate.load[0] = plate.load[1] = plate.load[2] = 0.0
    if loaded:
        local_load(plate, outer)
    if model.presliding != 0.0:
        for j in range(len(cable)):
            cable[j].slip = span[j].new_slip


@kernel
def unbalance(packed, now, handed, outer, out):
    """Evaluate a chain whose plates are placed: write its rows, those of the slips excepted, to `out` (plates, rows).

    Returns the moment of the dead loads left at the tip, N m.  `now` holds the loads, `handed` their moment about the
    world origin; `outer` is working space.
    """
    model, cable, n, m = packed.model[0], packed.cable, packed.plate[0].q.shape[0], len(packed.cable)
    begin(packed, now, handed, outer)
    half, loaded, plates, lengths = model.disk / 2, len(handed) > 0, len(packed.span), model.presliding != 0.0
    for i in range(plates):
        plate, after, span = packed.plate[i], packed.plate[i + 1], packed.span[i]
        if lengths:
            for j in range(m):
                out[i, n + 3 + m + j] = -cable[j].passed
        arrive(model, plate, span, cable, outer, loaded)
        balance_plate(model, plate, span, cable)
        depart(plate, span, cable)
        if loaded:
            unload(packed, i, now.force, now.tip, outer)
        for k in range(n):
            out[i, k] = plate.residual[k]
        out[i, n] = after.frame[0] - half * after.frame[3]
        out[i, n + 1] = after.frame[1] - half * after.frame[4]
        out[i, n + 2] = after.frame[2]
        for j in range(m):
            out[i, n + 3 + j] = span[j].tension
    if lengths:
        for i in range(plates):
            for j in range(m):
                out[i, n + 3 + m + j] += cable[j].passed
    return outer[2]


@kernel
def respond(packed, now, handed, partial, left, known, room):
    """Turn `partial` (plates, rows, p) from derivatives at the held shape into total ones, with the shape's response.

    The first n rows of a plate hold the derivatives of the residuals before and those of the node angles afterwards; if
    the latter are `known` they stand there already.  The rows of the slips hold what memory adds to them.  `left` (p,)
    is the derivative of the moment left at the tip.
    """
    model, cable, change, answer = packed.model[0], packed.cable, room.change, room.answer
    block, column, outer, n, m = room.block, room.column, room.outer, packed.plate[0].q.shape[0], len(packed.cable)
    p, columns, loaded, history = partial.shape[2], answer.shape[2], len(handed) > 0, len(room.gain) > 0
    g, plates = columns - p, len(packed.span)
    begin(packed, now, handed, outer)
    clear(change)
    for d in range(g):
        change.moment[d] = 1.0
    half = model.disk / 2
    for i in range(plates):
        plate, after, span = packed.plate[i], packed.plate[i + 1], packed.span[i]
        frame = after.frame
        arrive(model, plate, span, cable, outer, loaded)
        balance_plate(model, plate, span, cable)
        if history:
            follow_gain(change, room.gain[i], room.arriving, column, answer[i])
            for j in range(m):
                follows = 1.0 / model.presliding if span[j].sticks else 0.0
                weight = span[j].wrap / span[j].passes - (cable[j].pulley if i == 0 else 0.0)
                for d in range(p):
                    slip = follows * answer[i, n + 3 + m + j, d]
                    answer[i, n + 3 + 2 * m + j, d] = slip
                    change.log_tension[j, d] += weight * (slip + partial[i, n + 3 + 2 * m + j, d])
        enter(cable, span, change)
        if known:
            for k in range(n):
                for d in range(p):
                    column[k, g + d] = partial[i, k, d]
        elif not history:
            feel(plate, span, outer, change, block, n)
            for k in range(n):
                for r in range(n):
                    block[k, r] = plate.tangent[k, r]
                for d in range(p):
                    block[k, n + g + d] += partial[i, k, d]
            solve_block(block, n, n + columns)
            for k in range(n):
                for d in range(columns):
                    column[k, d] = -block[k, n + d]
        transmit(model, plate, span, column, change)
        depart(plate, span, cable)
        next_frame(model, plate, after)
        if loaded:
            shed(packed, i, now.force, now.tip, outer, change)
        for d in range(columns):
            turned = half * change.frame[2, d]
            answer[i, n, d] = change.frame[0, d] + frame[4] * turned
            answer[i, n + 1, d] = change.frame[1, d] - frame[3] * turned
            answer[i, n + 2, d] = change.frame[2, d]
        for k in range(n):
            for d in range(columns):
                answer[i, k, d] = column[k, d]
        for j in range(m):
            for d in range(columns):
                answer[i, n + 3 + j, d] = span[j].tension * change.log_tension[j, d]
    for i in range(partial.shape[0]):  # residuals give way to node angles
        for k in range(partial.shape[1]):
            for d in range(p):
                total = answer[i, k, g + d]
                if g > 0:
                    total -= answer[i, k, 0] * (change.moment[1 + d] + left[d]) / change.moment[0]
                partial[i, k, d] = total + (partial[i, k, d] if k >= n else 0.0)


@kernel
def follow_gain(change, gain, arriving, column, answer):
    """Write the response of a plate's node angles to `column` and that of its cable lengths to `answer`, by its `gain`
    from the variation `change` that it is handed; see `feedback.py`."""
    n, m, y, p = len(column), len(change.log_tension), len(arriving), column.shape[1]
    for d in range(p):
        for j in range(m):
            arriving[j, d], arriving[m + j, d] = change.log_tension[j, d], change.approach[j, d]
        for k in range(3):
            arriving[2 * m + k, d] = change.frame[k, d]
    for r in range(n + m):
        for d in range(p):
            total = gain[r, y + d]
            for k in range(y):
                total += gain[r, k] * arriving[k, d]
            if r < n:
                column[r, d] = total
            else:
                answer[r + 3 + m, d] = total
