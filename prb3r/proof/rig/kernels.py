"""Compiled inner loops of the rig: one plate by shooting, and the balance of all plates.

Unknowns are the end poses of the plates: `e_i = (X, Y, b)`, centre of disk `i`'s proximal face and bend of plate `i`,
both in the frame of the disk before it (origin at its distal face's centre, x along its axis).  They give every cable
span, hence every turning angle, tension and load on the plate; the plate's shape equation, stepped along the arc from
its proximal end, answers with an end pose; equilibrium is where the answer is the question.

    e_i = shape(w_i(e)),    theta' = kappa0 + k(M(s)),    M(s) = m - (P(s) - P_0) x f,    w_i = (m, f_x, f_y)

`w`: moment about the arc's start `P_0` and force which the distal part exerts on the plate.
"""

import numpy as np
from numba import njit

from prb3r.proof.rig.arrays import Pulls
from prb3r.proof.rig.bending import bent_on, curvature

CLEARANCE_BEND = 0.005
"""Bend over which a cable changes over to the other side of its holes, rad."""


@njit(cache=True)
def _along(plate, wrench, station, z, rate):
    """d/ds of x, y, theta and, from z[3:6] of x to z[9:] of theta, of their derivatives by the wrench.

    `station` : state before and after, of a plate that remembers.
    """
    clamp, rest, rigidity, law, first, second, third, loop = plate
    moment, force_x, force_y = wrench
    arm_x, arm_y = z[0] - clamp, z[1]
    there = moment - arm_x * force_y + arm_y * force_x
    if loop[2] > 0:
        k, softness = bent_on(there, rigidity, loop, station[0], station[1])
    else:
        k, softness = curvature(there, rigidity, law, first, second, third)
    cos, sin = np.cos(z[2]), np.sin(z[2])
    rate[0], rate[1], rate[2] = cos, sin, rest + k
    for p in range(3):
        direct = 1.0 if p == 0 else arm_y if p == 1 else -arm_x
        rate[3 + p], rate[6 + p] = -sin * z[9 + p], cos * z[9 + p]
        rate[9 + p] = softness * (direct - z[3 + p] * force_y + z[6 + p] * force_x)


@njit(cache=True)
def shape(rig, i, wrench, elements, bent):
    """End pose (X, Y, b) of one plate under a wrench at its arc's start, and its 3 x 3 tangent.

    Classical fourth-order stepping in `elements` steps; the tangent is stepped along, so it is exact for them.
    """
    z, trial, rate, mean = np.zeros(12), np.zeros(12), np.zeros(12), np.zeros(12)
    law = rig.law, rig.law_first[i], rig.law_second, rig.law_third
    loop = rig.loop_share, rig.loop_yield[i], rig.loop_springs
    plate = (rig.clamp[i], rig.rest[i], rig.rigidity[i]) + law + (loop,)  # noqa: RUF005 compiled code joins tuples so
    apart = 1 if rig.loop_springs > 0 else 0  # stations of half an element, or one for all
    moment, force_x, force_y = wrench[0], wrench[1], wrench[2]
    load = moment, force_x, force_y
    clamp, hinge, h = rig.clamp[i], rig.compliance, rig.arc[i] / elements
    first = hinge + (rig.base_compliance if i == 0 else 0.0)
    z[0], z[2], z[9] = clamp, first * moment, first
    for element in range(elements):
        here = 2 * element * apart
        _along(plate, load, (bent.before[i, here], bent.after[i, here]), z, rate)
        for q in range(12):
            mean[q] = rate[q] / 6
        for stage in range(3):
            ahead, weight = (h, 1 / 6) if stage == 2 else (h / 2, 1 / 3)
            for q in range(12):
                trial[q] = z[q] + ahead * rate[q]
            here = (2 * element + (2 if stage == 2 else 1)) * apart
            _along(plate, load, (bent.before[i, here], bent.after[i, here]), trial, rate)
            for q in range(12):
                mean[q] += weight * rate[q]
        for q in range(12):
            z[q] += h * mean[q]
    if hinge > 0:
        arm_x, arm_y = z[0] - clamp, z[1]
        direct = np.array([1.0, arm_y, -arm_x])
        z[9:] += hinge * (direct - z[3:6] * force_y + z[6:9] * force_x)
        z[2] += hinge * (moment - arm_x * force_y + arm_y * force_x)
    cos, sin = clamp * np.cos(z[2]), clamp * np.sin(z[2])
    z[3:6] -= sin * z[9:]
    z[6:9] += cos * z[9:]
    return np.array([z[0] + cos, z[1] + sin, z[2]]), z[3:].copy().reshape(3, 3)


@njit(cache=True)
def span(rig, plate, cable, end):
    """Length and direction (against the proximal disk's axis) of a span, its offset, and their derivatives by `end`."""
    b = end[2]
    side = np.tanh(b / CLEARANCE_BEND)
    o, o_b = rig.offset[plate, cable] + rig.clearance * side, rig.clearance * (1 - side**2) / CLEARANCE_BEND
    cos, sin = np.cos(b), np.sin(b)
    v_x, v_y = end[0] - o * sin, end[1] + o * cos - o
    by_b = (-o * cos - o_b * sin, -o * sin + o_b * (cos - 1))
    length = np.hypot(v_x, v_y)
    d_length = np.array([v_x, v_y, v_x * by_b[0] + v_y * by_b[1]]) / length
    d_angle = np.array([-v_y, v_x, v_x * by_b[1] - v_y * by_b[0]]) / length**2
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
def pull_cable(rig, j, tension, slips, ends, pulls):
    """Add what cable `j` does to every plate's wrench and tangent, and note its span tensions."""
    slip, sticking = slips
    wrench, d_wrench, tensions = pulls
    reach, n = rig.reach[j], len(ends)
    angle, offset, d_offset = np.zeros(n), np.zeros(n), np.zeros(n)
    d_length, d_angle = np.zeros((n, 3)), np.zeros((n, 3))
    for i in range(reach):
        _, angle[i], offset[i], d_length[i], d_angle[i], d_offset[i] = span(rig, i, j, ends[i])
    log, d_log = 0.0, np.zeros((n, 3))
    for i in range(reach):
        before = angle[i - 1] - ends[i - 1, 2] if i else 0.0  # of the last span, against this disk's axis
        if rig.edges:
            turn, enter_sign, leave_sign = abs(before) + abs(angle[i]), np.sign(before), np.sign(angle[i])
        else:
            turn, leave_sign = abs(angle[i] - before), np.sign(angle[i] - before)
            enter_sign = -leave_sign
        if i == 0:  # the pulley comes first
            log += slip[0, j] * rig.pulley[j]
            if sticking[0, j]:
                d_log[:reach] += rig.pulley[j] / rig.presliding * d_length[:reach]
        friction = rig.friction[i, j]
        if rig.friction_exponent != 0 and tension > 0:
            friction *= np.exp(-rig.friction_exponent * (log + np.log(tension / rig.friction_tension)))
            d_log *= 1 - slip[i, j] * friction * turn * rig.friction_exponent
        log += slip[i, j] * friction * turn
        if sticking[i, j]:
            d_log[i:reach] += friction * turn / rig.presliding * d_length[i:reach]
        d_log[i] += slip[i, j] * friction * leave_sign * d_angle[i]
        if i:
            d_log[i - 1] += slip[i, j] * friction * enter_sign * d_angle[i - 1]
            d_log[i - 1, 2] -= slip[i, j] * friction * enter_sign
        pull = tension * np.exp(log)
        cos, sin = np.cos(angle[i]), np.sin(angle[i])
        unit = pull * np.array([rig.clamp[i] * sin + offset[i] * cos, -cos, -sin])
        by_angle = pull * np.array([rig.clamp[i] * cos - offset[i] * sin, sin, -cos])
        wrench[i] += unit
        d_wrench[i, 0, i, 2] += pull * cos * d_offset[i]
        for c in range(3):
            d_wrench[i, c] += unit[c] * d_log
            d_wrench[i, c, i] += by_angle[c] * d_angle[i]
        tensions[i, j] = pull


@njit(cache=True)
def poses(rig, ends):
    """(n + 1, 3) centres and angles of the disks, from the base."""
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
    """Add the dead loads beyond each plate to its wrench and tangent."""
    n, where = len(ends), poses(rig, ends)
    total, torque, virial = np.zeros((n, 2)), np.zeros(n), np.zeros(n)  # about the origin, of all loads beyond plate i
    for i in range(n - 1, -1, -1):
        if i + 1 < n:
            total[i], torque[i], virial[i] = total[i + 1], torque[i + 1], virial[i + 1]
        x, y, a = where[i + 1, 0], where[i + 1, 1], where[i + 1, 2]
        tip_x, tip_y = x + rig.disk / 2 * np.cos(a), y + rig.disk / 2 * np.sin(a)
        for s_x, s_y, f in ((x, y, forces.disk[i]), (tip_x, tip_y, forces.tip if i + 1 == n else np.zeros(2))):
            total[i] += f
            torque[i] += s_x * f[1] - s_y * f[0]
            virial[i] += s_x * f[0] + s_y * f[1]
    for i in range(n):
        x, y, a = where[i, 0], where[i, 1], where[i, 2]
        cos, sin = np.cos(a), np.sin(a)
        p_x, p_y = x + (rig.disk / 2 + rig.clamp[i]) * cos, y + (rig.disk / 2 + rig.clamp[i]) * sin
        f_x, f_y = cos * total[i, 0] + sin * total[i, 1], -sin * total[i, 0] + cos * total[i, 1]
        wrench[i] += np.array([torque[i] - p_x * total[i, 1] + p_y * total[i, 0], f_x, f_y])
        d_wrench[i, 0, :i, 2] += p_x * total[i, 0] + p_y * total[i, 1] - virial[i]
        d_wrench[i, 1, :i, 2] += f_y
        d_wrench[i, 2, :i, 2] -= f_x
        c_x = x + rig.disk / 2 * cos + cos * ends[i, 0] - sin * ends[i, 1]  # the next disk's proximal face
        c_y = y + rig.disk / 2 * sin + sin * ends[i, 0] + cos * ends[i, 1]
        d_wrench[: i + 1, 0, i, 0] += f_y
        d_wrench[: i + 1, 0, i, 1] -= f_x
        d_wrench[: i + 1, 0, i, 2] += c_x * total[i, 0] + c_y * total[i, 1] - virial[i]


@njit(cache=True)
def imbalance(rig, forces, slips, bent, ends, elements):
    """Answer minus question (n, 3), its tangent (3n, 3n), and the span tensions (n, m), at given slip states (n, m).

    Where a hole sticks, its slip state follows the cable's length beyond it, and the tangent knows.  What plates
    remember is read from `bent.before`; what they would is left in `bent.after`.
    """
    n, m = rig.offset.shape
    wrench, d_wrench, tensions = np.zeros((n, 3)), np.zeros((n, 3, n, 3)), np.zeros((n, m))
    for j in range(m):
        pull_cable(rig, j, forces.tension[j], slips, ends, Pulls(wrench, d_wrench, tensions))
    add_dead_loads(rig, forces, ends, wrench, d_wrench)
    gap, tangent = np.zeros((n, 3)), np.zeros((3 * n, 3 * n))
    for i in range(n):
        side = 1 if ends[i, 2] > 0 else 0
        excess = abs(ends[i, 2]) - rig.contact_angle[i, side]
        if excess > 0:  # the touching disks carry this part past plate and hinges
            wrench[i, 0] -= rig.contact_stiffness[i, side] * excess * np.sign(ends[i, 2])
            d_wrench[i, 0, i, 2] -= rig.contact_stiffness[i, side]
        wrench[i, 0] -= rig.umbilical * ends[:, 2].sum()
        d_wrench[i, 0, :, 2] -= rig.umbilical
        wrench[i, 0] += rig.moment[i] + rig.moment_per_bend[i] * ends[i, 2]
        d_wrench[i, 0, i, 2] += rig.moment_per_bend[i]
        answer, softness = shape(rig, i, wrench[i], elements, bent)
        gap[i] = answer - ends[i]
        tangent[3 * i : 3 * i + 3] = softness @ d_wrench[i].reshape(3, 3 * n)
    return gap, tangent - np.eye(3 * n), tensions
