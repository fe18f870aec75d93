r"""Cosine and sine, angle of a vector and exponential, compiled into their callers.

Most arguments within a plate are small, so a polynomial does; the library function is called for large ones alone.
Polynomials are summed by Estrin's scheme, in which a processor works on several terms at a time.
"""

from math import atan2, cos, exp, sin

from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.lanes.number import some, where


@kernel
def cos_sin(angle):
    """Cosine and sine of an angle (rad) to the last digit; the polynomials hold to pi / 4 (Moshier, Cephes, sin.c)."""
    z = angle * angle
    w = z * z
    s = (-1.66666666666666307295e-1 + 8.33333333332211858878e-3 * z) + w * (
        (-1.98412698295895385996e-4 + 2.75573136213857245213e-6 * z)
        + w * (-2.50507477628578072866e-8 + 1.58962301576546568060e-10 * z)
    )
    c = (4.16666666666665929218e-2 - 1.38888888888730564116e-3 * z) + w * (
        (2.48015872888517045348e-5 - 2.75573141792967388112e-7 * z)
        + w * (2.08757008419747316778e-9 - 1.13585365213876817300e-11 * z)
    )
    c, s = 1.0 - 0.5 * z + w * c, angle + angle * z * s
    large = abs(angle) > 0.78
    if some(large):
        c, s = where(large, cos(angle), c), where(large, sin(angle), s)
    return c, s


@kernel
def direction_of(x, y):
    """Angle of the vector (x, y), rad, to the last digit; small angles by the rational of Moshier, Cephes, atan.c."""
    t = y / x
    z = t * t
    w = z * z
    p = (-6.485021904942025371773e1 - 1.228866684490136173410e2 * z) + w * (
        (-7.500855792314704667340e1 - 1.615753718733365076637e1 * z) - 8.750608600031904122785e-1 * w
    )
    q = (1.945506571482613964425e2 + 4.853903996359136964868e2 * z) + w * (
        (4.328810604912902668951e2 + 1.650270098316988542046e2 * z) + w * (2.485846490142306297962e1 + z)
    )
    angle, large = t + t * z * p / q, abs(y) > 0.66 * x
    if some(large):
        angle = where(large, atan2(y, x), angle)
    return angle


@kernel
def exponential(x):
    """e to the power of `x`, to the last digits; up to 0.25 by its Taylor series to the eleventh power."""
    z = x * x
    w = z * z
    tail = (1 / 2 + x / 6) + z * (1 / 24 + x / 120) + w * ((1 / 720 + x / 5040) + z * (1 / 40320 + x / 362880))
    power, large = 1.0 + (x + z * (tail + w * w * (1 / 3628800 + x / 39916800))), abs(x) > 0.25
    if some(large):
        power = where(large, exp(x), power)
    return power
