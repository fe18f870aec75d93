"""Shares, medians and ratios with 95 % intervals."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom, norm

CONFIDENCE = 0.95
DRAWS = 2000


@dataclass(frozen=True)
class Score:
    """A share, a median or a ratio, with its 95 % interval."""

    value: float
    low: float
    high: float
    count: int
    hits: int | None = None
    """Of a share."""


def wilson(hits: int, count: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Wilson's interval of a share [J. Am. Stat. Assoc. 22 (1927) 209]."""
    if count == 0:
        return 0.0, 1.0
    z = float(norm.isf((1 - confidence) / 2))
    share, width = hits / count, z**2 / count
    middle = (share + width / 2) / (1 + width)
    half = z * np.sqrt(share * (1 - share) / count + width / (4 * count)) / (1 + width)
    return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))


def share_of(found: Sequence[bool]) -> Score:
    """A share and Wilson's interval."""
    hits, count = int(sum(found)), len(found)
    return Score(hits / count if count else np.nan, *wilson(hits, count), count, hits)


def median_of(values: Sequence[float]) -> Score:
    """A median and the interval between order statistics that covers it."""
    ordered = np.sort(np.asarray(values, float))
    count = len(ordered)
    if not count:
        return Score(np.nan, np.nan, np.nan, 0)
    low = int(binom.ppf((1 - CONFIDENCE) / 2, count, 0.5))
    low, high = max(low - 1, 0), min(count - low, count - 1)
    return Score(float(np.median(ordered)), float(ordered[low]), float(ordered[high]), count)


def ratio_of(parts: Sequence[tuple[float, float]]) -> Score:
    """Sum over sum, with a bootstrapped interval."""
    pairs = np.asarray(parts, float).reshape(-1, 2)
    if not len(pairs):
        return Score(np.nan, np.nan, np.nan, 0)
    drawn = pairs[np.random.default_rng(0).integers(len(pairs), size=(DRAWS, len(pairs)))].sum(1)
    low, high = np.quantile(drawn[:, 0] / drawn[:, 1], [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    whole = pairs.sum(0)
    return Score(float(whole[0] / whole[1]), float(low), float(high), len(pairs))
