"""The pull of one cable of the rig on all plates, from its pulley to its end, and its derivatives, compiled.

A cable runs straight from hole to hole.  From span to span its tension changes by friction over the angle by which it
turns at the hole between, and by the hole's drag.
"""

import numpy as np
from numba import njit

CLEARANCE_BEND = 0.005
"""Bend of a plate over which its cables change over to the other side of their holes, rad: that of the definition of
`hole_clearance` in docs/effects.md."""


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
