"""Derivatives carried along the chain from base to tip, of what each plate is handed from the base side: tensions and
directions of the cables, frame, lengths, and the moment of the dead loads further out.

`enter`, `feel`, `transmit` and `shed` carry them over one plate, in this order; `clear` starts them.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.records import Packed


@bundle
class Variation(NamedTuple):
    """Derivatives of what a plate is handed from the base side, in `c` columns, one per independent variable.

    In Newton's method the first column is not a derivative but the change that the residuals ask for.
    """

    log_tension: np.ndarray
    """(m, c) logarithm of each cable's tension."""
    approach: np.ndarray
    """(m, c) direction of each cable before the disk, relative to the disk's axis."""
    frame: np.ndarray
    """(3, c) position and angle of the disk's distal face in the world."""
    moment: np.ndarray
    """(c,) moment of the dead loads further out about the world origin."""
    passed: np.ndarray
    """(m, c) length of the spans passed so far."""
    total: np.ndarray
    """(m, c) length of all spans of a cable."""


@bundle
class Scratch(NamedTuple):
    """Working space of the march for one chain."""

    variation: Variation
    handed: np.ndarray
    """(1 + m,) guesses: moment of the dead loads about the world origin (N m) and length of each cable (m)."""
    outer: np.ndarray
    """(3,) force and moment (about the world origin) of the dead loads further out, N and N m."""
    block: np.ndarray
    """(n, n + columns) linear system of one plate of n nodes."""
    system: np.ndarray
    """(columns, columns + 1) linear system in the independent variables."""
    column: np.ndarray
    """(plates, n, columns) corrections of all node angles, rad."""
    sign: np.ndarray
    """(1,) sign of the determinant of the whole tangent, up to a sign that all states share."""
    foreseen: np.ndarray
    """(plates,) angle of every disk after the first Newton step of a solve, rad."""
    spent: np.ndarray
    """(1,) work done since the sequence began, in evaluations of a plate."""
    ahead: np.ndarray
    """(5, n) extrapolation of the changes of node angles from plate to plate (`foretell`), and a Newton step, rad."""
    unbalanced: np.ndarray
    """(1,) largest unbalanced moment of a mode in the present state of tied node angles, N m."""


def scratch(packed: Packed, columns: int = 2) -> Scratch:
    """Working space for `columns` independent variables beside the node angles of one plate."""
    (plates, cables), n = packed.span.shape, packed.plate["q"].shape[1]
    of_cables = np.zeros((cables, columns))
    change = Variation(
        of_cables, of_cables.copy(), np.zeros((3, columns)), np.zeros(columns), of_cables.copy(), of_cables.copy()
    )
    return Scratch(
        variation=change,
        handed=np.zeros(1 + cables),
        outer=np.zeros(3),
        block=np.zeros((n, n + columns)),
        system=np.zeros((columns, columns + 1)),
        column=np.zeros((plates, n, columns)),
        sign=np.ones(1),
        foreseen=np.zeros(plates),
        spent=np.zeros(1, np.int64),
        ahead=np.zeros((5, n)),
        unbalanced=np.zeros(1),
    )


@kernel
def local_load(plate, outer):
    """Write the force and moment `outer` of the dead loads further out to `plate.load`, in the frame of the plate."""
    c, s = plate.frame[3], plate.frame[4]
    plate.load[0], plate.load[1] = c * outer[0] + s * outer[1], c * outer[1] - s * outer[0]
    plate.load[2] = outer[2] - (plate.frame[0] * outer[1] - plate.frame[1] * outer[0])


@kernel
def enter(cable, span, change):
    """Carry the variation of the cables' log tensions through the holes of a disk, friction and slip included."""
    for j in range(len(cable)):
        if span[j].tension != 0.0:
            for d in range(change.moment.shape[0]):
                slip = cable[j].follows * (change.total[j, d] - change.passed[j, d])
                if d == 0:
                    slip += cable[j].owed
                change.log_tension[j, d] = (
                    span[j].passes * change.log_tension[j, d]
                    + span[j].rate_in * change.approach[j, d]
                    + span[j].wrap * slip
                )


@kernel
def feel(plate, span, outer, change, out, first):
    """Write the variation of a plate's residual with `change`, what it is handed, to `out` from column `first` on."""
    n = out.shape[0]
    for d in range(len(change.moment)):
        turned = change.frame[2, d]
        fx, fy = turned * plate.load[1], -turned * plate.load[0]  # the force turns back as the frame turns
        moment = change.moment[d] - (change.frame[0, d] * outer[1] - change.frame[1, d] * outer[0])
        for j in range(len(span)):
            if span[j].tension != 0.0:
                fx += change.log_tension[j, d] * span[j].wrench[0]
                fy += change.log_tension[j, d] * span[j].wrench[1]
                moment += change.log_tension[j, d] * span[j].wrench[2]
        for k in range(n):
            out[k, first + d] = plate.node[0, k] * fy - plate.node[1, k] * fx - moment


@kernel
def transmit(model, plate, span, dq, change):
    """Carry the variation `change` over a plate whose node angles change by `dq` (n, c), to the next disk."""
    n, columns = dq.shape
    c, s = plate.frame[3], plate.frame[4]
    x = plate.end[0] + model.disk * plate.axis[0]
    y = plate.end[1] + model.disk * plate.axis[1]
    tx, ty = -model.disk * plate.axis[1], model.disk * plate.axis[0]
    for d in range(columns):
        bend, dx, dy = 0.0, 0.0, 0.0
        for k in range(n):
            bend += dq[k, d]
            dx += (plate.dend[0, k] + tx) * dq[k, d]
            dy += (plate.dend[1, k] + ty) * dq[k, d]
        turned = change.frame[2, d]
        dx, dy = dx - turned * y, dy + turned * x
        change.frame[0, d] += c * dx - s * dy
        change.frame[1, d] += s * dx + c * dy
        change.frame[2, d] += bend
        for j in range(len(span)):
            if span[j].tension != 0.0 or model.presliding != 0.0:
                direction, length = 0.0, 0.0
                for k in range(n):
                    direction += span[j].ddirection[k] * dq[k, d]
                    length += span[j].dlength[k] * dq[k, d]
                change.log_tension[j, d] += span[j].rate * direction
                change.approach[j, d] = direction - bend
                change.passed[j, d] += length


@kernel
def unload(packed, i, force, tip, sum):
    """Take the dead loads on the distal disk of plate `i` off `sum` (force x, y, moment about the world origin).

    `force` (n, 2) acts at the disks' centres, `tip` (2,) at the tip disk's distal face; an umbilical adds the couple by
    which it turns the tip disk back.
    """
    frame, half = packed.plate[i + 1].frame, packed.model[0].disk / 2
    at_tip = 1.0 if i + 1 == len(packed.span) else 0.0
    fx, fy, gx, gy = force[i, 0], force[i, 1], at_tip * tip[0], at_tip * tip[1]
    held = at_tip * packed.model[0].umbilical
    x, y = frame[0] - half * frame[3], frame[1] - half * frame[4]
    sum[0] -= fx + gx
    sum[1] -= fy + gy
    sum[2] -= (x * fy - y * fx) + (frame[0] * gy - frame[1] * gx) - held * frame[2]


@kernel
def shed(packed, i, force, tip, sum, change):
    """Take the dead loads on plate `i`'s distal disk off `sum`, as `unload` does, and their variation off `change`.

    The lines of `unload` are repeated here, as a call would make the solver a twentieth slower.
    """
    frame, half = packed.plate[i + 1].frame, packed.model[0].disk / 2
    at_tip = 1.0 if i + 1 == len(packed.span) else 0.0
    fx, fy, gx, gy = force[i, 0], force[i, 1], at_tip * tip[0], at_tip * tip[1]
    held = at_tip * packed.model[0].umbilical
    c, s = frame[3], frame[4]
    x, y = frame[0] - half * c, frame[1] - half * s
    sum[0] -= fx + gx
    sum[1] -= fy + gy
    sum[2] -= (x * fy - y * fx) + (frame[0] * gy - frame[1] * gx) - held * frame[2]
    for d in range(len(change.moment)):
        turned = change.frame[2, d]
        dx, dy = change.frame[0, d] + half * s * turned, change.frame[1, d] - half * c * turned
        couple = change.frame[0, d] * gy - change.frame[1, d] * gx - held * turned
        change.moment[d] -= (dx * fy - dy * fx) + couple


@kernel
def clear(change):
    """Set the variation to zero, except for that of the cables' total lengths."""
    for d in range(len(change.moment)):
        change.moment[d] = 0.0
        for k in range(3):
            change.frame[k, d] = 0.0
        for j in range(len(change.passed)):
            change.log_tension[j, d] = change.approach[j, d] = change.passed[j, d] = 0.0
