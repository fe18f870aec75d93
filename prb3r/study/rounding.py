"""Numbers rounded to significant digits: each becomes the float that is nearest to the decimal number."""

import numpy as np

SHORT_DIGITS = 12
"""Significant digits that remove rounding errors: 0.3 for 0.30000000000000004."""
POWERS = np.array([float(10**power) for power in range(23)])
"""The powers of ten that floats hold exactly."""


def short(value: float) -> float:
    """A number rounded to `SHORT_DIGITS` digits."""
    return float(f"{value:.{SHORT_DIGITS}g}")


def significant(values: np.ndarray, digits: int = SHORT_DIGITS) -> np.ndarray:
    """Numbers of any shape rounded to so many digits, at most 12, with the bits that :func:`short` gives.

    A whole number of so many digits times or over a power of ten that is exact is the nearest float.  Numbers beyond
    these powers, and those whose digits end so near to a half that the product does not tell, go through text.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        places = digits - 1 - np.floor(np.log10(np.abs(values)))
        far = ~(np.abs(places) < len(POWERS))
        power = POWERS[np.where(far, 0, np.abs(places)).astype(int)]
        scaled = np.where(places > 0, values * power, values / power)
        whole = np.rint(scaled)
        result = np.where(places > 0, whole / power, whole * power)
        textual = far | (np.abs(scaled - whole) > 0.499)
    result[textual] = [float(f"{value:.{digits}g}") for value in values[textual]]
    return result
