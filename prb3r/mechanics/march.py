r"""Equilibrium of the whole chain, solved from base to tip.

Without dead loads each plate is one small problem whose data are known when its turn comes: a march.  Dead loads
couple base-ward through one scalar, their total moment `W` about the world origin, so a full Newton step on all
angles is still one march: every plate's correction is found as ``dq = dq_0 + dq_1 dW``, and `dW` closes at the tip,
where no moment may remain.  Both cost O(plates).
"""

from math import cos, exp, sin
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.balance import balance_plate
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.records import Packed

TOLERANCE = 1e-11
"""Largest unbalanced node angle of a solved plate, rad."""
LENGTH_TOLERANCE = 1e-13
"""Largest error of a cable's length, of the length; small against every presliding length."""
SLIP_TOLERANCE = 1e-7
"""How far the slip must turn back before a hole that slips sticks again; far above rounding, far below any effect."""
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
    passed: np.ndarray
    """(m, c) length of the spans passed so far."""
    total: np.ndarray
    """(m, c) length of all spans of a cable."""


class Scratch(NamedTuple):
    """Working space of the march for one chain."""

    drift: Drift
    handed: np.ndarray
    """(1 + m,) what plates further out hand back: moment of the dead loads about the world origin, cable lengths."""
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
    each = np.zeros((cables, columns))
    change = Drift(each, each.copy(), np.zeros((3, columns)), np.zeros(columns), each.copy(), each.copy())
    return Scratch(
        drift=change,
        handed=np.zeros(1 + cables),
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
    """Cables as they enter the base disk: along its axis, under the applied tension less what a pulley takes."""
    for j in range(len(cable)):
        cable[j].tension, cable[j].approach, cable[j].slip = tension[j], 0.0, slip[j]
        cable[j].follows, cable[j].passed = 0.0, 0.0
        if cable[j].pulley != 0.0:
            cable[j].tension *= exp(-slip[j] * cable[j].pulley)


@kernel
def slip_at(model, span, cable):
    """Slip of every cable at the holes of the plate's proximal disk, and what their travel still asks of it.

    Slip is an unknown beside the travel: where a hole sticks, both are tied by the presliding length; where it slips,
    the slip is at its bound.  Solving for it instead of computing it from the travel keeps Newton's method from
    stumbling over presliding lengths that are small against the travel of a single step.
    """
    for j in range(len(cable)):
        hole = span[j]
        hole.new_beyond = cable[j].length - cable[j].passed
        cable[j].slip, cable[j].follows, cable[j].owed = hole.new_slip, 0.0, 0.0
        if hole.sticks:
            cable[j].follows = 1.0 / model.presliding
            cable[j].owed = hole.slip + (hole.new_beyond - hole.beyond) / model.presliding - hole.new_slip


@kernel
def slip_on(packed, work, damping):
    """Newton step of the slip at every hole, after that of the angles; whether a hole began or ceased to stick.

    Primal-dual active set: a hole whose slip would leave [-1, 1] slips, one that slips and whose travel turns back
    sticks again.
    """
    model, cable = packed.model[0], packed.cable
    count, changed = work.column.shape[2] - 1, False
    for j in range(len(cable)):
        passed = 0.0
        for i in range(len(packed.span)):
            hole = packed.span[i, j]
            if not hole.present:
                break
            travel = damping * (work.system[1 + j, count] - passed)
            asked = hole.slip + (hole.new_beyond + travel - hole.beyond) / model.presliding
            if hole.sticks:
                slip = asked if damping == 1.0 else hole.new_slip + damping * (asked - hole.new_slip)
                hole.new_slip = min(max(slip, -1.0), 1.0)
                hole.sticks = -1.0 < slip < 1.0
                changed = changed or not hole.sticks
            elif asked * hole.new_slip < 1.0 - SLIP_TOLERANCE:
                hole.sticks = True
                changed = True
            for k in range(work.column.shape[1]):
                passed += packed.span[i, j].dlength[k] * work.column[i, k, 0]
    return changed


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
        cable[j].passed += span[j].length


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
def enter(cable, span, change):
    """Turn the drift of cables that arrive at a disk into that of their tensions behind its holes, but for the plate."""
    for j in range(len(cable)):
        if span[j].tension != 0.0:
            for d in range(change.moment.shape[0]):
                slip = cable[j].follows * (change.total[j, d] - change.passed[j, d])
                if d == 0:
                    slip += cable[j].owed
                change.log_tension[j, d] += span[j].rate_in * change.approach[j, d] + span[j].wrap * slip


@kernel
def feel(plate, span, outer, change, out, first):
    """Derivatives of a plate's residual by what it is handed, for the drift `change`: columns of `out` from `first` on."""
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
            if span[j].tension != 0.0 or model.presliding != 0.0:
                direction, length = 0.0, 0.0
                for k in range(n):
                    direction += span[j].ddirection[k] * dq[k, d]
                    length += span[j].dlength[k] * dq[k, d]
                change.log_tension[j, d] += span[j].rate * direction
                change.approach[j, d] = direction - bend
                change.passed[j, d] += length


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
    """No drift, but for the total lengths of the cables."""
    for d in range(len(change.moment)):
        change.moment[d] = 0.0
        for k in range(3):
            change.frame[k, d] = 0.0
        for j in range(len(change.passed)):
            change.log_tension[j, d] = change.approach[j, d] = change.passed[j, d] = 0.0


@kernel
def newton_march(packed, tension, slip, force, tip, work):
    """One evaluation of the whole chain and the full Newton step from there.

    `force` (plates, 2) and `tip` (2,) act on the disks.  `work.handed` guesses what plates further out hand back: the
    moment of the dead loads about the world origin and, where friction follows the cables' travel, their lengths.
    Leaves the corrections of all node angles in `work.column` (first column) and of the guesses in the last column of
    `work.system`; returns the largest unbalanced node angle and the errors of the guesses (N m and m).
    """
    model, cable, outer, change, block = packed.model[0], packed.cable, work.outer, work.drift, work.block
    plates, n, columns = work.column.shape
    follows = model.presliding != 0.0
    outer[0], outer[1], outer[2] = tip[0], tip[1], work.handed[0]
    for i in range(plates):
        outer[0] += force[i, 0]
        outer[1] += force[i, 1]
    at_base(tension, slip, cable)
    clear(change)
    change.moment[1] = 1.0
    for j in range(len(cable)):
        for d in range(columns):
            change.total[j, d] = 0.0
    if follows:
        for j in range(len(cable)):
            cable[j].length = work.handed[1 + j]
            change.total[j, 2 + j] = 1.0
    largest = 0.0
    for i in range(plates):
        plate, after, span, column = packed.plate[i], packed.plate[i + 1], packed.span[i], work.column[i]
        local_load(plate, outer)
        if follows:
            slip_at(model, span, cable)
            if i == 0:
                pull_through_pulleys(tension, cable, change)
        error = balance_plate(model, plate, span, cable)
        if not error <= largest:
            largest = error
        enter(cable, span, change)
        feel(plate, span, outer, change, block, n)
        for k in range(n):
            for p in range(n):
                block[k, p] = plate.tangent[k, p]
            block[k, n] += plate.residual[k]
        solve_block(block, n, n + columns)
        for k in range(n):
            for d in range(columns):
                column[k, d] = -block[k, n + d]
        transmit(model, plate, span, column, change)
        depart(plate, span, cable)
        next_frame(model, plate, after)
        at_tip = 1.0 if i + 1 == plates else 0.0
        shed(model, after.frame, force[i, 0], force[i, 1], at_tip * tip[0], at_tip * tip[1], outer, change)
    return largest, outer[2], close_guesses(cable, change, outer[2], work)


@kernel
def pull_through_pulleys(tension, cable, change):
    """Tension behind the pulleys where the slip at the base follows the cable's travel."""
    for j in range(len(cable)):
        if cable[j].pulley != 0.0:
            cable[j].tension = tension[j] * exp(-cable[j].slip * cable[j].pulley)
            for d in range(change.moment.shape[0]):
                change.log_tension[j, d] = -cable[j].pulley * cable[j].follows * change.total[j, d]
            change.log_tension[j, 0] -= cable[j].pulley * cable[j].owed


@kernel
def close_guesses(cable, change, moment_left, work):
    """Newton step of the guesses: no moment may be left beyond the tip, lengths must be those that were passed.

    Returns the largest error of a length, relative where it is more than a metre.
    """
    columns, system = len(change.moment), work.system
    count, worst = columns - 1, 0.0
    for d in range(count):
        system[0, d] = change.moment[1 + d]
    system[0, count] = -(moment_left + change.moment[0])
    for j in range(count - 1):
        error = cable[j].passed - work.handed[1 + j]
        if not abs(error) <= worst * (1.0 + cable[j].passed):
            worst = abs(error) / (1.0 + cable[j].passed)
        for d in range(count):
            system[1 + j, d] = change.passed[j, 1 + d] - change.total[j, 1 + d]
        system[1 + j, count] = -(error + change.passed[j, 0])
    solve_block(system, count, count + 1)
    for i in range(work.column.shape[0]):
        for k in range(work.column.shape[1]):
            for d in range(count):
                work.column[i, k, 0] += work.column[i, k, 1 + d] * system[d, count]
    return worst


@kernel
def balance_chain(packed, tension, slip, force, tip, work):
    """Newton on all angles and on what is handed back, from where they are; returns the steps taken or `FAILED`."""
    plates, column, handed = packed.plate, work.column, work.handed
    n, count = column.shape[1], column.shape[2] - 1
    stiffest = 0.0
    for i in range(len(column)):
        for k in range(n):
            stiffest = max(stiffest, plates[i].stiffness[k])
    follows, settled = packed.model[0].presliding != 0.0, True
    for step in range(MAX_ITERATIONS):
        largest, left, length_error = newton_march(packed, tension, slip, force, tip, work)
        if (
            settled
            and largest <= TOLERANCE
            and abs(left) <= TOLERANCE * stiffest + 1e-13 * abs(handed[0])
            and length_error <= LENGTH_TOLERANCE
        ):
            return step
        longest = 0.0
        for i in range(len(column)):
            for k in range(n):
                if not abs(column[i, k, 0]) <= longest:
                    longest = abs(column[i, k, 0])
        if not longest < 1e6:
            return FAILED
        damping = 1.0 if longest <= MAX_STEP else MAX_STEP / longest
        if follows:
            settled = not slip_on(packed, work, damping)
        for d in range(count):
            handed[d] += damping * work.system[d, count]
        for i in range(len(column)):
            for k in range(n):
                plates[i].q[k] += damping * column[i, k, 0]
    return FAILED
