r"""Stress relaxation of the plates: quasi-linear viscoelasticity with one relaxation time.

Of the moment `M` that its law of bending gives, a plate bears ``M - m``.  The relaxed moment `m`, the same all along
the plate, follows a share of the mean moment of its law (Fung, Biomechanics, Springer 1981, chapter 7):

    dm / dt = (share mean(M) - m) / time

The loads of a step act as soon as it begins, and are held until it is read.  With the law's moment of the state that
is read, over a step of the duration `t`

    m <- (1 - f) m + f share mean(M),    f = 1 - exp(-t / time)

so that the plate bears ``M - f share mean(M) - (1 - f) m`` then; the kernels put the small difference between `M` and
its mean aside there, and take ``(1 - f share) M`` at every node.  Where steps are read at once instead, and held after
that, linear plates that are read at even intervals differ by a factor of their modulus alone.

Times are counted in steps: mean ones of the loads, or steps of a known duration where times are known.
A sequence begins with plates in which nothing has relaxed, and its first step takes as long as a mean one.
"""

from math import expm1

import numpy as np

from prb3r.mechanics.bending import law_of_plate
from prb3r.mechanics.kernel import kernel


@kernel
def put_stiffness(packed, moment, elapsed, waited):
    """Write the remaining stiffness and the extra moments of a state to the records: of what acts (`moment`, (n,), N m)
    and of what relaxes in the time `waited` since the last solved step, in steps."""
    model = packed.model[0]
    model.stiff, model.decayed = 1.0 - model.softening * elapsed, 0.0
    if model.relaxation != 0.0:
        model.decayed = -expm1(-waited / model.relaxation_time)
        model.stiff *= 1.0 - model.decayed * model.relaxation
    for i in range(len(moment)):
        packed.plate[i].extra = moment[i] + relaxed_before(model, packed.plate[i])


@kernel
def relaxed_before(model, plate):
    """What is left in the present state of the moment that a plate had lost at the last solved step, N m.  It acts on
    the balance as an extra moment, but no plate bears it."""
    return (1.0 - model.decayed) * plate.relaxed


@kernel
def node_weight(plate, k):
    """Part of the flexible arc that node `k` stands for in the mean of a moment along a plate, up to a common factor; 0
    for a hinge at an end of the arc."""
    return 1.0 / plate.curvature[k] if plate.curvature[k] > 0.0 else 0.0


@kernel
def all_nodes(plate):
    """Sum of `node_weight` over the nodes of a plate."""
    total = 0.0
    for k in range(plate.q.shape[0]):
        total += node_weight(plate, k)
    return total


@kernel
def relaxed_moment(model, plate):
    """Relaxed moment of a plate at the end of a step, N m, from that at its beginning, `plate.relaxed`."""
    mean = 0.0
    for k in range(plate.q.shape[0]):
        elastic = law_of_plate(model, plate, k, plate.q[k] - plate.rest[k])[0]
        mean += node_weight(plate, k) * plate.stiffness[k] * elastic
    mean *= model.stiff / (1.0 - model.decayed * model.relaxation) / all_nodes(plate)
    return relaxed_before(model, plate) + model.decayed * model.relaxation * mean


@kernel
def relax(packed):
    """Let the plates relax to the end of the step whose state has just been found."""
    for i in range(len(packed.span)):
        packed.plate[i].relaxed = relaxed_moment(packed.model[0], packed.plate[i])


@kernel
def forget_relaxation(packed):
    """Begin anew with plates in which nothing has relaxed."""
    for i in range(len(packed.span)):
        packed.plate[i].relaxed = 0.0


def times_waited(time: np.ndarray, last: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """(s,) time from the last solved step, or from rest, to each step, in steps.

    Parameters
    ----------
    time : (s,) of each step, in steps.
    last : (s,) the solved step from which each starts, counted from 1; 0: from rest.
    begins : (s,) whether a step is the first of its sequence, which takes one step from rest.
    """
    first = np.maximum.accumulate(np.where(begins, np.arange(len(time)), 0))
    return time - np.where(last > 0, time[last - 1], time[first] - 1.0)
