r"""Lowest eigenvalues of plates' own blocks of the tangent: real parts, in closed form up to four rows.

The traceless part of a block has the characteristic polynomial t^3 + p t + q or t^4 + p t^2 + q t + r, whose
coefficients follow from the sums of the powers of its eigenvalues, the traces of its own powers (Newton's identities).
"""

from math import acos, cos, sqrt

import numpy as np

from prb3r.mechanics.chain import Chain
from prb3r.mechanics.kernel import kernel

CLOSED_FORM_ROWS = 4
"""Largest number of rows of a block whose eigenvalues are computed in closed form; larger ones are left to LAPACK."""


def has_closed_form(chain: Chain) -> bool:
    """Whether the eigenvalues of the plates' blocks are computed in closed form.

    They are not for four rows with contact of the disks: a quartic loses the digits of its small roots beside one that
    is 10,000 times as large, as touching disks cause it.
    """
    rows = chain.stiffness.shape[1]
    return rows < CLOSED_FORM_ROWS or (rows == CLOSED_FORM_ROWS and not np.any(chain.contact.stiffness))


@kernel
def largest_root(p, q):
    """Largest real root of t^3 + p t + q."""
    discriminant = q * q / 4 + p * p * p / 27
    if discriminant <= 0.0 and p < 0.0:  # three real roots
        radius = sqrt(-p / 3)
        return 2 * radius * cos(acos(min(max(-q / (2 * radius * radius * radius), -1.0), 1.0)) / 3)
    root = sqrt(max(discriminant, 0.0))
    return np.cbrt(-q / 2 + root) + np.cbrt(-q / 2 - root)


@kernel
def lowest_of_cubic(p, q):
    """Smallest real part among the roots of t^3 + p t + q."""
    if q * q / 4 + p * p * p / 27 <= 0.0:  # all are real
        return -largest_root(p, -q)
    real = largest_root(p, q)
    return min(real, -real / 2)


@kernel
def lowest_of_quartic(p, q, r):
    """Smallest real part among the roots of t^4 + p t^2 + q t + r, as a product of two quadratics (Ferrari, Descartes).

    These are t^2 + s t + u and t^2 - s t + w; s^2 is the largest root of z^3 + 2 p z^2 + (p^2 - 4 r) z - q^2.  Of the
    ways to pair the roots, that one has the pair with the largest sum, which loses the fewest digits.
    """
    third, c = -2 * p / 3, p * p - 4 * r
    z = third + largest_root(c - p * p * 4 / 3, (c - 2 * third * third) * third - q * q)
    slope = (3 * z + 4 * p) * z + c
    if slope > 0.0:  # a Newton step, for the last digits
        z -= (((z + 2 * p) * z + c) * z - q * q) / slope
    if not z > 0.0:
        return 0.0
    s = sqrt(z)
    u, w = (p + z - q / s) / 2, (p + z + q / s) / 2
    return min(-s / 2 - sqrt(max(z / 4 - u, 0.0)), s / 2 - sqrt(max(z / 4 - w, 0.0)))


@kernel
def lowest_of_block(a):
    """Smallest real part among the eigenvalues of a matrix (n, n) of up to `CLOSED_FORM_ROWS` rows; NaN of larger ones.

    Changes `a` to its traceless part.
    """
    n, mean = a.shape[0], 0.0
    if n > CLOSED_FORM_ROWS:
        return np.nan
    for i in range(n):
        mean += a[i, i] / n
    for i in range(n):
        a[i, i] -= mean
    squares, cubes, fourths = 0.0, 0.0, 0.0  # traces of its powers
    for i in range(n):
        for j in range(i + 1):
            above, below = 0.0, 0.0  # elements of its square
            for k in range(n):
                above += a[j, k] * a[k, i]
                below += a[i, k] * a[k, j]
            if i == j:
                squares += above
                cubes += above * a[i, i]
                fourths += above * above
            else:
                cubes += above * a[i, j] + below * a[j, i]
                fourths += 2.0 * above * below
    if n == 1:
        return mean
    if n == 2:
        return mean - sqrt(max(squares / 2, 0.0))
    p, q = -squares / 2, -cubes / 3
    if n == 3:
        return mean + lowest_of_cubic(p, q)
    return mean + lowest_of_quartic(p, q, squares * squares / 8 - fourths / 4)


def lowest_of_blocks(block: np.ndarray) -> np.ndarray:
    """(s,) smallest real part among the eigenvalues of the blocks (s, plates, n, n); NaN where a block has a NaN."""
    lowest, known = np.full(len(block), np.nan), ~np.isnan(block).any((1, 2, 3))
    lowest[known] = np.linalg.eigvals(block[known]).real.min((1, 2))
    return lowest
