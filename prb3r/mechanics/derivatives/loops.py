r"""What sliders in the plates remember, and its derivatives.

A Jenkin element (see `prb3r.mechanics.plate_law.Hysteresis`) adds to a node's unbalanced moment, per stiffness and
share,

    s = clip(angle - p, -y, y),    angle = q - rest,    p <- angle - s

A spring that follows the node has the derivative of ``angle - p``; one that slips that of its bound `y`, and it has
forgotten: the derivative of its slider is from then on that of ``angle -+ y``.  Which of the two holds is decided by
the state itself, not by the problems ahead and behind: where loads rest for a step what has slipped is at its bound.
"""

from math import copysign
from typing import NamedTuple

import numpy as np

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
def spring_of(plate, k, e, count, sliders, i):
    """Angle of a spring without bound, and the bound."""
    return plate.q[k] - plate.rest[k] - sliders.at[i, k, e], plate.yields[k] * (2 * e + 1) / count


@kernel
def has_slipped(spring, bound):
    """Whether a spring is at its bound, where rounding leaves one that has slipped on either side of it."""
    return abs(spring) >= (1.0 - SLIPS_ON) * bound


@kernel
def recall_sliders(packed, sides, sliders, tied, partial):
    """Put the sliders into the plates, and what their springs add to the residuals' derivatives into `partial`.

    `tied`: node angles beyond the stress-free ones are held, else the angles are.
    """
    count = packed.model[0].elements
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        for k in range(plate.q.shape[0]):
            for e in range(count):
                spring, bound = spring_of(plate, k, e, count, sliders, i)
                slipped = has_slipped(spring, bound)
                plate.slider[k, e] = sliders.at[i, k, e]
                if slipped:  # to the tangent too
                    plate.slider[k, e] -= copysign(max((1.0 + SLIPS_ON) * bound - abs(spring), 0.0), spring)
                weight = packed.model[0].stiff * plate.stiffness[k] * packed.model[0].share / count
                for d in range(len(sides.apart)):
                    ahead, behind = sides.packed.plate[2 * d, i], sides.packed.plate[2 * d + 1, i]
                    models = sides.packed.model[2 * d, 0], sides.packed.model[2 * d + 1, 0]
                    shares = models[0].stiff * models[0].share, models[1].stiff * models[1].share
                    stiffer = (ahead.stiffness[k] * shares[0] - behind.stiffness[k] * shares[1]) / count
                    if not slipped:
                        rest = 0.0 if tied else (ahead.rest[k] - behind.rest[k]) / sides.apart[d]
                        change, now = -rest - sliders.change[i, k, e, d], spring
                    else:
                        later = (ahead.yields[k] - behind.yields[k]) * (2 * e + 1) / count
                        change, now = copysign(later / sides.apart[d], spring), copysign(bound, spring)
                    partial[i, k, d] += stiffer / sides.apart[d] * now + weight * change


@kernel
def drag_sliders(packed, sides, sliders, tied, partial):
    """Let the sliders go where the state just differentiated has dragged them; its node angles are in `partial`."""
    count = packed.model[0].elements
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        for k in range(plate.q.shape[0]):
            for e in range(count):
                spring, bound = spring_of(plate, k, e, count, sliders, i)
                if not has_slipped(spring, bound):
                    continue
                sliders.at[i, k, e] += spring - copysign(bound, spring)
                for d in range(len(sides.apart)):
                    ahead, behind = sides.packed.plate[2 * d, i], sides.packed.plate[2 * d + 1, i]
                    later = (ahead.yields[k] - behind.yields[k]) * (2 * e + 1) / count
                    rest = 0.0 if tied else ahead.rest[k] - behind.rest[k]
                    change = partial[i, k, d] - (rest + copysign(later, spring)) / sides.apart[d]
                    sliders.change[i, k, e, d] = change
