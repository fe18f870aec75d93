"""Which designs to try next: differential evolution toward the best design, and along the Pareto front.

Designs that keep the requirements come before those that break one, and of these the less they break (Deb, Computer
Methods in Applied Mechanics and Engineering 186, 2000, 311).  Several preferences are one number by the augmented
Chebyshev distance from the best of each (Steuer and Choo, Mathematical Programming 26, 1983, 326), which finds concave
parts of a front too: once with the study's own weights, then with weights spread over all directions.  Every direction
begins with the best that the ones before have tried (Storn and Price, Journal of Global Optimization 11, 1997, 341).
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy

from prb3r.study.axes import first_designs, five_digits
from prb3r.study.factors import Factor
from prb3r.study.spec import Study

BROKEN = 1e6
"""Added to the cost of a design that breaks a requirement: more than any that keeps them can cost."""
NO_VALUE = 1e3
"""What counts as broken, or as distance from the best, where a design has no value: beyond all that have one."""
AUGMENTED = 0.05
"""Weight of the sum of all distances beside the largest, which tells designs apart that share the largest: Steuer and
Choo take 0.001 to 0.01 of a problem with exact optima; more settles the search sooner."""
LEAST_WEIGHT = 0.02
"""No preference is left out of a direction, or designs would be found that waste it for nothing."""
DIRECTIONS = {1: 1, 2: 4, 3: 2}
"""Parts that each weight is divided into, by the number of preferences; of more, directions have one or all of them."""
LEFT_AT = 1e-3
"""Spread of a generation's costs, of their mean, at which a direction is left."""


@dataclass(frozen=True)
class Judged:
    """What designs are worth."""

    margins: np.ndarray
    """(n, r) how far inside each requirement, as a share of its bound; -inf without a value."""
    scores: np.ndarray
    """(n, p) by each preference, more is better; -inf without a value."""

    def rows(self, which: np.ndarray) -> "Judged":
        """What the designs in some rows are worth."""
        return Judged(self.margins[which], self.scores[which])

    @property
    def broken(self) -> np.ndarray:
        """(n,) sum of what is broken of the requirements; 0 where all are kept."""
        return np.minimum(np.maximum(-self.margins, 0.0), NO_VALUE).sum(1)

    def cost(self, weights: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """(n,) less is better: by the `weights` (p,) and the worst and best of each preference to measure by."""
        if not self.scores.shape[1]:  # the largest reserve
            reserve = np.maximum(self.margins.min(1, initial=np.inf), -NO_VALUE)
            return np.where(self.broken > 0, BROKEN + self.broken, -reserve)
        away = np.minimum((high - self.scores) / np.where(high > low, high - low, 1.0), NO_VALUE) * weights
        return np.where(self.broken > 0, BROKEN + self.broken, away.max(1) + AUGMENTED * away.sum(1))


@dataclass
class Tried:
    """Designs that have been tried, in their order, and what they are worth."""

    judge: Callable[[np.ndarray], Judged]
    """What (n, f) designs are worth that have not been tried before."""
    most: int
    """So many are tried."""
    place: dict[tuple[float, ...], int] = field(default_factory=dict)
    """Number of each design that was tried, by its values."""
    judged: list[Judged] = field(default_factory=list)
    """What the designs of each call of `judge` are worth, in their order."""

    def __len__(self) -> int:
        return len(self.place)

    @property
    def designs(self) -> np.ndarray:
        """(n, f) values of the searched factors of every design tried."""
        return np.array(list(self.place))

    @property
    def worth(self) -> Judged:
        """What every design tried is worth, in the order of `designs`."""
        return Judged(
            *(np.concatenate([getattr(part, name) for part in self.judged]) for name in ("margins", "scores"))
        )

    def ask(self, designs: np.ndarray) -> np.ndarray:
        """(n,) place of each design; those that are new are tried, as far as there is room; -1 of what is not."""
        new = [row for row in dict.fromkeys(map(tuple, designs.tolist())) if row not in self.place]
        new = new[: self.most - len(self)]
        if new:
            self.judged.append(self.judge(np.array(new)))
            self.place |= {row: len(self) + number for number, row in enumerate(new)}
        return np.array([self.place.get(row, -1) for row in map(tuple, designs.tolist())])


def searched_designs(study: Study, judge: Callable[[np.ndarray], Judged]) -> np.ndarray:
    """(n, factors) every design that the search of a study has tried, in their order; the same for the same study.

    Parameters
    ----------
    judge : what (n, factors) designs are worth.
    """
    assert study.search is not None
    tried = Tried(judge, study.search.designs)
    tried.ask(first_designs(study))
    weights = directions(np.array([preference.weight for preference in study.preference]))
    for number, direction in enumerate(weights):
        share = (study.search.designs - len(tried)) // (len(weights) - number)
        if share > 0:
            _evolve(study, tried, direction, np.random.default_rng([study.seed, number]), len(tried) + share)
    return tried.designs


def directions(weights: np.ndarray) -> np.ndarray:
    """(k, p) weights of sum 1 to look for the front by: the given ones first, then a lattice over all."""
    count = len(weights)
    if not count:
        return np.ones((1, 0))
    parts = DIRECTIONS.get(count, 1)
    lattice = [row for row in itertools.product(range(parts + 1), repeat=count) if sum(row) == parts]
    rows = [weights / weights.sum(), *(np.array(row) / parts for row in lattice if count > 1)]
    if count not in DIRECTIONS:
        rows.append(np.full(count, 1 / count))
    rows = [np.maximum(row, LEAST_WEIGHT) for row in rows]
    apart = [row for number, row in enumerate(rows) if not any(np.allclose(row, other) for other in rows[:number])]
    return np.array(apart) / np.sum(apart, axis=1, keepdims=True)


def _evolve(study: Study, tried: Tried, weights: np.ndarray, rng: np.random.Generator, most: int) -> None:
    """Try designs in one direction until they no longer differ, or `most` have been tried in all."""
    assert study.search is not None
    factors = study.searched
    scores = tried.worth.scores
    kept = tried.worth.broken == 0
    known = np.where(np.isfinite(scores), scores, np.nan)[kept if kept.any() else slice(None)]
    empty = np.isnan(known).all(0)
    low, high = (pick(np.where(empty, 0.0, known), axis=0) for pick in (np.nanmin, np.nanmax))

    def costs(x: np.ndarray) -> np.ndarray:
        """(n,) cost of each column of `x` (factors, n), from 0 to 1; of what there is no room for, the most."""
        place = tried.ask(_designs(factors, x.T))
        worth = tried.worth.rows(place).cost(weights, low, high)
        return np.where(place >= 0, worth, 2 * BROKEN * NO_VALUE)  # no room left to try it

    def over(intermediate_result: scipy.optimize.OptimizeResult) -> bool:
        return len(tried) >= most

    order = np.argsort(tried.worth.cost(weights, low, high), kind="stable")
    half = study.search.generation // 2
    others = rng.permutation(order[half:])[: study.search.generation - half]
    scipy.optimize.differential_evolution(
        costs,
        [_ends(factor) for factor in factors],
        init=np.stack([_coordinates(factors, tried.designs[row]) for row in (*order[:half], *others)]),
        maxiter=most,  # generations: more than can be tried
        callback=over,
        integrality=[factor.range is not None and factor.range.steps > 0 for factor in factors],
        tol=LEFT_AT,
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=rng,
    )


def _ends(factor: Factor) -> tuple[float, float]:
    """Ends of a coordinate: the factor itself, or the number of its step."""
    assert factor.range is not None
    return (0.0, float(factor.range.steps)) if factor.range.steps else (factor.range.low, factor.range.high)


def _designs(factors: list[Factor], x: np.ndarray) -> np.ndarray:
    """(n, factors) values of the factors, to five digits, at coordinates (n, factors), rounded to whole steps."""
    columns = []
    for factor, column in zip(factors, x.T, strict=True):
        ends = factor.range
        assert ends is not None
        columns.append(ends.low + ends.step * np.round(column) if ends.steps and ends.step else column)
    return five_digits(np.stack(columns, 1))


def _coordinates(factors: list[Factor], design: np.ndarray) -> np.ndarray:
    """(factors,) coordinates of a design's values: the number of the step, or the value within its range."""
    along = []
    for factor, value in zip(factors, design, strict=True):
        ends = factor.range
        assert ends is not None
        along.append(
            (value - ends.low) / ends.step if ends.steps and ends.step else np.clip(value, ends.low, ends.high)
        )
    return np.array(along)
