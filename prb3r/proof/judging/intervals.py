"""Shares, medians and ratios with intervals of the confidence of the protocol."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom, binomtest

from prb3r.proof.settings import SETTINGS


@dataclass(frozen=True)
class Score:
    """A share, a median or a ratio, with its interval."""

    value: float
    low: float
    high: float
    count: int
    """Recordings, or numbers, that it is of."""
    hits: int | None = None
    """Of a share: those that count for it."""


def share_of(outcomes: Sequence[bool]) -> Score:
    """A share and Wilson's interval; of nothing, the whole range from 0 to 1."""
    hits, count = int(sum(outcomes)), len(outcomes)
    if not count:
        return Score(np.nan, 0.0, 1.0, 0, 0)
    interval = binomtest(hits, count).proportion_ci(SETTINGS.protocol.confidence, method="wilson")
    return Score(hits / count, float(interval.low), float(interval.high), count, hits)


def median_of(values: Sequence[float]) -> Score:
    """A median and the interval between order statistics that covers it [David and Nagaraja, Order Statistics, 7.1]."""
    ordered = np.sort(np.asarray(values, float))
    count = len(ordered)
    if not count:
        return Score(np.nan, np.nan, np.nan, 0)
    low = int(binom.ppf((1 - SETTINGS.protocol.confidence) / 2, count, 0.5))
    low, high = max(low - 1, 0), min(count - low, count - 1)
    return Score(float(np.median(ordered)), float(ordered[low]), float(ordered[high]), count)


def ratio_of(parts: Sequence[tuple[float, float]]) -> Score:
    """Sum of the first over sum of the second of each pair, with a bootstrapped interval (percentiles)."""
    pairs = np.asarray(parts, float).reshape(-1, 2)
    if not len(pairs):
        return Score(np.nan, np.nan, np.nan, 0)
    chosen = SETTINGS.protocol
    drawn = pairs[np.random.default_rng(0).integers(len(pairs), size=(chosen.draws, len(pairs)))].sum(1)
    outside = (1 - chosen.confidence) / 2
    low, high = np.quantile(drawn[:, 0] / drawn[:, 1], [outside, 1 - outside])
    whole = pairs.sum(0)
    return Score(float(whole[0] / whole[1]), float(low), float(high), len(pairs))
