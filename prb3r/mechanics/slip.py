"""Slip at the holes as an unknown of Newton's method, where friction follows the cables' travel."""

from math import exp

from prb3r.mechanics.kernel import kernel

SLIP_TOLERANCE = 1e-7
"""Change of slip away from its bound from which on a hole that slips sticks again; far above rounding, far below any
effect."""


@kernel
def clip(slip):
    """Slip held between its bounds, -1 and 1."""
    return min(max(slip, -1.0), 1.0)


@kernel
def asked_slip(hole, beyond, presliding):
    """The slip that the travel of a cable asks for at a hole, not yet held between -1 and 1: equation [*] of
    `turning.py`, with the length of the cable `beyond` the hole, m."""
    return hole.slip + (beyond - hole.beyond) / presliding


@kernel
def behind_pulley(tension, slip, pulley):
    """The tension (N) of a cable behind a pulley, of which `pulley` is the ln of the efficiency, at its `slip`."""
    return tension * exp(-slip * pulley)


@kernel
def slip_at(model, span, cable):
    """Write to `cable` the slip of each at its hole in the plate's proximal disk, the derivative of that slip by the
    length beyond the hole, and by how much it falls short of what the travel asks for.

    Slip is an unknown of its own: where a hole sticks, the presliding length ties it to the travel; where the hole
    slips, it is at its bound.  Solving for the slip instead of computing it from the travel keeps Newton's method from
    failing at presliding lengths that are small against the travel of a single step.
    """
    for j in range(len(cable)):
        hole = span[j]
        hole.new_beyond = cable[j].length - cable[j].passed
        cable[j].slip, cable[j].follows, cable[j].owed = hole.new_slip, 0.0, 0.0
        if hole.sticks:
            cable[j].follows = 1.0 / model.presliding
            cable[j].owed = asked_slip(hole, hole.new_beyond, model.presliding) - hole.new_slip


@kernel
def slip_on(packed, work, damping):
    """Make the Newton step of the slip at every hole, `damping` times, after that of the angles has been found.

    Returns whether a hole began or ceased to stick.  Primal-dual active set: a hole whose slip would leave [-1, 1]
    slips; a hole that slips and whose travel turns back sticks again.
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
            hole.new_beyond += travel
            asked = asked_slip(hole, hole.new_beyond, model.presliding)
            if hole.sticks:
                slip = asked if damping == 1.0 else hole.new_slip + damping * (asked - hole.new_slip)
                hole.new_slip = clip(slip)
                hole.sticks = -1.0 < slip < 1.0
                changed = changed or not hole.sticks
            elif asked * hole.new_slip < 1.0 - SLIP_TOLERANCE:
                hole.sticks = True
                changed = True
            for k in range(work.column.shape[1]):
                passed += packed.span[i, j].dlength[k] * work.column[i, k, 0]
    return changed


@kernel
def slips_agree(packed):
    """Whether the slip of every hole is what its travel asks for, cut off at -1 and 1, within `SLIP_TOLERANCE`."""
    for i in range(len(packed.span)):
        for j in range(len(packed.cable)):
            hole = packed.span[i, j]
            if hole.present:
                asked = asked_slip(hole, hole.new_beyond, packed.model[0].presliding)
                if not abs(clip(asked) - hole.new_slip) <= SLIP_TOLERANCE:
                    return False
    return True


@kernel
def pull_through_pulleys(tension, cable, change):
    """Write the tensions (m,) behind the pulleys, with their variation, where slip follows the cables' travel.

    A pulley slips as the base hole of its cable does.
    """
    for j in range(len(cable)):
        if cable[j].pulley != 0.0:
            cable[j].tension = behind_pulley(tension[j], cable[j].slip, cable[j].pulley)
            for d in range(change.moment.shape[0]):
                change.log_tension[j, d] = -cable[j].pulley * cable[j].follows * change.total[j, d]
            change.log_tension[j, 0] -= cable[j].pulley * cable[j].owed
