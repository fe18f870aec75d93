"""Compiled inner loops of the rig: one plate by shooting, and the balance of all plates.

Numbers are added one by one: sums of whole arrays take Numba three times as long to compile.

Unknowns are the end poses of the plates: `e_i = (X, Y, b)`, centre of disk `i`'s proximal face and bend of plate `i`,
both in the frame of the disk before it (origin at its distal face's centre, x along its axis).  They give every cable
span, hence every turning angle, tension and load on the plate; the plate's shape equation, stepped along the arc from
its proximal end, answers with an end pose; the arm is in equilibrium where every answer equals the assumed pose.

    e_i = shape(w_i(e)),    theta' = kappa0 + k(M(s)),    M(s) = m - (P(s) - P_0) x f,    w_i = (m, f_x, f_y)

`w`: moment about the arc's start `P_0` and force that the distal part exerts on the plate, in the same frame.
"""

import numpy as np
from numba import njit

from prb3r.proof.rig.arrays import LINEAR_LAW, Pulls
from prb3r.proof.rig.bending import bent_in_flag, bent_on, curvature

CLEARANCE_BEND = 0.005
"""Bend of a plate over which its cables change over to the other side of their holes, rad: that of the definition of
`hole_clearance` in docs/effects.md."""


WIRES_SETTLED, MOST_SETTLINGS = 1e-14, 60
"""Last change of the moment that a plate carries beside wires, over the whole moment, and most Newton steps to it."""


@njit(cache=True)
def _bent(rig, i, moment, here, bent):
    """Curvature of plate `i` alone, less the stress-free one, under a moment, and its derivative by the moment.

    Where plates remember, the state before is that at the station `here` of `bent`, and the one reached is written
    there.
    """
    rigidity, numbers, table = rig.rigidity[i], (rig.law_first[i], rig.law_second, rig.law_third), rig.law_table[i]
    if rig.loop_springs > 0:
        loop = rig.loop_share, rig.loop_yield[i], rig.loop_springs
        return bent_on(moment, rigidity, loop, bent.before[i, here], bent.after[i, here])
    if rig.flag_reverse < 1:
        law = rig.law, numbers, table, rig.flag_reverse
        return bent_in_flag(moment, rigidity, law, bent.before[i, here], bent.after[i, here])
    if rig.law != LINEAR_LAW:
        return curvature(moment, rigidity, rig.law, numbers, table)
    return moment / rigidity, 1 / rigidity


@njit(cache=True)
def _bent_beside_wires(rig, i, moment, here, bent):
    """As `_bent`, of a plate beside elastic wires of the stiffness `rig.wires`, which bend with it.

    Newton's method on the part of the moment that the plate carries, which grows with the curvature.
    """
    wires = rig.wires[i]
    own = moment * rig.rigidity[i] / (rig.rigidity[i] + wires)
    for _ in range(MOST_SETTLINGS):
        k, softness = _bent(rig, i, own, here, bent)
        move = (moment - own - wires * k) / (1 + wires * softness)
        own += move
        if abs(move) <= WIRES_SETTLED * abs(moment):
            break
    return k + softness * move, softness / (1 + wires * softness)


@njit(cache=True)
def _along(arm_x, arm_y, bends, force, z, rate):
    """Write to `rate` (12,) the derivatives d/ds of `z`: x, y, theta and the derivatives of each by the wrench.

    z[3:6] are those of x, z[6:9] of y, z[9:] of theta.  `bends` : curvature, and its derivative by the moment.
    """
    (curved, softness), (force_x, force_y) = bends, force
    cos, sin = np.cos(z[2]), np.sin(z[2])
    rate[0], rate[1], rate[2] = cos, sin, curved
    for p in range(3):
        direct = 1.0 if p == 0 else arm_y if p == 1 else -arm_x
        rate[3 + p], rate[6 + p] = -sin * z[9 + p], cos * z[9 + p]
        rate[9 + p] = softness * (direct - z[3 + p] * force_y + z[6 + p] * force_x)


@njit(cache=True)
def shape(rig, i, wrench, elements, bent):
    """(12,) end pose (X, Y, b) of plate `i` under a wrench at its arc's start, then its 3 x 3 tangent row by row.

    Classical Runge-Kutta steps of fourth order, `elements` of them; the tangent is integrated along, so it is exact for
    these steps.  The hysteresis state is read from `bent.before` and written to `bent.after`.
    """
    z, trial, rate, mean = np.zeros(12), np.zeros(12), np.zeros(12), np.zeros(12)
    straight = rig.rest[i]
    moment, force_x, force_y = wrench[0], wrench[1], wrench[2]
    clamp, hinge, h = rig.clamp[i], rig.compliance, rig.arc[i] / elements
    first = hinge + (rig.base_compliance if i == 0 else 0.0)
    z[0], z[2], z[9] = clamp, first * moment, first
    for element in range(elements):
        for stage in range(4):
            ahead = 0.0 if stage == 0 else h if stage == 3 else h / 2
            weight = 1 / 3 if stage == 1 or stage == 2 else 1 / 6
            for q in range(12):
                trial[q] = z[q] + ahead * rate[q]
            arm_x, arm_y = trial[0] - clamp, trial[1]
            there = moment - arm_x * force_y + arm_y * force_x
            here = 2 * element + (stage + 1) // 2  # stations of half an element
            if rig.wires[i] > 0:
                k, softness = _bent_beside_wires(rig, i, there, here, bent)
            else:
                k, softness = _bent(rig, i, there, here, bent)
            _along(arm_x, arm_y, (straight + k, softness), (force_x, force_y), trial, rate)
            for q in range(12):
                mean[q] = (mean[q] if stage > 0 else 0.0) + weight * rate[q]
        for q in range(12):
            z[q] += h * mean[q]
    if hinge > 0:
        arm_x, arm_y = z[0] - clamp, z[1]
        for p in range(3):
            direct = 1.0 if p == 0 else arm_y if p == 1 else -arm_x
            z[9 + p] += hinge * (direct - z[3 + p] * force_y + z[6 + p] * force_x)
        z[2] += hinge * (moment - arm_x * force_y + arm_y * force_x)
    cos, sin = clamp * np.cos(z[2]), clamp * np.sin(z[2])
    z[0] += cos
    z[1] += sin
    for p in range(3):
        z[3 + p] -= sin * z[9 + p]
        z[6 + p] += cos * z[9 + p]
    return z


@njit(cache=True)
def span(rig, plate, cable, end):
    """Length, direction and offset of a cable's span across a plate with end pose `end`, and their derivatives.

    The direction is the angle to the proximal disk's axis.  Length and direction have derivatives by all of `end`, the
    offset by the bend alone.
    """
    b = end[2]
    side = np.tanh(b / CLEARANCE_BEND)
    o, o_b = rig.offset[plate, cable] + rig.clearance * side, rig.clearance * (1 - side**2) / CLEARANCE_BEND
    cos, sin = np.cos(b), np.sin(b)
    v_x, v_y = end[0] - o * sin, end[1] + o * cos - o
    by_b = (-o * cos - o_b * sin, -o * sin + o_b * (cos - 1))
    length = np.hypot(v_x, v_y)
    d_length = v_x / length, v_y / length, (v_x * by_b[0] + v_y * by_b[1]) / length
    d_angle = -v_y / length**2, v_x / length**2, (v_x * by_b[1] - v_y * by_b[0]) / length**2
    return length, np.arctan2(v_y, v_x), o, d_length, d_angle, o_b


@njit(cache=True)
def lengths_beyond(rig, ends):
    """(n, m) length of each cable beyond the hole before each plate: the sum of the spans from there to its end."""
    beyond = np.zeros(rig.offset.shape)
    for j in range(len(rig.reach)):
        for i in range(rig.reach[j] - 1, -1, -1):
            beyond[i, j] = span(rig, i, j, ends[i])[0] + (beyond[i + 1, j] if i + 1 < rig.reach[j] else 0.0)
    return beyond


@njit(cache=True)
def add_rows(to, first, end, factor, rows):
    """Add `factor` times rows `first` to `end` - 1 of `rows` (n, 3) to those of `to` (n, 3)."""
    for i in range(first, end):
        for q in range(3):
            to[i, q] += factor * rows[i, q]


@njit(cache=True)
def rubbing_turn(rig, angle):
    """Wrap angle that counts for friction, and its derivative by the signed angle of turning."""
    open_share = 1 + rig.wrap_saturation * abs(angle)
    return abs(angle) / open_share, np.sign(angle) / open_share**2


@njit(cache=True)
def drag_share(drag, tension, slip):
    """Change of ln(tension) at a hole per slip by its drag, and the derivative of that by ln(tension).

    A cable that is paid out has tension + drag behind the hole, one that is drawn in tension - drag.  Of a small
    tension t the drag is drag t / hypot(t, drag / 2); ln goes on straight where more than 0.7 of it would be held.
    """
    ratio = drag / np.hypot(tension, drag / 2)
    by_log = -ratio * (ratio * tension / drag) ** 2
    if slip > 0:
        return np.log1p(ratio), by_log / (1 + ratio)
    if ratio < 0.7:
        return -np.log1p(-ratio), by_log / (1 - ratio)
    return (ratio - 0.7) / 0.3 - np.log(0.3), by_log / 0.3


@njit(cache=True)
def pull_cable(rig, j, tension, slips, ends, pulls):
    """Add the pull of cable `j` to the wrench of every plate and to its derivatives, and write its span tensions."""
    slip, sticking = slips
    wrench, d_wrench, tensions = pulls
    reach, n = rig.reach[j], len(ends)
    angle, offset, d_offset = np.zeros(n), np.zeros(n), np.zeros(n)
    d_length, d_angle = np.zeros((n, 3)), np.zeros((n, 3))
    for i in range(reach):
        _, angle[i], offset[i], by_length, by_angle, d_offset[i] = span(rig, i, j, ends[i])
        for q in range(3):
            d_length[i, q], d_angle[i, q] = by_length[q], by_angle[q]
    log, d_log = 0.0, np.zeros((n, 3))
    for i in range(reach):
        before = angle[i - 1] - ends[i - 1, 2] if i else 0.0  # direction of the last span, against this disk's axis
        if rig.edges:
            entered, enter_sign = rubbing_turn(rig, before)
            left, leave_sign = rubbing_turn(rig, angle[i])
            turn = entered + left
        else:
            turn, leave_sign = rubbing_turn(rig, angle[i] - before)
            enter_sign = -leave_sign
        if i == 0:  # the pulley comes first
            log += slip[0, j] * rig.pulley[j]
            if sticking[0, j]:
                add_rows(d_log, 0, reach, rig.pulley[j] / rig.presliding, d_length)
        friction = rig.friction[i, j]
        if rig.friction_exponent != 0 and tension > 0:
            friction *= np.exp(-rig.friction_exponent * (log + np.log(tension / rig.friction_tension)))
            add_rows(d_log, 0, reach, -slip[i, j] * friction * turn * rig.friction_exponent, d_log)
        held = friction * turn
        if rig.hole_drag > 0 and tension > 0:
            arriving = tension * np.exp(log)
            dragged, by_log = drag_share(rig.hole_drag, arriving, slip[i, j])
            held += rig.drags[j] * dragged
            add_rows(d_log, 0, reach, slip[i, j] * rig.drags[j] * by_log, d_log)
        log += slip[i, j] * held
        if sticking[i, j]:
            add_rows(d_log, i, reach, held / rig.presliding, d_length)
        add_rows(d_log, i, i + 1, slip[i, j] * friction * leave_sign, d_angle)
        if i:
            add_rows(d_log, i - 1, i, slip[i, j] * friction * enter_sign, d_angle)
            d_log[i - 1, 2] -= slip[i, j] * friction * enter_sign
        pull = tension * np.exp(log)
        cos, sin = np.cos(angle[i]), np.sin(angle[i])
        unit = pull * (rig.clamp[i] * sin + offset[i] * cos), -pull * cos, -pull * sin
        turned = pull * (rig.clamp[i] * cos - offset[i] * sin), pull * sin, -pull * cos
        d_wrench[i, 0, i, 2] += pull * cos * d_offset[i]
        for c in range(3):
            wrench[i, c] += unit[c]
            add_rows(d_wrench[i, c], 0, n, unit[c], d_log)
            add_rows(d_wrench[i, c], i, i + 1, turned[c], d_angle)
        tensions[i, j] = pull


@njit(cache=True)
def poses(rig, ends):
    """(n + 1, 3) centres (at mid-thickness) and absolute angles of the disks, from the base on."""
    out = np.zeros((len(ends) + 1, 3))
    out[0, 0] = -rig.disk / 2
    for i in range(len(ends)):
        x, y, a = out[i, 0], out[i, 1], out[i, 2]
        cos, sin, along = np.cos(a), np.sin(a), rig.disk / 2 + ends[i, 0]
        b = a + ends[i, 2]
        out[i + 1, 0] = x + cos * along - sin * ends[i, 1] + rig.disk / 2 * np.cos(b)
        out[i + 1, 1] = y + sin * along + cos * ends[i, 1] + rig.disk / 2 * np.sin(b)
        out[i + 1, 2] = b
    return out


@njit(cache=True)
def add_dead_loads(rig, forces, ends, wrench, d_wrench):
    """Add the dead loads beyond each plate to its wrench and to the derivatives of that by the end poses."""
    n, where = len(ends), poses(rig, ends)
    x, y, a = where[n, 0], where[n, 1], where[n, 2]
    tip_x, tip_y = x + rig.disk / 2 * np.cos(a), y + rig.disk / 2 * np.sin(a)
    total_x, total_y = forces.tip[0], forces.tip[1]  # of all loads beyond plate i
    torque, virial = tip_x * total_y - tip_y * total_x, tip_x * total_x + tip_y * total_y  # about the origin
    for i in range(n - 1, -1, -1):
        x, y, (f_x, f_y) = where[i + 1, 0], where[i + 1, 1], (forces.disk[i, 0], forces.disk[i, 1])
        total_x, total_y = total_x + f_x, total_y + f_y
        torque, virial = torque + x * f_y - y * f_x, virial + x * f_x + y * f_y
        x, y, a = where[i, 0], where[i, 1], where[i, 2]
        cos, sin = np.cos(a), np.sin(a)
        p_x, p_y = x + (rig.disk / 2 + rig.clamp[i]) * cos, y + (rig.disk / 2 + rig.clamp[i]) * sin
        f_x, f_y = cos * total_x + sin * total_y, -sin * total_x + cos * total_y
        wrench[i, 0] += torque - p_x * total_y + p_y * total_x
        wrench[i, 1], wrench[i, 2] = wrench[i, 1] + f_x, wrench[i, 2] + f_y
        for k in range(i):
            d_wrench[i, 0, k, 2] += p_x * total_x + p_y * total_y - virial
            d_wrench[i, 1, k, 2] += f_y
            d_wrench[i, 2, k, 2] -= f_x
        c_x = x + rig.disk / 2 * cos + cos * ends[i, 0] - sin * ends[i, 1]  # the next disk's proximal face
        c_y = y + rig.disk / 2 * sin + sin * ends[i, 0] + cos * ends[i, 1]
        for k in range(i + 1):
            d_wrench[k, 0, i, 0] += f_y
            d_wrench[k, 0, i, 1] -= f_x
            d_wrench[k, 0, i, 2] += c_x * total_x + c_y * total_y - virial


@njit(cache=True)
def imbalance(rig, forces, slips, bent, ends, elements):
    """Residual (n, 3) of the balance at end poses (n, 3), its tangent (3n, 3n), and the span tensions (n, m).

    The residual is the end pose that a plate takes under its wrench less the one assumed.  Slip states are given; where
    a hole sticks, the tangent counts that its state changes with the cable's length beyond it.  The hysteresis state of
    the plates is read from `bent.before`; the one that would follow is written to `bent.after`.
    """
    n, m = rig.offset.shape
    wrench, d_wrench, tensions = np.zeros((n, 3)), np.zeros((n, 3, n, 3)), np.zeros((n, m))
    for j in range(m):
        pull_cable(rig, j, forces.tension[j], slips, ends, Pulls(wrench, d_wrench, tensions))
    add_dead_loads(rig, forces, ends, wrench, d_wrench)
    gap, tangent, bend = np.zeros((n, 3)), np.zeros((3 * n, 3 * n)), poses(rig, ends)[n, 2]
    for i in range(n):
        side = 1 if ends[i, 2] > 0 else 0
        excess = abs(ends[i, 2]) - rig.contact_angle[i, side]
        if excess > 0:  # the touching disks carry this part past plate and hinges
            wrench[i, 0] -= rig.contact_stiffness[i, side] * excess * np.sign(ends[i, 2])
            d_wrench[i, 0, i, 2] -= rig.contact_stiffness[i, side]
        wrench[i, 0] -= rig.umbilical * bend
        for k in range(n):
            d_wrench[i, 0, k, 2] -= rig.umbilical
        wrench[i, 0] += rig.moment[i] + rig.moment_per_bend[i] * ends[i, 2]
        d_wrench[i, 0, i, 2] += rig.moment_per_bend[i]
        answer = shape(rig, i, wrench[i], elements, bent)
        for q in range(3):
            gap[i, q], row = answer[q] - ends[i, q], 3 * i + q
            for p in range(3):
                by_wrench = answer[3 + 3 * q + p]
                for k in range(n):
                    for c in range(3):
                        tangent[row, 3 * k + c] += by_wrench * d_wrench[i, p, k, c]
            tangent[row, row] -= 1
    return gap, tangent, tensions
