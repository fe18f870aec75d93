"""Compiled bending laws: moments of plates by the parameters of `prb3r.mechanics.plate_law`, and of touching disks.

The moment at a node is expressed as an equivalent node angle: the one by which a linear plate would turn there under
the same moment.
"""

from math import copysign, inf

from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.lanes.number import where


@kernel
def tabled_law(table, side, x):
    """f over the last curvature of a tabulated bending law, and its slope, at `x`: curvature over the last curvature.

    `side` is 0 for negative and 1 for positive curvature; beyond the table the law goes on as a straight line.
    """
    last = table.shape[1] - 1
    row = int(min(x * last, last - 1.0))
    t = x * last - row
    low, high = table[side, row, 0], table[side, row + 1, 0]
    before, behind = table[side, row, 1], table[side, row + 1, 1]
    if t > 1.0:
        return high + behind * (t - 1.0) / last, behind
    rise = (high - low) * last
    bow, twist = 3.0 * rise - 2.0 * before - behind, before + behind - 2.0 * rise
    return low + t * (before + t * (bow + t * twist)) / last, before + t * (2.0 * bow + 3.0 * t * twist)


@kernel
def bending_law(model, knees, angle, curvature):
    """Equivalent node angle (rad) of the moment by the bending law, and its derivative by the node angle.

    Parameters
    ----------
    knees : (2,) curvature of the knee for negative and for positive curvature, 1/m.
    angle : node angle beyond the stress-free one, rad.
    curvature : curvature per node angle, 1/m.
    """
    k, knee = abs(curvature * angle), knees[1] if angle > 0.0 else knees[0]
    if model.tabled:
        moment, slope = tabled_law(model.table, 1 if angle > 0.0 else 0, k / knee)
        return copysign(moment * knee / curvature, angle) if k > 0.0 else angle, slope
    stretch = model.cubic * k * k
    if model.sharpness < inf:
        passed = (k / knee) ** model.sharpness
        share = (1.0 - model.ratio) * (1.0 + passed) ** (-1.0 / model.sharpness)
        return angle * (stretch + model.ratio + share), 3.0 * stretch + model.ratio + share / (1.0 + passed)
    if k <= knee:
        return angle * (1.0 + stretch), 1.0 + 3.0 * stretch
    offset = knee / curvature * (1.0 + model.cubic * knee**2 - model.ratio)
    return copysign(1.0, angle) * offset + model.ratio * angle, model.ratio


@kernel
def spring_bound(model, plate, k, e, count, angle, outer):
    """A bound of the spring of Jenkin element `e` of `count` at node `k`, rad, and its derivative by the node angle.

    `angle` is the node angle beyond the stress-free one.  The `outer` bound lies on the side to which the node is bent,
    the inner one on the other.  See :class:`prb3r.mechanics.plate_law.Hysteresis`.
    """
    if model.reverse < 1.0:
        reverse = 1.0 if outer else model.reverse
        moment, slope = bending_law(model, plate.knee, angle / reverse, plate.curvature[k])
        return reverse * moment, slope
    bound = plate.yields[k] * (2 * e + 1) / count
    return bound if outer == (angle >= 0.0) else -bound, 0.0


FREE, OUTER, INNER = 0, 1, 2
"""Where the spring of a Jenkin element is: between its bounds, or at the outer or inner one of `spring_bound`."""


@kernel
def held_spring(model, plate, k, e, count, angle, spring, slack):
    """The angle `spring` (rad) held between the bounds of `spring_bound`, its derivative by the node angle, and where
    the spring is: `FREE`, `OUTER` or `INNER`.

    A spring within the part `slack` of a bound counts as being at that bound.
    """
    side = 1.0 if angle >= 0.0 else -1.0
    outer, steep = spring_bound(model, plate, k, e, count, angle, True)
    if side * spring >= side * outer - slack * abs(outer):
        return outer, steep, OUTER
    inner, slope = spring_bound(model, plate, k, e, count, angle, False)
    if side * inner >= side * outer:  # a law that does not soften has no loop
        return outer, steep, OUTER
    if side * spring <= side * inner + slack * abs(inner):
        return inner, slope, INNER
    return spring, 1.0, FREE


@kernel
def slipping_law(model, plate, k, angle):
    """Equivalent node angle (rad) of the Jenkin elements' moment at node `k`, and its derivative by the node angle.

    `angle` is the node angle beyond the stress-free one.
    """
    total, follows, count = 0.0, 0.0, model.elements
    weight = model.share / max(count, 1)
    for e in range(count):
        spring, slope, _ = held_spring(model, plate, k, e, count, angle, angle - plate.slider[k, e], 0.0)
        total += spring
        follows += slope
    return weight * total, weight * follows


@kernel
def law_of_plate(model, plate, k, angle):
    """Equivalent node angle (rad) of the whole moment at node `k`, and its derivative by the node angle.

    `angle` is the node angle beyond the stress-free one.
    """
    if model.share == 0.0:
        return bending_law(model, plate.knee, angle, plate.curvature[k])
    slipping, follows = slipping_law(model, plate, k, angle)
    if model.share == 1.0:
        return slipping, follows
    elastic, slope = bending_law(model, plate.knee, angle, plate.curvature[k])
    return (1.0 - model.share) * elastic + slipping, (1.0 - model.share) * slope + follows


@law_of_plate.where_in_lanes
def linear_law(model, plate, k, angle):
    """`law_of_plate` for equilibria solved side by side, whose plates are all linear."""
    return angle, 1.0


@kernel
def contact(plate):
    """Moment that the touching disks beside a bent plate carry, N m, and its derivative by the bend, N m/rad."""
    positive = plate.bend > 0.0
    stiffness = where(positive, plate.contact_stiffness[1], plate.contact_stiffness[0])
    excess = abs(plate.bend) - where(positive, plate.contact_angle[1], plate.contact_angle[0])
    touching = excess > 0.0
    return where(touching, copysign(stiffness * excess, plate.bend), 0.0), where(touching, stiffness, 0.0)
