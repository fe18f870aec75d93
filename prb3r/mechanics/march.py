r"""Equilibrium of the whole chain, solved from base to tip.

Without dead loads each plate is one small problem whose data are known when its turn comes: a march.  Dead loads
couple base-ward through one scalar, their total moment `W` about the world origin, so a full Newton step on all
angles is still one march: every plate's correction is found as ``dq = dq_0 + dq_1 dW``, and `dW` closes at the tip,
where no moment may remain.  Both cost O(plates).
"""

from math import cos, sin
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.balance import balance_plate
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.records import Packed

TOLERANCE = 1e-11
"""Largest unbalanced node angle of a solved plate, rad."""
MAX_ITERATIONS = 30
MAX_STEP = 0.5
"""Longest Newton step of a node angle, rad."""
FAILED = -1


class Drift(NamedTuple):
    """Derivatives of what a plate is handed from the base side, in `c` columns (one per independent variable)."""

    log_tension: np.ndarray
    """(m, c)."""
    approach: np.ndarray
    """(m, c)."""
    frame: np.ndarray
    """(3, c) position and angle of the disk's distal face."""
    moment: np.ndarray
    """(c,) moment of the dead loads further out about the world origin."""


class Scratch(NamedTuple):
    """Working space of the march for one chain."""

    drift: Drift
    moment: np.ndarray
    """(c,) derivatives of the total moment of the dead loads."""
    outer: np.ndarray
    """(3,) force and moment (about the world origin) of the dead loads further out, N and N m."""
    block: np.ndarray
    """(n, n + columns) a plate's linear system."""
    system: np.ndarray
    """(c, c + 1) linear system in the independent variables."""
    column: np.ndarray
    """(plates, n, columns) corrections of all node angles."""


def scratch(packed: Packed, columns: int = 2) -> Scratch:
    """Working space for `columns` independent variables beside the node angles of one plate."""
    (plates, cables), n = packed.span.shape, packed.plate["q"].shape[1]
    change = Drift(np.zeros((cables, columns)), np.zeros((cables, columns)), np.zeros((3, columns)), np.zeros(columns))
    return Scratch(
        drift=change,
        moment=np.zeros(columns),
        outer=np.zeros(3),
        block=np.zeros((n, n + columns)),
        system=np.zeros((columns, columns + 1)),
        column=np.zeros((plates, n, columns)),
    )


@kernel
def solve_block(block, n, columns):
    """Gauss elimination with pivoting of ``[A | B]`` in place: the columns `n` to `columns` become ``A^-1 B``."""
    for k in range(n):
        pivot = k
        for r in range(k + 1, n):
            if abs(block[r, k]) > abs(block[pivot, k]):
                pivot = r
        if pivot != k:
            for c in range(k, columns):
                block[k, c], block[pivot, c] = block[pivot, c], block[k, c]
        inverse = 1.0 / block[k, k]
        for r in range(k + 1, n):
            factor = block[r, k] * inverse
            for c in range(k + 1, columns):
                block[r, c] -= factor * block[k, c]
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / block[k, k]
        for c in range(n, columns):
            value = block[k, c]
            for r in range(k + 1, n):
                value -= block[k, r] * block[r, c]
            block[k, c] = value * inverse


@kernel
def at_base(tension, slip, cable):
    """Cables as they enter the base disk: along its axis, under the applied tension."""
    for j in range(len(cable)):
        cable[j].tension, cable[j].approach, cable[j].slip = tension[j], 0.0, slip[j]


@kernel
def local_load(plate, outer):
    """Write force and moment of the loads further out, `outer` in the world, in the frame of the plate."""
    c, s = plate.frame[3], plate.frame[4]
    plate.load[0], plate.load[1] = c * outer[0] + s * outer[1], c * outer[1] - s * outer[0]
    plate.load[2] = outer[2] - (plate.frame[0] * outer[1] - plate.frame[1] * outer[0])


@kernel
def next_frame(model, plate, after):
    """Position and angle of the distal disk's distal face, from those of the proximal one."""
    c, s = plate.frame[3], plate.frame[4]
    x = plate.end[0] + model.disk * plate.axis[0]
    y = plate.end[1] + model.disk * plate.axis[1]
    after.frame[0] = plate.frame[0] + c * x - s * y
    after.frame[1] = plate.frame[1] + s * x + c * y
    angle = plate.frame[2] + plate.bend
    after.frame[2], after.frame[3], after.frame[4] = angle, cos(angle), sin(angle)


@kernel
def depart(plate, span, cable):
    """Cables as they arrive at the distal disk."""
    for j in range(len(cable)):
        cable[j].tension = span[j].tension
        cable[j].approach = span[j].direction - plate.bend


@kernel
def march(packed, tension, slip, work):
    """Solve plate after plate without dead loads, starting from the present node angles.

    Returns the largest number of Newton steps a plate took, or `FAILED`.
    """
    model, plates, spans, cable, block = packed.model[0], packed.plate, packed.span, packed.cable, work.block
    n = block.shape[0]
    at_base(tension, slip, cable)
    most = 0
    for i in range(len(spans)):
        plate, after, span = plates[i], plates[i + 1], spans[i]
        plate.load[0], plate.load[1], plate.load[2] = 0.0, 0.0, 0.0
        steps = FAILED
        for step in range(MAX_ITERATIONS):
            if balance_plate(model, plate, span, cable) <= TOLERANCE:
                steps = step
                break
            for k in range(n):
                for p in range(n):
                    block[k, p] = plate.tangent[k, p]
                block[k, n] = -plate.residual[k]
            solve_block(block, n, n + 1)
            for k in range(n):
                change = min(max(block[k, n], -MAX_STEP), MAX_STEP)
                plate.q[k] += change
                after.q[k] += change  # the next plate will change much alike
        if steps == FAILED:
            return FAILED
        most = max(most, steps)
        depart(plate, span, cable)
        next_frame(model, plate, after)
    return most


@kernel
def feel(plate, span, outer, change, out):
    """Derivatives of a plate's residual by what it is handed: `out` (n, c), for the drift `change`."""
    n, columns = out.shape
    for d in range(columns):
        turned = change.frame[2, d]
        fx, fy = turned * plate.load[1], -turned * plate.load[0]  # the force turns back as the frame turns
        moment = change.moment[d] - (change.frame[0, d] * outer[1] - change.frame[1, d] * outer[0])
        for j in range(len(span)):
            if span[j].tension != 0.0:
                relative = change.log_tension[j, d] - span[j].rate * change.approach[j, d]
                fx += relative * span[j].wrench[0]
                fy += relative * span[j].wrench[1]
                moment += relative * span[j].wrench[2]
        for k in range(n):
            out[k, d] = plate.node[0, k] * fy - plate.node[1, k] * fx - moment


@kernel
def transmit(model, plate, span, dq, change):
    """Carry the drift over a plate whose node angles change by `dq` (n, c)."""
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
            if span[j].tension != 0.0:
                direction = 0.0
                for k in range(n):
                    direction += span[j].ddirection[k] * dq[k, d]
                change.log_tension[j, d] += span[j].rate * (direction - change.approach[j, d])
                change.approach[j, d] = direction - bend


@kernel
def shed(model, frame, fx, fy, gx, gy, sum, change):
    """Take the loads of one disk, `f` at its centre and `g` at its distal face, off `sum` (force x, y, moment)."""
    c, s = frame[3], frame[4]
    half = model.disk / 2
    x, y = frame[0] - half * c, frame[1] - half * s
    sum[0] -= fx + gx
    sum[1] -= fy + gy
    sum[2] -= (x * fy - y * fx) + (frame[0] * gy - frame[1] * gx)
    for d in range(len(change.moment)):
        turned = change.frame[2, d]
        dx, dy = change.frame[0, d] + half * s * turned, change.frame[1, d] - half * c * turned
        change.moment[d] -= (dx * fy - dy * fx) + (change.frame[0, d] * gy - change.frame[1, d] * gx)


@kernel
def clear(change):
    change.log_tension[:] = 0.0
    change.approach[:] = 0.0
    change.frame[:] = 0.0
    change.moment[:] = 0.0


@kernel
def newton_march(packed, tension, slip, force, tip, moment, work):
    """One evaluation of the whole chain under dead loads, and the full Newton step from there.

    `force` (plates, 2) and `tip` (2,) act on the disks; `moment` is the guess of their total moment about the world
    origin.  Leaves ``dq_0, dq_1`` in `work.column`; returns the largest unbalanced node angle, the moment left over
    beyond the tip, and the correction of `moment`.
    """
    model, cable, outer, drift, block = packed.model[0], packed.cable, work.outer, work.drift, work.block
    plates, n = len(packed.span), block.shape[0]
    outer[0], outer[1], outer[2] = tip[0], tip[1], moment
    for i in range(plates):
        outer[0] += force[i, 0]
        outer[1] += force[i, 1]
    at_base(tension, slip, cable)
    clear(drift)
    drift.moment[1] = 1.0
    largest = 0.0
    for i in range(plates):
        plate, after, span, column = packed.plate[i], packed.plate[i + 1], packed.span[i], work.column[i]
        local_load(plate, outer)
        error = balance_plate(model, plate, span, cable)
        if not error <= largest:
            largest = error
        feel(plate, span, outer, drift, block[:, n:])
        for k in range(n):
            for p in range(n):
                block[k, p] = plate.tangent[k, p]
            block[k, n] += plate.residual[k]
        solve_block(block, n, n + 2)
        for k in range(n):
            column[k, 0], column[k, 1] = -block[k, n], -block[k, n + 1]
        transmit(model, plate, span, column, drift)
        depart(plate, span, cable)
        next_frame(model, plate, after)
        at_tip = 1.0 if i + 1 == plates else 0.0
        shed(model, after.frame, force[i, 0], force[i, 1], at_tip * tip[0], at_tip * tip[1], outer, drift)
    return largest, outer[2], -(outer[2] + drift.moment[0]) / drift.moment[1]


@kernel
def balance_loads(packed, tension, slip, force, tip, moment, work):
    """Newton on all angles and on the moment of the dead loads, from where they are.

    Returns the steps taken (or `FAILED`) and the moment.
    """
    plates, column = packed.plate, work.column
    n = column.shape[1]
    stiffest = 0.0
    for i in range(len(column)):
        for k in range(n):
            stiffest = max(stiffest, plates[i].stiffness[k])
    for step in range(MAX_ITERATIONS):
        largest, left, correction = newton_march(packed, tension, slip, force, tip, moment, work)
        if largest <= TOLERANCE and abs(left) <= TOLERANCE * stiffest + 1e-13 * abs(moment):
            return step, moment
        longest = 0.0
        for i in range(len(column)):
            for k in range(n):
                column[i, k, 0] += column[i, k, 1] * correction
                if not abs(column[i, k, 0]) <= longest:
                    longest = abs(column[i, k, 0])
        if not longest < 1e6:
            return FAILED, moment
        damping = 1.0 if longest <= MAX_STEP else MAX_STEP / longest
        moment += damping * correction
        for i in range(len(column)):
            for k in range(n):
                plates[i].q[k] += damping * column[i, k, 0]
    return FAILED, moment
