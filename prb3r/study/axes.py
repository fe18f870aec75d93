"""The axes of a study's grid: factors alone, zipped together, or sampled together."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import qmc

from prb3r.study.spec import Factor, Sampling, Study


@dataclass(frozen=True)
class Axis:
    """An axis of the grid: `n` values of each of some factors, which advance together."""

    values: Mapping[str, list[Any]]
    """By name of the factor, as the spec gives them."""

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))


def axes(study: Study) -> list[Axis]:
    """The axes of the grid, slowest first; without factors there are none.

    Raises
    ------
    ValueError
        If zipped factors differ in length.
    """
    grouped: dict[str, dict[str, list[Any]]] = {}
    for factor in study.factor:
        if factor.range is not None:
            continue
        values, group = _values(factor), grouped.setdefault(factor.zip or f"alone {factor.name}", {})
        before = len(next(iter(group.values()), values))
        if before != len(values):
            raise ValueError(
                f"factors zipped as {factor.zip!r} need one length: {factor.name!r} has {len(values)} values, "
                f"those before it {before}"
            )
        group[factor.name] = values
    sampled = [factor for factor in study.factor if factor.range is not None]
    if sampled and study.sampling is not None:
        points = qmc.scale(
            _unit_points(study.sampling, study.seed, len(sampled)),
            [factor.range.low for factor in sampled if factor.range],
            [factor.range.high for factor in sampled if factor.range],
        )
        grouped["sampled"] = {factor.name: column for factor, column in zip(sampled, points.T.tolist(), strict=True)}
    return [Axis(values) for values in grouped.values()]


def count_cases(study: Study) -> int:
    """Number of cases of a study, found without making them."""
    lengths: dict[str, int] = {}
    for factor in study.factor:
        span = factor.linspace or factor.geomspace
        length = span.count if span else len(factor.values or factor.level or ())
        if factor.range is None:
            lengths[factor.zip or f"alone {factor.name}"] = length
    sampled = study.sampling.count if study.sampling else 1
    return int(np.prod([float(n) for n in (*lengths.values(), sampled)]))


def short(value: float) -> float:
    """To twelve digits: 0.3 instead of 0.30000000000000004."""
    return float(f"{value:.12g}")


def _values(factor: Factor) -> list[Any]:
    """The values of a factor that is not sampled, in the order of the spec."""
    if factor.level is not None:
        return list(factor.level)
    if (span := factor.linspace) is not None:
        return [short(value) for value in np.linspace(span.start, span.stop, span.count)]
    if (span := factor.geomspace) is not None:
        return [short(value) for value in np.geomspace(span.start, span.stop, span.count)]
    values = list(factor.values or ())
    numbers = all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values)
    return [float(value) for value in values] if numbers else values


def _unit_points(sampling: Sampling, seed: int, dimensions: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    if sampling.method == "sobol":
        return qmc.Sobol(dimensions, rng=rng).random_base2(int(np.ceil(np.log2(sampling.count))))[: sampling.count]
    return qmc.LatinHypercube(dimensions, rng=rng).random(sampling.count)
