"""One plate of the rig by shooting: the end pose that it takes under a wrench, compiled.

    theta' = kappa0 + k(M(s)),    M(s) = m - (P(s) - P_0) x f,    w = (m, f_x, f_y)

`w`: moment about the arc's start `P_0` and force that the distal part exerts on the plate, in the frame of the disk
before it (origin at its distal face's centre, x along its axis).
"""

import numpy as np
from numba import njit

from prb3r.proof.rig.arrays import LINEAR_LAW
from prb3r.proof.rig.bending import bent_in_flag, bent_on, curvature

WIRES_SETTLED, MOST_SETTLINGS = 1e-14, 60
"""Last change of the moment that a plate carries beside wires, over the whole moment, and most Newton steps to it."""


@njit(cache=True)
def bent_alone(rig, i, moment, here, bent):
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
def bent_beside_wires(rig, i, moment, here, bent):
    """As `bent_alone`, of a plate beside elastic wires of the stiffness `rig.wires`, which bend with it.

    Newton's method on the part of the moment that the plate carries, which grows with the curvature.
    """
    wires = rig.wires[i]
    own = moment * rig.rigidity[i] / (rig.rigidity[i] + wires)
    for _ in range(MOST_SETTLINGS):
        k, softness = bent_alone(rig, i, own, here, bent)
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
                k, softness = bent_beside_wires(rig, i, there, here, bent)
            else:
                k, softness = bent_alone(rig, i, there, here, bent)
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
