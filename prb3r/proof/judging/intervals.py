"""Shares, quantiles, means and ratios with their intervals at the confidence of `SETTINGS.protocol`."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from prb3r.diagnosis.chance import normal_critical
from prb3r.proof.settings import SETTINGS


@dataclass(frozen=True)
class Score:
    """A share, quantile, mean or ratio, with its interval."""

    value: float
    low: float
    high: float
    count: int
    """Number of recordings, or of other items, that were counted."""
    hits: int | None = None
    """Of a share, the number of items that hit."""


def share_of(outcomes: Sequence[bool], clusters: Sequence[Hashable] | None = None) -> Score:
    """The share of true outcomes with Wilson's interval; without outcomes NaN, with the interval from 0 to 1.

    Outcomes of one cluster may be correlated: the interval is that of the number of independent outcomes with the same
    variance (Kish's design effect, never below one).  Without `clusters` all are independent.
    """
    hits, count = int(sum(outcomes)), len(outcomes)
    if not count:
        return Score(np.nan, 0.0, 1.0, 0, 0)
    share = hits / count
    effective = count / _design_effect(np.asarray(outcomes, float), clusters)
    low, high = _wilson(share, effective)
    return Score(share, low, high, count, hits)


def _design_effect(outcomes: np.ndarray, clusters: Sequence[Hashable] | None) -> float:
    """Variance of a share over that of as many independent outcomes, from the sums of clusters (Cochran, 11.2)."""
    share, count = outcomes.mean(), len(outcomes)
    if clusters is None or share in (0, 1):
        return 1.0
    _, of = np.unique(np.asarray(list(map(str, clusters))), return_inverse=True)
    groups = int(of.max()) + 1
    if groups < 2:
        return 1.0
    away = np.bincount(of, outcomes - share)
    return max(float(away @ away / count**2 * groups / (groups - 1) / (share * (1 - share) / count)), 1.0)


def _wilson(share: float, count: float) -> tuple[float, float]:
    """Ends of Wilson's interval of a share of `count` outcomes, which need not be a whole number."""
    z2 = normal_critical(0.5 - SETTINGS.protocol.confidence / 2) ** 2
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = np.sqrt(z2 * (share * (1 - share) / count + z2 / (4 * count**2))) / (1 + z2 / count)
    return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))


def quantile_of(values: Sequence[float], share: float) -> Score:
    """The quantile at `share`, with the interval of order statistics that covers it [David and Nagaraja, Order
    Statistics, 7.1]; NaN of no values."""
    ordered = np.sort(np.asarray(values, float))
    count = len(ordered)
    if not count:
        return Score(np.nan, np.nan, np.nan, 0)
    outside = (1 - SETTINGS.protocol.confidence) / 2
    ends = [int(scipy.stats.binom.ppf(tail, count, share)) for tail in (outside, 1 - outside)]
    low, high = max(ends[0] - 1, 0), min(ends[1], count - 1)
    return Score(float(np.quantile(ordered, share)), float(ordered[low]), float(ordered[high]), count)


def median_of(values: Sequence[float]) -> Score:
    """The median, with the interval of :func:`quantile_of`."""
    return quantile_of(values, 0.5)


def mean_of(values: Sequence[float]) -> Score:
    """The mean of some numbers with a bootstrap percentile interval; NaN where there are none."""
    return ratio_of([(value, 1.0) for value in values])


def ratio_of(parts: Sequence[tuple[float, float]]) -> Score:
    """Sum of the first numbers of all pairs over the sum of the second, with a bootstrap percentile interval; NaN of no
    pairs."""
    pairs = np.asarray(parts, float).reshape(-1, 2)
    if not len(pairs):
        return Score(np.nan, np.nan, np.nan, 0)
    chosen = SETTINGS.protocol
    drawn = pairs[np.random.default_rng(0).integers(len(pairs), size=(chosen.draws, len(pairs)))].sum(1)
    outside = (1 - chosen.confidence) / 2
    low, high = np.quantile(drawn[:, 0] / drawn[:, 1], [outside, 1 - outside])
    whole = pairs.sum(0)
    return Score(float(whole[0] / whole[1]), float(low), float(high), len(pairs))
