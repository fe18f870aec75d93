"""Compiled balance of all plates of the rig: from assumed end poses to those that the plates take.

Numbers are added one by one: sums of whole arrays take Numba three times as long to compile.

Unknowns are the end poses of the plates: `e_i = (X, Y, b)`, centre of disk `i`'s proximal face and bend of plate `i`,
both in the frame of the disk before it (origin at its distal face's centre, x along its axis).  They give every cable
span, hence every turning angle, tension and load `w_i` on the plate; the plate's shape answers with an end pose; the
arm is in equilibrium where every answer equals the assumed pose, `e_i = shape(w_i(e))`.
"""

import numpy as np
from numba import njit

from prb3r.proof.rig.arrays import Pulls
from prb3r.proof.rig.plate import shape
from prb3r.proof.rig.pull import pull_cable


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
def wrenches(rig, forces, slips, ends):
    """Wrench (n, 3) that bends each plate at end poses (n, 3), its derivatives (n, 3, n, 3) by these, and the span
    tensions (n, m).

    Slip states are given; where a hole sticks, the derivatives count that its state changes with the cable's length
    beyond it.
    """
    n, m = rig.offset.shape
    wrench, d_wrench, tensions = np.zeros((n, 3)), np.zeros((n, 3, n, 3)), np.zeros((n, m))
    for j in range(m):
        pull_cable(rig, j, forces.tension[j], slips, ends, Pulls(wrench, d_wrench, tensions))
    add_dead_loads(rig, forces, ends, wrench, d_wrench)
    bend = poses(rig, ends)[n, 2]
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
    return wrench, d_wrench, tensions


@njit(cache=True)
def imbalance(rig, forces, slips, bent, ends, elements):
    """Residual (n, 3) of the balance at end poses (n, 3), its tangent (3n, 3n), and the span tensions (n, m).

    The residual is the end pose that a plate takes under its wrench less the one assumed; `slips` are those of
    :func:`wrenches`.  The hysteresis state of the plates is read from `bent.before`; the one that would follow is
    written to `bent.after`.
    """
    n = len(ends)
    wrench, d_wrench, tensions = wrenches(rig, forces, slips, ends)
    gap, tangent = np.zeros((n, 3)), np.zeros((3 * n, 3 * n))
    for i in range(n):
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
