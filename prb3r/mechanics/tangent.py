r"""Residual and tangent of the whole chain, in all node angles or in a few modes of them.

With ``q = modes @ b`` the principle of virtual work gives the balance ``modes^T r = 0`` and the tangent
``modes^T (dr/dq) modes``.  Unit modes give the full tangent that stability needs; one mode per segment with the
curvature shared by all its plates is the constant-curvature model as a static model.
"""

import math

import numpy as np

from prb3r.mechanics.balance import balance_plate, linearise_shape, place_plate
from prb3r.mechanics.cable import linearise_span, measure_span
from prb3r.mechanics.chain import Chain
from prb3r.mechanics.kernel import entrance
from prb3r.mechanics.march import at_base, depart, next_frame
from prb3r.mechanics.slip import pull_through_pulleys, slip_at
from prb3r.mechanics.variation import clear, enter, feel, local_load, shed, transmit


def unit_modes(shape: tuple[int, ...]) -> np.ndarray:
    """(n, nodes, n * nodes) modes that are each one node angle by itself, for a chain of the `shape` (n, nodes)."""
    rows = math.prod(shape)
    return np.eye(rows).reshape(*shape, rows).copy()


def segment_modes(chain: Chain) -> np.ndarray:
    """(n, nodes, segments) modes of constant curvature: the bend of every plate of one segment, spread evenly over its
    arc, rad per rad."""
    segments = np.arange(int(chain.segment.max()) + 1)
    member = (chain.segment[:, None] == segments).astype(float)
    return member[:, None, :] / chain.plate.stiffness[:, None]


@entrance
def chain_tangent(packed, tension, slip, force, tip, modes, work):
    """Write ``[modes^T (dr/dq) modes | modes^T r]`` (c, c + 1) at the present node angles to `work.system`.

    `modes` is (n, nodes, c), and `work` has c columns; ``dr/dq modes`` (n, nodes, c) is left in `work.column`.  Returns
    the largest unbalanced moment of a mode and the moment of the dead loads about the world origin, N m.
    """
    model, cable, outer, variation, system = packed.model[0], packed.cable, work.outer, work.variation, work.system
    plates, n, columns = modes.shape
    # first pass: the moment of the dead loads about the world origin and its derivatives, which need the shape alone
    for d in range(3):
        outer[d] = 0.0
    clear(variation)
    for j in range(len(cable)):
        cable[j].length = 0.0
    for i in range(plates):
        plate, after = packed.plate[i], packed.plate[i + 1]
        place_plate(model, plate)
        linearise_shape(model, plate)
        for j in range(len(cable)):
            packed.span[i, j].tension = packed.span[i, j].rate = 0.0
            if packed.span[i, j].present and model.presliding != 0.0:
                measure_span(model, plate, packed.span[i, j])
                linearise_span(plate, packed.span[i, j])
                cable[j].length += packed.span[i, j].length
        transmit(model, plate, packed.span[i], modes[i], variation)
        next_frame(model, plate, after)
        shed(packed, i, force, tip, outer, variation)
    moment = -outer[2]
    for d in range(columns):
        work.column[0, 0, d] = -variation.moment[d]
        for j in range(len(cable)):
            variation.total[j, d] = variation.passed[j, d]
    clear(variation)
    # second pass: the balance of plate after plate
    for d in range(3):
        outer[d] = -outer[d]
    for d in range(columns):
        variation.moment[d] = work.column[0, 0, d]
    at_base(tension, slip, cable)
    for c in range(columns):
        for d in range(columns + 1):
            system[c, d] = 0.0
    largest = 0.0
    for i in range(plates):
        plate, after, span = packed.plate[i], packed.plate[i + 1], packed.span[i]
        local_load(plate, outer)
        if model.presliding != 0.0:
            slip_at(model, span, cable)
            if i == 0:
                pull_through_pulleys(tension, cable, variation)
        balance_plate(model, plate, span, cable)
        enter(cable, span, variation)
        feel(plate, span, outer, variation, work.block, 0)
        for k in range(n):
            for d in range(columns):
                for p in range(n):
                    work.block[k, d] += plate.tangent[k, p] * modes[i, p, d]
                work.column[i, k, d] = work.block[k, d]
            for c in range(columns):
                share = modes[i, k, c]
                if share != 0.0:
                    system[c, columns] += share * plate.residual[k]
                    for d in range(columns):
                        system[c, d] += share * work.block[k, d]
        transmit(model, plate, span, modes[i], variation)
        depart(plate, span, cable)
        shed(packed, i, force, tip, outer, variation)
    for c in range(columns):
        if not abs(system[c, columns]) <= largest:
            largest = abs(system[c, columns])
    return largest, moment
