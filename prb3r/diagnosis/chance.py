"""Tail probabilities and critical values of the normal, the chi-square and the F distribution.

They come from `scipy.special`: `scipy.stats` takes half a second to be imported by every process, and its checks of the
arguments take ten times as long as the function itself.
"""

from typing import Any

import numpy as np
from scipy.special import chdtrc, chdtri, fdtrc, ndtr, ndtri

Numbers = Any
"""A number, or an array, for which an array of the same shape comes back."""


def normal_tail(z: Numbers) -> Numbers:
    """Probability that a standard normal variable exceeds `z`."""
    return ndtr(-z)


def normal_critical(rate: Numbers) -> Numbers:
    """The value that a standard normal variable exceeds with the probability `rate`."""
    return -ndtri(rate)


def chi2_tail(chi2: Numbers, freedom: Numbers) -> Numbers:
    """Probability that chi-square with `freedom` degrees of freedom exceeds `chi2`; NaN where that is 0."""
    return np.where(np.greater(freedom, 0), chdtrc(freedom, chi2), np.nan)[()]


def chi2_critical(rate: Numbers, freedom: Numbers) -> Numbers:
    """The value that chi-square with `freedom` degrees of freedom exceeds with the probability `rate`."""
    return chdtri(freedom, rate)


def exceeded(ordered: np.ndarray, score: Numbers) -> Numbers:
    """The p-value of a score among simulated ones, `ordered` upward: the share that is as large or larger, where the
    score itself counts as one more."""
    return (len(ordered) - np.searchsorted(ordered, score) + 1) / (len(ordered) + 1)


def f_tail(ratio: Numbers, above: Numbers, below: Numbers) -> Numbers:
    """Probability that Fisher's F exceeds `ratio`, with `above` degrees of freedom in its numerator and `below` in its
    denominator."""
    return fdtrc(above, below, ratio)
