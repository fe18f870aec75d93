"""From what designs are worth to a decision: who keeps the requirements, the Pareto front, and a ranking by weights.

A design's score is the weighted mean of its worth by the preferences, which goes from 0 for the worst to 1 for the
best design to choose from (additive value with swing weights: Keeney and Raiffa, Decisions with Multiple Objectives,
1976).  How far the ranking hangs on the weights is told twice: within which bounds a weight may move alone, and by the
share of all weights at which a design comes first (rank acceptability: Lahdelma, Hokkanen and Salminen, European
Journal of Operational Research 106, 1998).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from prb3r.quantities import Quantity
from prb3r.study.wishes import Criterion, Preference, Requirement

WEIGHT_DRAWS, WEIGHT_SEED = 16_384, 1998
"""Weights drawn, all alike likely: shares are known within 0.4 % (one standard deviation, 0.5 / sqrt(draws))."""
ALL_THE_WEIGHT = 0.99
"""A bound on a weight that lies beyond this share of all weights is none."""
NOT_TO_BE_HAD = -1.0
"""Worth of what a design does not have at all: as far below the worst as the best is above it."""
NO_DIFFERENCE = 1e-9
"""Designs that differ by less than this share in a preference do not differ there: rounding of the solver."""


@dataclass(frozen=True)
class Move:
    """How far the weight of a preference can move before another design comes first, the other weights kept."""

    low: float
    """Least weight, 0 if there is no bound."""
    below: str | None
    """The design that comes first below it."""
    high: float
    """Greatest weight, infinite if there is no bound."""
    above: str | None


@dataclass(frozen=True)
class Decision:
    """`d` designs, what each is worth by `r` requirements and `p` preferences, and what follows from it."""

    designs: list[str]
    requirements: list[Requirement]
    preferences: list[Preference]
    bounded: np.ndarray
    """(d, r) the numbers that requirements bound, over all cases of the design."""
    values: pd.DataFrame
    """(d, p) the numbers of the preferences, over the cases that all designs share."""
    quantities: list[Quantity]
    """Of the requirements, then of the preferences."""
    shared: int
    """Cases that every design has."""
    left_out: int
    """Cases that only some designs have."""
    failed: int
    """Shared cases in which a design that keeps the requirements has no equilibrium: left out in preferences."""

    @cached_property
    def margins(self) -> np.ndarray:
        """(d, r) how far each design is inside each bound, as a share of the bound."""
        rows = [[r.margin(v) for r, v in zip(self.requirements, row, strict=True)] for row in self.bounded]
        return np.array(rows, float).reshape(self.bounded.shape)

    def beside(self, c: int) -> list[float]:
        """The numbers of criterion `c`, requirements before preferences, that are told beside each other."""
        bounds = len(self.requirements)
        if c < bounds:
            return [*self.bounded[:, c].tolist(), self.requirements[c].limit]
        return self.values.iloc[:, c - bounds].tolist()

    @cached_property
    def feasible(self) -> np.ndarray:
        """(d,) whether a design keeps every requirement, that is has no margin below zero."""
        return np.all(self.margins >= 0, axis=1)

    @cached_property
    def scores(self) -> np.ndarray:
        """(d, p), more is better; what a design does not have is infinitely bad."""
        signs = np.array([preference.sign for preference in self.preferences])
        return np.nan_to_num(self.values.to_numpy(float) * signs, nan=-np.inf, posinf=np.inf, neginf=-np.inf)

    @cached_property
    def front(self) -> list[bool]:
        """Whether a design keeps the requirements and none that does is as good in everything, better in something."""
        rivals = self.scores[self.feasible]
        better = lambda a, b: np.all(a >= b) and np.any(a > b)  # noqa: E731
        return [
            bool(able) and not any(better(other, score) for other in rivals)
            for able, score in zip(self.feasible, self.scores, strict=True)
        ]

    @cached_property
    def worth(self) -> np.ndarray:
        """(d, p) from 0 for the worst to 1 for the best design on the front; NaN off the requirements."""
        return self._worth_among(np.array(self.front))

    def _worth_among(self, some: np.ndarray) -> np.ndarray:
        """(d, p) from 0 for the worst to 1 for the best of some designs, a mask (d,); NaN off the requirements."""
        choice = np.where(np.isfinite(self.scores), self.scores, np.nan)[some]
        worth = np.full(self.scores.shape, np.nan)
        if len(choice) and self.preferences:
            low, high = np.nanmin(choice, 0, initial=np.inf), np.nanmax(choice, 0, initial=-np.inf)
            same = ~(high - low > NO_DIFFERENCE * np.maximum(np.abs(low), np.abs(high)))
            scaled = (self.scores - low) / np.where(same, 1.0, high - low)
            worth = np.where(same, 0.0, np.clip(scaled, NOT_TO_BE_HAD, 1.0))
            worth[~self.feasible] = np.nan
        return worth

    @cached_property
    def weights(self) -> np.ndarray:
        """(p,) weights of the preferences, scaled to the sum 1."""
        weights = np.array([preference.weight for preference in self.preferences])
        return weights / weights.sum() if len(weights) else weights

    @cached_property
    def score(self) -> np.ndarray:
        """(d,) weighted mean of the worth; NaN for designs that do not keep the requirements."""
        return self.worth @ self.weights if self.preferences else np.where(self.feasible, 0.0, np.nan)

    @cached_property
    def ranking(self) -> list[int]:
        """The designs that keep the requirements, best first; without preferences the one with most reserve first.

        Where the front tells designs behind it not apart, as it is a single design, all that keep the requirements do.
        """
        keys = [-self.margins.min(1, initial=np.inf)]
        if self.preferences:
            behind = self._worth_among(self.feasible) @ self.weights
            keys = [~np.array(self.front), -self.score, -behind]
        order = np.lexsort(keys[::-1])
        return [int(k) for k in order if self.feasible[k]]

    @property
    def winner(self) -> str | None:
        """The design that is recommended, if any keeps the requirements."""
        return self.designs[self.ranking[0]] if self.ranking else None

    @cached_property
    def win_share(self) -> np.ndarray:
        """(d,) share of all weights at which a design comes first; designs that are level share it."""
        share = np.zeros(len(self.designs))
        choice = np.flatnonzero(self.front)
        if len(choice) and self.preferences:
            draws = np.random.default_rng(WEIGHT_SEED).dirichlet(np.ones(len(self.preferences)), WEIGHT_DRAWS)
            scores = self.worth[choice] @ draws.T
            first = scores >= scores.max(0) - NO_DIFFERENCE
            share[choice] = (first / first.sum(0)).mean(1)
        return share

    @property
    def table(self) -> pd.DataFrame:
        """A row for each design: what requirements and preferences look at, and what follows."""
        columns = {f"required_{name}": self.bounded[:, r] for r, name in enumerate(wish_columns(self.requirements))}
        columns |= {f"requirement_{r + 1}_margin": self.margins[:, r] for r in range(len(self.requirements))}
        follows = {
            "keeps_requirements": self.feasible,
            "on_pareto_front": np.array(self.front),
            "score": self.score,
            "first_share_of_weights": self.win_share,
        }
        return pd.DataFrame({"design": self.designs, **columns, **dict(self.values.reset_index(drop=True)), **follows})

    @property
    def column_quantities(self) -> list[Quantity]:
        """Name, symbol, unit and meaning of the columns of `table` but for `design`, as tables on disk carry them."""
        names = [*(f"required_{name}" for name in wish_columns(self.requirements)), *self.values]
        known = [replace(quantity, name=name) for name, quantity in zip(names, self.quantities, strict=True)]
        return [
            *known,
            *(
                Quantity(f"requirement_{r + 1}_margin", "", "1", "distance inside the bound, as a share of it")
                for r in range(len(self.requirements))
            ),
            Quantity("keeps_requirements", "", "1", "whether every requirement is kept"),
            Quantity("on_pareto_front", "", "1", "whether no design is as good in everything and better in something"),
            Quantity("score", "", "1", "weighted mean of the worth, 0 worst to 1 best"),
            Quantity("first_share_of_weights", "", "1", "share of all weights at which the design comes first"),
        ]

    def move(self, j: int) -> Move:
        """How far the weight of preference `j` can move before the winner changes.

        With share `t` of all weights a design scores ``t worth_j + (1 - t) rest``, the rest by the other weights.
        """
        if len(self.preferences) < 2 or not self.ranking:
            return Move(0.0, None, np.inf, None)
        others = np.delete(self.weights, j)
        rest_weight = float(others.sum() * sum(preference.weight for preference in self.preferences))
        rest, first = np.delete(self.worth, j, 1) @ (others / others.sum()), self.ranking[0]
        low, below, high, above = 0.0, None, np.inf, None
        for k in (k for k in self.ranking[1:] if self.front[k]):
            here, elsewhere = self.worth[first, j] - self.worth[k, j], rest[first] - rest[k]
            level = elsewhere / (elsewhere - here) if here * elsewhere < 0 else 1.0
            if level > ALL_THE_WEIGHT:  # ahead at all weights, or nearly
                continue
            weight = rest_weight * level / (1 - level)
            if here > 0 and weight > low:
                low, below = weight, self.designs[k]
            elif here < 0 and weight < high:
                high, above = weight, self.designs[k]
        return Move(low, below, high, above)

    def excluded_alone(self, r: int) -> list[str]:
        """The designs that would do without requirement `r`."""
        others = np.delete(self.margins, r, 1)
        alone = (others >= 0).all(1) & (self.margins[:, r] < 0)
        return [name for name, out in zip(self.designs, alone, strict=True) if out]


def wish_columns(criteria: Sequence[Criterion]) -> list[str]:
    """Names of columns: the metrics, numbered where one is wanted in several circumstances."""
    metrics = [criterion.metric for criterion in criteria]
    return [
        name if metrics.count(name) == 1 else f"{name}_{metrics[: k + 1].count(name)}" for k, name in enumerate(metrics)
    ]
