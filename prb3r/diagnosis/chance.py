"""Tails of the normal, the chi-square and the F law, and where they begin.

From `scipy.special`: `scipy.stats` has them too, takes half a second to be imported by every process, and checks each
call for ten times as long as it takes.
"""

from typing import Any

import numpy as np
from scipy.special import chdtrc, chdtri, fdtrc, ndtr, ndtri

Numbers = Any
"""A number, or an array of them; then an array of the same shape comes back."""


def normal_tail(z: Numbers) -> Numbers:
    """Probability that a standard normal variable exceeds `z`."""
    return ndtr(-z)


def normal_critical(rate: Numbers) -> Numbers:
    """What a standard normal variable exceeds with the probability `rate`."""
    return -ndtri(rate)


def chi2_tail(chi2: Numbers, freedom: Numbers) -> Numbers:
    """Probability that a sum of so many squared standard normal variables exceeds `chi2`; NaN of none."""
    return np.where(np.greater(freedom, 0), chdtrc(freedom, chi2), np.nan)[()]


def chi2_critical(rate: Numbers, freedom: Numbers) -> Numbers:
    """What a sum of so many squared standard normal variables exceeds with the probability `rate`."""
    return chdtri(freedom, rate)


def f_tail(ratio: Numbers, above: Numbers, below: Numbers) -> Numbers:
    """Probability that the ratio of two mean squares of standard normal variables, of `above` and `below` degrees of
    freedom, exceeds `ratio`."""
    return fdtrc(above, below, ratio)
