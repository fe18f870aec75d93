r"""What sliders in the plates remember, and its derivatives.

A Jenkin element (see `prb3r.mechanics.plate_law.Hysteresis`) adds to a node's unbalanced moment, per stiffness and
share,

    s = clip(angle - p, -y, y),    angle = q - rest,    p <- angle - s

A spring that follows the node has the derivative of ``angle - p``; one that slips that of its bound `y`, and it has
forgotten: the derivative of its slider is from then on that of ``angle -+ y``.  Which of the two holds is decided by
the state itself, not by the problems ahead and behind: where loads rest for a step what has slipped is at its bound.
Where the bounds follow the node, as those of flag-shaped loops do, a slider moves by what they leave of its change.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bending import spring_bounds
from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.state import SLIPS_ON


@bundle
class Sliders(NamedTuple):
    """Of the last accepted state; no elements where plates do not remember."""

    at: np.ndarray
    """(n, nodes, elements) node angles where they stand, rad."""
    change: np.ndarray
    """(n, nodes, elements, p) their derivatives."""


def sliders_at_zero(shape: tuple[int, int], elements: int, parameters: int) -> Sliders:
    """Sliders of plates that were never bent, at zero with no derivatives, for node angles of `shape` (n, nodes) and
    for so many elements and parameters."""
    return Sliders(np.zeros((*shape, elements)), np.zeros((*shape, elements, parameters)))


@kernel
def slipped_to(spring, low, high):
    """To which bound a spring has slipped: 1 the upper, -1 the lower, 0 neither.

    Rounding leaves one that has slipped on either side of its bound.
    """
    if spring >= high - SLIPS_ON * abs(high):
        return 1
    return -1 if spring <= low + SLIPS_ON * abs(low) else 0


@kernel
def bound_change(sides, i, k, e, count, d, angle, end):
    """Difference of a bound (`end`: 1 upper, -1 lower) between the problems ahead and behind, of parameter `d`, at one
    node angle beyond the stress-free one."""
    ahead, behind = sides.packed.plate[2 * d, i], sides.packed.plate[2 * d + 1, i]
    low, high, _, _ = spring_bounds(sides.packed.model[2 * d, 0], ahead, k, e, count, angle)
    low_behind, high_behind, _, _ = spring_bounds(sides.packed.model[2 * d + 1, 0], behind, k, e, count, angle)
    return high - high_behind if end > 0 else low - low_behind


@kernel
def recall_sliders(packed, sides, sliders, tied, partial):
    """Put the sliders into the plates, and what their springs add to the residuals' derivatives into `partial`.

    `tied`: node angles beyond the stress-free ones are held, else the angles are.
    """
    count = packed.model[0].elements
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        for k in range(plate.q.shape[0]):
            angle = plate.q[k] - plate.rest[k]
            for e in range(count):
                low, high, low_slope, high_slope = spring_bounds(packed.model[0], plate, k, e, count, angle)
                spring = angle - sliders.at[i, k, e]
                end = slipped_to(spring, low, high)
                plate.slider[k, e] = sliders.at[i, k, e]
                if end > 0:  # to the tangent too
                    plate.slider[k, e] -= max(high + SLIPS_ON * abs(high) - spring, 0.0)
                elif end < 0:
                    plate.slider[k, e] += max(spring - low + SLIPS_ON * abs(low), 0.0)
                weight = packed.model[0].stiff * plate.stiffness[k] * packed.model[0].share / count
                for d in range(len(sides.apart)):
                    ahead, behind = sides.packed.plate[2 * d, i], sides.packed.plate[2 * d + 1, i]
                    models = sides.packed.model[2 * d, 0], sides.packed.model[2 * d + 1, 0]
                    shares = models[0].stiff * models[0].share, models[1].stiff * models[1].share
                    stiffer = (ahead.stiffness[k] * shares[0] - behind.stiffness[k] * shares[1]) / count
                    rest = 0.0 if tied else ahead.rest[k] - behind.rest[k]
                    if end == 0:
                        change, now = -rest / sides.apart[d] - sliders.change[i, k, e, d], spring
                    else:
                        now, slope = (high, high_slope) if end > 0 else (low, low_slope)
                        later = bound_change(sides, i, k, e, count, d, angle, end)
                        change = (later - slope * rest) / sides.apart[d]
                    partial[i, k, d] += stiffer / sides.apart[d] * now + weight * change


@kernel
def drag_sliders(packed, sides, sliders, tied, partial):
    """Let the sliders go where the state just differentiated has dragged them; its node angles are in `partial`."""
    count = packed.model[0].elements
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        for k in range(plate.q.shape[0]):
            angle = plate.q[k] - plate.rest[k]
            for e in range(count):
                low, high, low_slope, high_slope = spring_bounds(packed.model[0], plate, k, e, count, angle)
                end = slipped_to(angle - sliders.at[i, k, e], low, high)
                if end == 0:
                    continue
                bound, slope = (high, high_slope) if end > 0 else (low, low_slope)
                sliders.at[i, k, e] = angle - bound
                for d in range(len(sides.apart)):
                    ahead, behind = sides.packed.plate[2 * d, i], sides.packed.plate[2 * d + 1, i]
                    rest = 0.0 if tied else (ahead.rest[k] - behind.rest[k]) / sides.apart[d]
                    later = bound_change(sides, i, k, e, count, d, angle, end) / sides.apart[d]
                    sliders.change[i, k, e, d] = (1.0 - slope) * (partial[i, k, d] - rest) - later
