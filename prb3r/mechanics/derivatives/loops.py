r"""Sliders of plates with hysteresis, and their derivatives by parameters.

A Jenkin element (see `prb3r.mechanics.plate_law.Hysteresis`) adds to a node's unbalanced moment, per stiffness and
share,

    s = clip(angle - p, -y, y),    angle = q - rest,    p <- angle - s

A spring between its bounds has the derivative of ``angle - p``.  One that slips has that of its bound `y`, and the
history before is forgotten: the derivative of its slider is from then on that of ``angle -+ y``.  Which of the two
holds is decided by the state itself, not by the problems ahead and behind: where loads rest for a step, a spring that
has slipped stands at its bound.  Where the bounds depend on the node angle, as those of flag-shaped loops do, a slider
moves by the change of the angle less that of the bound.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bending import FREE, OUTER, held_spring, spring_bound
from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.state import SLIPS_ON


@bundle
class Sliders(NamedTuple):
    """Sliders of the last accepted state; no elements where plates have no hysteresis."""

    at: np.ndarray
    """(n, nodes, elements) node angles beyond the stress-free ones at which the sliders stand, rad."""
    change: np.ndarray
    """(n, nodes, elements, p) derivatives of `at`, rad per unit."""


def sliders_at_zero(shape: tuple[int, int], elements: int, parameters: int) -> Sliders:
    """Sliders of plates that were never bent: at zero, with derivatives of zero.

    `shape` is that of the node angles, (n, nodes).
    """
    return Sliders(np.zeros((*shape, elements)), np.zeros((*shape, elements, parameters)))


@kernel
def spring_of(packed, sliders, i, k, e):
    """What `held_spring` returns for the spring of element `e` at node `k` of plate `i`, with the remembered slider.

    A spring within rounding of its bound (`SLIPS_ON`) counts as being at that bound.
    """
    plate, model = packed.plate[i], packed.model[0]
    angle = plate.q[k] - plate.rest[k]
    return held_spring(model, plate, k, e, model.elements, angle, angle - sliders.at[i, k, e], SLIPS_ON)


@kernel
def beyond_bound(plate, k, bound, where, slider):
    """The position `slider`, moved if need be so that its spring lies beyond the `bound` by more than rounding, and
    therefore slips without doubt."""
    angle = plate.q[k] - plate.rest[k]
    upper = (where == OUTER) == (angle >= 0.0)
    if upper:
        return min(slider, angle - bound - SLIPS_ON * abs(bound))
    return max(slider, angle - bound + SLIPS_ON * abs(bound))


@kernel
def bound_change(packed, sides, i, k, e, d, where):
    """Bound of a spring in the problem ahead less that in the problem behind, of parameter `d`, at the same node angle
    beyond the stress-free one, rad; `where` (`OUTER` or `INNER`) says which bound."""
    ahead, behind = sides.packed.plate[2 * d, i], sides.packed.plate[2 * d + 1, i]
    models = sides.packed.model[2 * d, 0], sides.packed.model[2 * d + 1, 0]
    angle, count, outer = packed.plate[i].q[k] - packed.plate[i].rest[k], packed.model[0].elements, where == OUTER
    farther, _ = spring_bound(models[0], ahead, k, e, count, angle, outer)
    nearer, _ = spring_bound(models[1], behind, k, e, count, angle, outer)
    return farther - nearer


@kernel
def recall_sliders(packed, sides, sliders, tied, partial):
    """Write the remembered sliders to the records of the plates, and add the derivatives of their springs' moments at
    the held shape to the residuals' derivatives in `partial`.

    If node angles are `tied`, those beyond the stress-free ones are held, else the angles themselves.
    """
    count = packed.model[0].elements
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        for k in range(plate.q.shape[0]):
            for e in range(count):
                spring, slope, where = spring_of(packed, sliders, i, k, e)
                plate.slider[k, e] = sliders.at[i, k, e]
                if where != FREE:  # to the tangent too
                    plate.slider[k, e] = beyond_bound(plate, k, spring, where, plate.slider[k, e])
                weight = packed.model[0].stiff * plate.stiffness[k] * packed.model[0].share / count
                for d in range(len(sides.apart)):
                    ahead, behind = sides.packed.plate[2 * d, i], sides.packed.plate[2 * d + 1, i]
                    models = sides.packed.model[2 * d, 0], sides.packed.model[2 * d + 1, 0]
                    shares = models[0].stiff * models[0].share, models[1].stiff * models[1].share
                    stiffer = (ahead.stiffness[k] * shares[0] - behind.stiffness[k] * shares[1]) / count
                    rest = 0.0 if tied else ahead.rest[k] - behind.rest[k]
                    if where == FREE:
                        change = -rest / sides.apart[d] - sliders.change[i, k, e, d]
                    else:
                        later = bound_change(packed, sides, i, k, e, d, where)
                        change = (later - slope * rest) / sides.apart[d]
                    partial[i, k, d] += stiffer / sides.apart[d] * spring + weight * change


@kernel
def drag_sliders(packed, sides, sliders, tied, partial):
    """Move the sliders, with their derivatives, to where the state just differentiated has dragged them.

    The derivatives of its node angles are in `partial`.
    """
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        for k in range(plate.q.shape[0]):
            for e in range(packed.model[0].elements):
                bound, slope, where = spring_of(packed, sliders, i, k, e)
                if where == FREE:
                    continue
                sliders.at[i, k, e] = plate.q[k] - plate.rest[k] - bound
                for d in range(len(sides.apart)):
                    ahead, behind = sides.packed.plate[2 * d, i], sides.packed.plate[2 * d + 1, i]
                    rest = 0.0 if tied else (ahead.rest[k] - behind.rest[k]) / sides.apart[d]
                    later = bound_change(packed, sides, i, k, e, d, where) / sides.apart[d]
                    sliders.change[i, k, e, d] = (1.0 - slope) * (partial[i, k, d] - rest) - later
