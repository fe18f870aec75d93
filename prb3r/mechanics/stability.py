r"""Is an equilibrium stable, and how hard do the plates work?

The lowest eigenvalue of the tangent d(moment residual)/d(node angle), N m/rad, is positive on a stable branch.
Friction makes the tangent unsymmetric, so real parts are taken.  Without dead loads the tangent is block triangular
and the eigenvalues are those of the plates' own blocks.
"""

from math import acos, cos, pi, sqrt

import numpy as np

from prb3r.mechanics.balance import contact, linearise_plate
from prb3r.mechanics.kernel import kernel

CLOSED_FORM_ROWS = 3
"""Of a block whose eigenvalues have a closed form that is used; those of larger ones are left to LAPACK."""


@kernel
def lowest_of_block(a):
    """Smallest real part among the eigenvalues of a matrix (n, n) of up to `CLOSED_FORM_ROWS` rows; NaN of others."""
    n = a.shape[0]
    if n == 1:
        return a[0, 0]
    if n == 2:
        mean, determinant = (a[0, 0] + a[1, 1]) / 2, a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
        return mean - sqrt(max(mean * mean - determinant, 0.0))
    if n == 3:
        third = (a[0, 0] + a[1, 1] + a[2, 2]) / 3
        x, y, z = a[0, 0] - third, a[1, 1] - third, a[2, 2] - third
        # characteristic polynomial of the traceless part: t^3 + p t + q
        p = x * y + y * z + z * x - a[0, 1] * a[1, 0] - a[0, 2] * a[2, 0] - a[1, 2] * a[2, 1]
        q = -(
            x * (y * z - a[1, 2] * a[2, 1])
            - a[0, 1] * (a[1, 0] * z - a[1, 2] * a[2, 0])
            + a[0, 2] * (a[1, 0] * a[2, 1] - y * a[2, 0])
        )
        discriminant = q * q / 4 + p * p * p / 27
        if discriminant <= 0.0 and p < 0.0:  # three real roots
            radius = sqrt(-p / 3)
            angle = acos(min(max(-q / (2 * radius * radius * radius), -1.0), 1.0))
            return third + 2 * radius * cos((angle + 2 * pi) / 3)
        root = sqrt(max(discriminant, 0.0))
        u, v = -q / 2 + root, -q / 2 - root
        real = np.cbrt(u) + np.cbrt(v)
        return third + min(real, -real / 2)
    return np.nan


@kernel
def write_lowest(packed, s, path):
    """Lowest eigenvalue of all plates' own blocks, N m/rad, that of the chain when no dead loads act; or the blocks.

    The plates are in balance; their tangents are taken anew.
    """
    lowest = np.inf
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


def lowest_of_blocks(block: np.ndarray) -> np.ndarray:
    """(s,) of blocks (s, plates, n, n); NaN where there are none."""
    lowest, known = np.full(len(block), np.nan), ~np.isnan(block).any((1, 2, 3))
    lowest[known] = np.linalg.eigvals(block[known]).real.min((1, 2))
    return lowest


@kernel
def plate_moments(packed, out):
    """Bending moment (N m) where each arc begins, at its nodes and where it ends: `out` (plates, n + 2).

    Inside the arc it is the balance's own moment ``M(P)``, so ``M / EI`` is the curvature the plate is asked for.
    """
    n = out.shape[1] - 2
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        fx, fy = plate.wrench[0] + plate.load[0], plate.wrench[1] + plate.load[1]
        moment = plate.wrench[2] + plate.load[2] + plate.extra - contact(plate)[0]  # which the disks carry
        out[i, 0] = moment - plate.clamp * fy
        for k in range(n):
            out[i, k + 1] = moment - (plate.node[0, k] * fy - plate.node[1, k] * fx)
        x, y = plate.end[0] - plate.clamp * plate.axis[0], plate.end[1] - plate.clamp * plate.axis[1]
        out[i, n + 1] = moment - (x * fy - y * fx)
