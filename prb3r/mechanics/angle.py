r"""Cosine and sine of one angle together, in line: most angles of a plate are small."""

from math import atan2, cos, sin

from prb3r.mechanics.kernel import kernel


@kernel
def cos_sin(angle):
    """Cosine and sine to the last digit; the polynomials hold to pi / 4 (Moshier, Cephes, sin.c)."""
    if abs(angle) > 0.78:
        return cos(angle), sin(angle)
    z = angle * angle
    s = 1.58962301576546568060e-10
    s = s * z - 2.50507477628578072866e-8
    s = s * z + 2.75573136213857245213e-6
    s = s * z - 1.98412698295895385996e-4
    s = s * z + 8.33333333332211858878e-3
    s = s * z - 1.66666666666666307295e-1
    c = -1.13585365213876817300e-11
    c = c * z + 2.08757008419747316778e-9
    c = c * z - 2.75573141792967388112e-7
    c = c * z + 2.48015872888517045348e-5
    c = c * z - 1.38888888888730564116e-3
    c = c * z + 4.16666666666665929218e-2
    return 1.0 - 0.5 * z + z * z * c, angle + angle * z * s


@kernel
def direction_of(x, y):
    """Angle of the vector (x, y), to the last digit (Moshier, Cephes, atan.c, where it is small)."""
    if abs(y) > 0.66 * x:
        return atan2(y, x)
    t = y / x
    z = t * t
    p = -8.750608600031904122785e-1
    p = p * z - 1.615753718733365076637e1
    p = p * z - 7.500855792314704667340e1
    p = p * z - 1.228866684490136173410e2
    p = p * z - 6.485021904942025371773e1
    q = z + 2.485846490142306297962e1
    q = q * z + 1.650270098316988542046e2
    q = q * z + 4.328810604912902668951e2
    q = q * z + 4.853903996359136964868e2
    q = q * z + 1.945506571482613964425e2
    return t + t * z * p / q
