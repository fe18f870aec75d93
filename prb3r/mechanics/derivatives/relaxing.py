"""Relaxed moments of the plates (see `prb3r.mechanics.relaxation`) and their derivatives by parameters."""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bending import law_of_plate
from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.relaxation import all_nodes, node_weight, relaxed_moment


@bundle
class Relaxed(NamedTuple):
    """Relaxed moments at the last solved step of `n` plates; no plates where none can relax."""

    at: np.ndarray
    """(n,) moments, N m."""
    change: np.ndarray
    """(n, p) their derivatives, N m per unit."""


def nothing_relaxed(plates: int, parameters: int) -> Relaxed:
    """Relaxed moments of so many plates in which nothing has relaxed."""
    return Relaxed(np.zeros(plates), np.zeros((plates, parameters)))


@kernel
def copy_relaxed(source, into):
    """Copy both arrays of `source` to those of the same shapes of `into`."""
    for i in range(len(into.at)):
        into.at[i] = source.at[i]
        for d in range(into.change.shape[1]):
            into.change[i, d] = source.change[i, d]


@kernel
def recall_relaxed(packed, held, sides, relaxed):
    """Write the remembered moments to the records of the plates, of the chain and of the problems beside it."""
    for i in range(len(relaxed.at)):
        packed.plate[i].relaxed, held.plate[i].relaxed = relaxed.at[i], relaxed.at[i]
        for v in range(len(sides.alike)):
            sides.packed.plate[v, i].relaxed = relaxed.at[i]


@kernel
def feel_relaxed(packed, relaxed, partial):
    """Add the derivatives of the remembered moments to the residuals' derivatives in `partial`."""
    for i in range(len(relaxed.at)):
        for k in range(packed.plate[i].q.shape[0]):
            for d in range(partial.shape[2]):
                partial[i, k, d] -= (1.0 - packed.model[0].decayed) * relaxed.change[i, d]


@kernel
def relax_on(packed, sides, relaxed, partial):
    """Let the remembered moments relax to the end of the step just differentiated, with their derivatives.

    The derivatives of its node angles (beyond the stress-free ones, if these are tied) are in `partial`.
    """
    model = packed.model[0]
    relaxing = model.decayed * model.relaxation
    for i in range(len(relaxed.at)):
        plate = packed.plate[i]
        share = relaxing * model.stiff / ((1.0 - relaxing) * all_nodes(plate))
        for d in range(partial.shape[2]):
            ahead = relaxed_moment(sides.packed.model[2 * d, 0], sides.packed.plate[2 * d, i])
            behind = relaxed_moment(sides.packed.model[2 * d + 1, 0], sides.packed.plate[2 * d + 1, i])
            relaxed.change[i, d] *= 1.0 - model.decayed
            relaxed.change[i, d] += (ahead - behind) / sides.apart[d]
            for k in range(plate.q.shape[0]):
                slope = law_of_plate(model, plate, k, plate.q[k] - plate.rest[k])[1]
                relaxed.change[i, d] += share * node_weight(plate, k) * plate.stiffness[k] * slope * partial[i, k, d]
        relaxed.at[i] = relaxed_moment(model, plate)
