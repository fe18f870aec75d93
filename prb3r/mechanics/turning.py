r"""The error that holes and sliders make which slip and turn back within a sub-step of a load path.

The slip at a hole follows the cable length `L` beyond it: ``d slip = dL / presliding``, held between -1 and 1.  Hence

    slip = clip(slip before + (L - L before) / presliding, -1, 1)                                             [*]

is exact for a sub-step of any length: whatever `L` does on the way while the slip stays within its bounds, and as long
as `L` changes in one direction while the slip is at a bound.  The only error is that of holes which slip and turn back:
their slip should be counted from the length at which they turned.

Where `L` turned is estimated from the cubic through its values and rates at both ends of the sub-step.  Whether `L`
turned at all is told by the signs of the rates, not by the cubic: rates jump where another hole begins to slip.
"""

from math import copysign, sqrt

from prb3r.mechanics.bending import held_spring, spring_bound
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.slip import clip


@kernel
def turning_points(travel, start, end):
    """The first and the last extremum within (0, 1) of the cubic that rises by `travel` from 0 to 1, with the slopes
    `start` at 0 and `end` at 1.

    Both are 1 for a cubic without an extremum there, and equal for a cubic with a single one.
    """
    a, b = 3.0 * (start + end - 2.0 * travel), 2.0 * (3.0 * travel - 2.0 * start - end)
    inside = b * b - 4.0 * a * start
    if inside < 0.0:
        return 1.0, 1.0
    root = -0.5 * (b + copysign(sqrt(inside), b))
    near = root / a if a != 0.0 else -1.0
    other = start / root if root != 0.0 else -1.0
    first, last = min(near, other), max(near, other)
    if not 0.0 < first < 1.0:
        first = last
    if not 0.0 < last < 1.0:
        last = first
    return (first, last) if 0.0 < first < 1.0 else (1.0, 1.0)


@kernel
def turning_lengths(travel, start, end):
    """The first extremum of the cubic of :func:`turning_points` (1: none), and the changes of length up to its first
    and its last extremum.

    A real length slows down on its way to a turn and speeds up after it; the cubic need not.  So the overshoot at
    either end is cut to slope times distance.  The error that is estimated from it then vanishes with the slope at
    that end, and does not jump where the slope changes its sign.
    """
    first, last = turning_points(travel, start, end)
    square, cube = 3.0 * travel - 2.0 * start - end, start + end - 2.0 * travel
    to_first = first * (start + first * (square + first * cube))
    to_last = last * (start + last * (square + last * cube))
    if start * travel <= 0.0:  # the first turn is beyond the start
        to_first = copysign(min(abs(to_first), abs(start) * first), start)
    if end * travel <= 0.0:  # the last one is beyond the end
        to_last = travel - copysign(min(abs(travel - to_last), abs(end) * (1.0 - last)), end)
    if last == first:
        to_first = to_last = to_first if start * travel <= 0.0 else to_last
    return first, to_first, to_last


@kernel
def missed_slip(packed, step, before, after):
    """The largest error of a slip by [*] in the state just found, and the part of the sub-step after which that hole
    turned back (1: none did).

    `before` and `after` are the rates at both ends of the sub-step, which is the part `step` of a load step.
    """
    worst, where, per_length = 0.0, 1.0, 1.0 / packed.model[0].presliding
    for i in range(len(packed.span)):
        for j in range(len(packed.cable)):
            hole = packed.span[i, j]
            if not hole.present or (hole.friction == 0.0 and (i > 0 or packed.cable[j].pulley == 0.0)):
                continue
            travel, start, end = hole.new_beyond - hole.beyond, before.beyond[i, j] * step, after.beyond[i, j] * step
            if travel * end >= 0.0 and start * end >= 0.0:
                continue
            turned, to_first, to_last = turning_lengths(travel, start, end)
            slip = clip(hole.slip + to_first * per_length)
            slip = clip(slip + (to_last - to_first) * per_length)
            slip = clip(slip + (travel - to_last) * per_length)
            missed = abs(slip - hole.new_slip)
            if missed > worst:
                worst, where = missed, turned
    return worst, where


@kernel
def missed_slide(packed, step, start, before, after):
    """The largest error of a Jenkin element's spring in the state just found, over its bound, and the part of the
    sub-step after which its node turned back (1: none did).

    A Jenkin element follows bending as a hole follows its cable's travel, with the bound of its spring for the
    presliding length; see :func:`missed_slip`.  `start` is the state before the sub-step.
    """
    worst, where, count = 0.0, 1.0, packed.model[0].elements
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        for k in range(plate.q.shape[0]):
            travel, begin, end = plate.q[k] - start.q[i, k], before.q[i, k] * step, after.q[i, k] * step
            if travel * end >= 0.0 and begin * end >= 0.0:
                continue
            turned, to_first, to_last = turning_lengths(travel, begin, end)
            for e in range(count):
                model, angle = packed.model[0], start.q[i, k] - plate.rest[k]
                old = angle - plate.slider[k, e]
                at_first = held_spring(model, plate, k, e, count, angle + to_first, old + to_first, 0.0)[0]
                to_here = at_first + to_last - to_first
                at_last = held_spring(model, plate, k, e, count, angle + to_last, to_here, 0.0)[0]
                now = angle + travel
                spring = held_spring(model, plate, k, e, count, now, at_last + travel - to_last, 0.0)[0]
                direct = held_spring(model, plate, k, e, count, now, old + travel, 0.0)[0]
                bound, missed = abs(spring_bound(model, plate, k, e, count, now, True)[0]), abs(spring - direct)
                if missed > worst * bound:
                    worst, where = missed / bound, turned
    return worst, where
