"""The rule by which numbers of two manipulator files are the same, for everything that carries over from one to the
other."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

ROUNDED_APART = 1e-3
"""Relative difference up to which two numbers are one that files round differently: rounding to four digits leaves half
of it, and rigs are made no more exactly than to 0.5 %."""


def same_numbers(first: ArrayLike, other: ArrayLike) -> bool:
    """Whether two arrays of one shape hold the same numbers but for rounding, and NaN at the same places."""
    return np.allclose(first, other, rtol=ROUNDED_APART, atol=0.0, equal_nan=True)


def same_parts(first: Iterable[Sequence[float | None]], other: Iterable[Sequence[float | None]]) -> bool:
    """Whether two rigs have the same kinds of a part, however many of each.

    A part is the row of its numbers, with None where a file does not tell one.
    """
    one, two = (np.array(list(parts), float) for parts in (first, other))
    same = np.isclose(one[:, None], two, rtol=ROUNDED_APART, atol=0.0, equal_nan=True).all(-1)
    return bool(same.any(0).all() and same.any(1).all())
