r"""Lowest eigenvalue of a chain without dead loads, and bending moments along the plates.

The lowest eigenvalue of the tangent d(moment residual)/d(node angle), N m/rad, is positive on a stable branch.
Friction makes the tangent unsymmetric, so real parts are taken.  Without dead loads the tangent is block triangular
and the eigenvalues are those of the plates' own blocks; `eigenvalue.py` is for all other chains.
"""

from math import inf

from prb3r.mechanics.balance import linearise_plate
from prb3r.mechanics.bending import contact
from prb3r.mechanics.block_eigenvalue import lowest_of_block
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.relaxation import relaxed_before


@kernel
def write_lowest(packed, s, path):
    """Write the lowest eigenvalue of all plates' own blocks, N m/rad, to row `s` of `path.lowest`, or, if `path.block`
    has room, the blocks themselves.

    It is that of the chain if no dead loads act.  The plates are in balance; their tangents are computed anew.
    """
    lowest = inf
    for i in range(len(packed.span)):
        tangent = packed.plate[i].tangent
        linearise_plate(packed.model[0], packed.plate[i], packed.span[i])
        if len(path.block) == 0:
            lowest = min(lowest, lowest_of_block(tangent))
        else:
            for k in range(tangent.shape[0]):
                for p in range(tangent.shape[1]):
                    path.block[s, i, k, p] = tangent[k, p]
    if len(path.block) == 0:
        path.lowest[s] = lowest


@kernel
def plate_moments(packed, out):
    """Write the bending moment (N m) where each arc begins, at its nodes and where it ends to `out` (plates, n + 2).

    At the nodes it is the balance's own moment ``M(P)``, less what touching disks carry and what has relaxed, so that
    ``M / EI`` is the curvature of a linear plate there that does not relax.
    """
    n = out.shape[1] - 2
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        fx, fy = plate.wrench[0] + plate.load[0], plate.wrench[1] + plate.load[1]
        moment = plate.wrench[2] + plate.load[2] + plate.extra - relaxed_before(packed.model[0], plate)
        moment -= contact(plate)[0]  # which the disks carry
        out[i, 0] = moment - plate.clamp * fy
        for k in range(n):
            out[i, k + 1] = moment - (plate.node[0, k] * fy - plate.node[1, k] * fx)
        x, y = plate.end[0] - plate.clamp * plate.axis[0], plate.end[1] - plate.clamp * plate.axis[1]
        out[i, n + 1] = moment - (x * fy - y * fx)
