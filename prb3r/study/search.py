"""The search for the best design and along the Pareto front, by differential evolution.

Designs that keep the requirements cost less than those that break one; among the latter, the cost grows with what they
break (Deb, Computer Methods in Applied Mechanics and Engineering 186, 2000, 311).  Several preferences become one cost
by the augmented Chebyshev distance from the best value of each (Steuer and Choo, Mathematical Programming 26, 1983,
326), which finds concave parts of a front too: first with the study's own weights, then with weights spread over all
directions.  Differential evolution (Storn and Price, Journal of Global Optimization 11, 1997, 341) in each direction
starts from designs tried before: half of them are the best ones, the other half is drawn from the rest.
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
"""Added to the cost of a design that breaks a requirement: more than any design that keeps all of them costs."""
NO_VALUE = 1e3
"""Broken share of a requirement, or distance from the best, of a design without a value; larger ones count as this."""
AUGMENTED = 0.05
"""Weight of the sum of all distances beside the largest one; it tells apart designs that share the largest distance.

Steuer and Choo take 0.001 to 0.01 for problems with exact optima; more makes the search converge sooner."""
LEAST_WEIGHT = 0.02
"""Smallest weight of a preference in a direction, before scaling: at 0, designs would give it up for nothing."""
DIRECTIONS = {1: 1, 2: 4, 3: 2}
"""Steps from 0 to 1 of the lattice of weights, by the number of preferences.

With more preferences, each direction weights one of them, and a last one all of them equally."""
FEWEST_IN_GENERATION = 5
"""Designs that differential evolution needs in its first generation."""
LEFT_AT = 1e-3
"""Standard deviation of a generation's costs, relative to their mean, below which a direction is finished."""


@dataclass(frozen=True)
class Evaluated:
    """How well `n` designs meet `r` requirements and `p` preferences."""

    margins: np.ndarray
    """(n, r) distance inside each requirement as a share of its bound, negative outside; -inf without a value."""
    scores: np.ndarray
    """(n, p) value by each preference, signed so that more is better; -inf without a value."""

    def rows(self, which: np.ndarray) -> "Evaluated":
        """Margins and scores of the designs at some rows."""
        return Evaluated(self.margins[which], self.scores[which])

    @property
    def broken(self) -> np.ndarray:
        """(n,) sum over the requirements of the distance outside the bound; 0 where all are kept."""
        return np.minimum(np.maximum(-self.margins, 0.0), NO_VALUE).sum(1)

    def cost(self, weights: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """(n,) cost of each design, less is better; without preferences, minus the smallest margin.

        Parameters
        ----------
        weights : (p,) of the preferences.
        low, high : (p,) scores at distance 1 and 0 from the best.
        """
        if not self.scores.shape[1]:  # the largest reserve
            reserve = np.maximum(self.margins.min(1, initial=np.inf), -NO_VALUE)
            return np.where(self.broken > 0, BROKEN + self.broken, -reserve)
        away = np.minimum((high - self.scores) / np.where(high > low, high - low, 1.0), NO_VALUE) * weights
        return np.where(self.broken > 0, BROKEN + self.broken, away.max(1) + AUGMENTED * away.sum(1))


@dataclass
class Tried:
    """The designs tried so far, in their order, with their margins and scores."""

    judge: Callable[[np.ndarray], Evaluated]
    """Solves and judges designs (n, f) that have not been tried before."""
    most: int
    """Largest number of designs to try."""
    place: dict[tuple[float, ...], int] = field(default_factory=dict)
    """Row of each design tried, by its values."""
    judged: list[Evaluated] = field(default_factory=list)
    """The answers of `judge`, one for each call."""

    def __len__(self) -> int:
        return len(self.place)

    @property
    def designs(self) -> np.ndarray:
        """(n, f) values of the searched factors of every design tried."""
        return np.array(list(self.place))

    @property
    def worth(self) -> Evaluated:
        """Margins and scores of every design tried, in the order of `designs`."""
        return Evaluated(
            *(np.concatenate([getattr(part, name) for part in self.judged]) for name in ("margins", "scores"))
        )

    def ask(self, designs: np.ndarray) -> np.ndarray:
        """(n,) row of each design (n, f) among those tried; new designs are tried up to `most`, the others get -1."""
        new = [row for row in dict.fromkeys(map(tuple, designs.tolist())) if row not in self.place]
        new = new[: self.most - len(self)]
        if new:
            self.judged.append(self.judge(np.array(new)))
            self.place |= {row: len(self) + number for number, row in enumerate(new)}
        return np.array([self.place.get(row, -1) for row in map(tuple, designs.tolist())])


def searched_designs(study: Study, judge: Callable[[np.ndarray], Evaluated]) -> np.ndarray:
    """(n, factors) all designs that the search of a study tries, in their order; equal for equal studies.

    Parameters
    ----------
    judge : solves and judges designs (n, factors).
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
    """(k, p) weights of sum 1 to search the front with: the given ones (p,) first, then a lattice over all."""
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
    """Try designs at the `weights` (p,) of a direction until costs hardly differ, or `most` are tried in total."""
    assert study.search is not None
    factors = study.searched
    scores = tried.worth.scores
    kept = tried.worth.broken == 0
    known = np.where(np.isfinite(scores), scores, np.nan)[kept if kept.any() else slice(None)]
    empty = np.isnan(known).all(0)
    low, high = (pick(np.where(empty, 0.0, known), axis=0) for pick in (np.nanmin, np.nanmax))

    def costs(x: np.ndarray) -> np.ndarray:
        """(n,) costs at coordinates `x` (factors, n), see `_coordinates`; the highest cost for designs not tried."""
        place = tried.ask(_designs(factors, x.T))
        worth = tried.worth.rows(place).cost(weights, low, high)
        return np.where(place >= 0, worth, 2 * BROKEN * NO_VALUE)  # no room left to try it

    def over(intermediate_result: scipy.optimize.OptimizeResult) -> bool:
        return len(tried) >= most

    order = np.argsort(tried.worth.cost(weights, low, high), kind="stable")
    half = study.search.generation // 2
    others = rng.permutation(order[half:])[: study.search.generation - half]
    first = np.concatenate([order[:half], others])
    first = np.resize(first, max(len(first), FEWEST_IN_GENERATION))  # of few possible designs some stand twice
    scipy.optimize.differential_evolution(
        costs,
        [_ends(factor) for factor in factors],
        init=np.stack([_coordinates(factors, tried.designs[row]) for row in first]),
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
    """Bounds of the coordinate of a factor: its low and high, or 0 and its number of steps if it has steps."""
    assert factor.range is not None
    return (0.0, float(factor.range.steps)) if factor.range.steps else (factor.range.low, factor.range.high)


def _designs(factors: list[Factor], x: np.ndarray) -> np.ndarray:
    """(n, factors) designs at coordinates `x` (n, factors), to five digits; coordinates of steps are rounded."""
    columns = []
    for factor, column in zip(factors, x.T, strict=True):
        ends = factor.range
        assert ends is not None
        columns.append(ends.low + ends.step * np.round(column) if ends.steps and ends.step else column)
    return five_digits(np.stack(columns, 1))


def _coordinates(factors: list[Factor], design: np.ndarray) -> np.ndarray:
    """(factors,) coordinates of a design (factors,): for each factor the number of its step, or its value."""
    along = []
    for factor, value in zip(factors, design, strict=True):
        ends = factor.range
        assert ends is not None
        along.append(
            (value - ends.low) / ends.step if ends.steps and ends.step else np.clip(value, ends.low, ends.high)
        )
    return np.array(along)
