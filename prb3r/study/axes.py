"""The axes of a study's grid: one for each factor alone, each zip group, all searched and all sampled factors."""

import contextlib
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from prb3r.model.files.cells import count
from prb3r.model.files.toml_lines import Keys
from prb3r.model.files.validation import KeyedError
from prb3r.study.factors import Factor, Level, Sampling
from prb3r.study.rounding import significant
from prb3r.study.spec import Study


@dataclass(frozen=True)
class Axis:
    """An axis of the grid: one or several factors with `n` values each, which advance together."""

    values: Mapping[str, list[Any]]
    """The `n` values by name of the factor: numbers, texts or levels, as the spec gives them."""

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))


def axes(study: Study, designs: np.ndarray | None = None) -> list[Axis]:
    """The axes of the grid of cases, slowest first; empty for a study without factors.

    Parameters
    ----------
    designs : (n, factors) values of the searched factors; None: the first generation of the search.

    Raises
    ------
    KeyedError
        With every factor of another length than those that it is zipped with, and every value that stands twice.
    """
    wrong = list[tuple[Keys, str]]()
    grouped: dict[tuple[str, str], dict[str, list[Any]]] = {}
    place = dict[tuple[str, str], int]()
    for number, factor in enumerate(study.factor):
        if factor.drawn is not None:
            continue
        key = ("zip", factor.zip) if factor.zip else ("alone", factor.name)
        values, group = _values(factor), grouped.setdefault(key, {})
        place.setdefault(key, number)
        before = len(next(iter(group.values()), values))
        if before != len(values):
            what = f"{factor.name!r} has {count(len(values), 'value')}, those before it {before}"
            wrong.append((("factor", number), f"factors zipped as {factor.zip!r} need one length: {what}"))
            continue
        group[factor.name] = values
    for (how, name), group in grouped.items():
        if (twice := _first_repeated(list(zip(*group.values(), strict=True)))) is not None:
            told = ", ".join(value.label if isinstance(value, Level) else str(value) for value in twice)
            alone = f"factor {name!r}: the value {told} stands"
            what = alone if how == "alone" else f"factors zipped as {name!r}: the values {told} stand"
            wrong.append((("factor", place[how, name]), f"{what} there twice; give each once"))
    if wrong:
        raise KeyedError(*wrong)
    if study.searched:
        rows = first_designs(study) if designs is None else designs
        grouped["searched", ""] = _named(study.searched, rows)
    if study.sampled and study.sampling is not None:
        grouped["sampled", ""] = _named(study.sampled, sampled_points(study))  # the fastest, see `sample_count`
    return [Axis(values) for values in grouped.values()]


def _first_repeated(rows: Sequence[tuple[Any, ...]]) -> tuple[Any, ...] | None:
    """The first of the rows that stood there before; None if each stands there once."""
    with contextlib.suppress(TypeError):  # levels have no hash; numbers have, which is cheap where there are many
        if len(set(rows)) == len(rows):
            return None
    seen: set[str] = set()
    for row in rows:
        if repr(row) in seen:
            return row
        seen.add(repr(row))
    return None


def _named(factors: list[Factor], rows: np.ndarray) -> dict[str, list[Any]]:
    """Values of each factor by name, from the columns of `rows`; for factors with levels, numbers of levels."""
    return {
        factor.name: [factor.level[int(number)] for number in column] if factor.level else column
        for factor, column in zip(factors, rows.T.tolist(), strict=True)
    }


def count_cases(study: Study, designs: int | None = None) -> int:
    """Number of cases of a study, found without making them.

    Parameters
    ----------
    designs : number of designs of a search; None: those of its first generation.
    """
    lengths: dict[str, int] = {}
    for factor in study.factor:
        span = factor.linspace or factor.geomspace
        length = span.count if span else len(factor.values or factor.level or ())
        if factor.drawn is None:
            lengths[factor.zip or f"alone {factor.name}"] = length
    searched = (designs if designs is not None else len(first_designs(study))) if study.searched else 1
    return int(np.prod([float(n) for n in (*lengths.values(), searched, sample_count(study))]))


def sample_count(study: Study) -> int:
    """Number of samples of the sampled factors, 1 if there are none.

    The sample of a case is its number modulo this, as the axis of the samples is the fastest of all.
    """
    if study.sampling is None:
        return 1
    blocks = len(study.sampled) + 2 if study.sampling.method == "saltelli" else 1
    return study.sampling.count * blocks


def sampled_points(study: Study) -> np.ndarray:
    """(samples, factors) values of the sampled factors; of factors with levels, the number of the level from 0.

    With the method `saltelli`, blocks of `count` rows: two independent samples A and B, then for each factor A with
    that factor's column from B (Saltelli et al., Computer Physics Communications 181, 2010, 259).
    """
    assert study.sampling is not None
    shares = _unit_points(study.sampling, study.seed, len(study.sampled))
    columns = [
        factor.drawn.values(share, factor.neutral)
        for factor, share in zip(study.sampled, shares.T, strict=True)
        if factor.drawn
    ]
    return np.stack(columns, 1)


def first_designs(study: Study) -> np.ndarray:
    """(n, factors) the first generation of designs of a search, spread over the ranges by a Sobol sequence."""
    assert study.search is not None
    factors, count = study.searched, study.search.generation
    shares = _unit_points(Sampling(method="sobol", count=count), study.seed, len(factors))
    return np.stack([_in_range(factor, share) for factor, share in zip(factors, shares.T, strict=True)], 1)


def corners(study: Study) -> np.ndarray:
    """(2^factors, factors) the designs at all corners of the ranges searched."""
    return np.array(list(itertools.product(*((f.range.low, f.range.high) for f in study.searched if f.range))))


def _in_range(factor: Factor, share: np.ndarray) -> np.ndarray:
    """Values of a searched factor, to five digits, at shares (0 to 1) of its range."""
    assert factor.range is not None
    return five_digits(factor.range.values(share))


def five_digits(values: np.ndarray) -> np.ndarray:
    """Values of designs rounded to five significant digits: nobody makes a plate more exactly."""
    return significant(values, 5)


def _values(factor: Factor) -> list[Any]:
    """The listed values of a factor that is not drawn, in the order of the spec."""
    if factor.level is not None:
        return list(factor.level)
    if (span := factor.linspace) is not None:
        return significant(np.linspace(span.start, span.stop, span.count)).tolist()
    if (span := factor.geomspace) is not None:
        return significant(np.geomspace(span.start, span.stop, span.count)).tolist()
    values = list(factor.values or ())
    numbers = all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values)
    return [float(value) for value in values] if numbers else values


def _unit_points(sampling: Sampling, seed: int, dimensions: int) -> np.ndarray:
    """(samples, dimensions) points in the unit cube; their number and order are as in `sampled_points`."""
    rng = np.random.default_rng(seed)
    if sampling.method == "latin-hypercube":
        return scipy.stats.qmc.LatinHypercube(dimensions, rng=rng).random(sampling.count)
    exponent, apart = int(np.ceil(np.log2(sampling.count))), sampling.method == "saltelli"
    points = scipy.stats.qmc.Sobol(dimensions * (2 if apart else 1), rng=rng).random_base2(exponent)[: sampling.count]
    if not apart:
        return points
    first, second = points[:, :dimensions], points[:, dimensions:]
    mixed = [np.where(np.arange(dimensions) == k, second, first) for k in range(dimensions)]
    return np.concatenate([first, second, *mixed])
