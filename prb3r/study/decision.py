"""A decision between designs: which keep the requirements, the Pareto front, and a ranking by weights.

A design's score is the weighted mean of its worth by each preference, which goes from 0 for the worst to 1 for the best
design on the Pareto front (additive value with swing weights: Keeney and Raiffa, Decisions with Multiple Objectives,
1976).  Two numbers tell how far the ranking depends on the weights: the bounds within which one weight may move alone,
and the share of all weights at which a design comes first (rank acceptability: Lahdelma, Hokkanen and Salminen,
European Journal of Operational Research 106, 1998).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pandas as pd

from prb3r.quantities import Quantity
from prb3r.study.designs import Missing
from prb3r.study.wishes import Criterion, Preference, Requirement

WEIGHT_DRAWS, WEIGHT_SEED = 16_384, 1998
"""Number and seed of weights drawn uniformly; shares have a standard error of at most 0.4 % (0.5 / sqrt(draws))."""
ALL_THE_WEIGHT = 0.99
"""Share of the sum of all weights beyond which a bound on a weight counts as none."""
NOT_TO_BE_HAD = -1.0
"""Smallest worth, also that of a missing value: as far below the worst on the front as the best is above it."""
NO_DIFFERENCE = 1e-9
"""Relative difference below which values count as equal, as it may come from rounding in the solver."""
EQUAL_SCORES = 12
"""Decimals to which scores are compared."""


@dataclass(frozen=True)
class Move:
    """How far the weight of a preference can move before another design comes first, the other weights kept."""

    low: float
    """Least weight, 0 if there is no bound."""
    below: str | None
    """The design that comes first below `low`; None if there is no bound."""
    high: float
    """Greatest weight, infinite if there is no bound."""
    above: str | None
    """The design that comes first above `high`; None if there is no bound."""


@dataclass(frozen=True)
class Decision:
    """A decision between `d` designs by `r` requirements and `p` preferences."""

    designs: list[str]
    """Names of the designs."""
    requirements: list[Requirement]
    preferences: list[Preference]
    bounded: np.ndarray
    """(d, r) the number that each requirement bounds, over all cases of the design."""
    values: pd.DataFrame
    """(d, p) the number of each preference, over the cases that all designs share and that count, see `failed`."""
    quantities: list[Quantity]
    """Unit and meaning of the requirements' columns, then of the preferences' columns."""
    shared: int
    """Number of cases (scenarios) that every design has."""
    left_out: int
    """Number of cases (scenarios) that only some designs have."""
    failed: int
    """Number of shared cases that preferences leave out, as a design that keeps the requirements fails in them; where
    no design keeps them, as any design fails."""
    fails: Sequence[int] = ()
    """(d,) number of shared cases without a stable equilibrium in which a preference has no value of the design; empty:
    none."""
    missing: Mapping[tuple[int, int], Missing] = field(default_factory=dict)
    """By number of the design and of the requirement, the cases without a value, where there are any."""
    counted: Sequence[int] = ()
    """Number of those cases that each preference is over, as it may name some of them alone; empty: all of them."""
    remark: str = ""
    """What is to be known of what tells the designs apart, as a sentence."""

    @property
    def alone(self) -> bool:
        """Whether there is a single design, which requirements can judge and nothing can rank."""
        return len(self.designs) == 1 and bool(self.requirements)

    @cached_property
    def margins(self) -> np.ndarray:
        """(d, r) distance of each design inside each bound, negative outside, as a share of the bound."""
        rows = [[r.margin(v) for r, v in zip(self.requirements, row, strict=True)] for row in self.bounded]
        return np.array(rows, float).reshape(self.bounded.shape)

    def beside(self, c: int) -> list[float]:
        """All numbers that are shown together for criterion `c`: of the designs, and the bound of a requirement.

        Criteria are numbered from 0, requirements before preferences.
        """
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
        """(d, p) values by each preference, signed so that more is better; -inf where a design has none."""
        signs = np.array([preference.sign for preference in self.preferences])
        return np.nan_to_num(self.values.to_numpy(float) * signs, nan=-np.inf, posinf=np.inf, neginf=-np.inf)

    @cached_property
    def front(self) -> list[bool]:
        """(d,) whether a design is on the Pareto front.

        It then keeps the requirements, and no other design that keeps them is at least as good by every preference and
        better by one.
        """
        rivals = self.scores[self.feasible]
        better = lambda a, b: np.all(a >= b) and np.any(a > b)  # noqa: E731
        return [
            bool(able) and not any(better(other, score) for other in rivals)
            for able, score in zip(self.feasible, self.scores, strict=True)
        ]

    @cached_property
    def worth(self) -> np.ndarray:
        """(d, p) worth by each preference, from 0 for the worst to 1 for the best design on the front.

        It is clipped to `NOT_TO_BE_HAD` and 1, 0 where the front does not differ, and NaN for designs that break a
        requirement.  Beside designs without a value those with one value are worth 1.
        """
        return self._worth_among(np.array(self.front))

    def _worth_among(self, some: np.ndarray) -> np.ndarray:
        """(d, p) worth as in `worth`, measured between the worst and best of the designs in the mask `some` (d,)."""
        choice = np.where(np.isfinite(self.scores), self.scores, np.nan)[some]
        worth = np.full(self.scores.shape, np.nan)
        if len(choice) and self.preferences:
            low, high = np.nanmin(choice, 0, initial=np.inf), np.nanmax(choice, 0, initial=-np.inf)
            same = ~(high - low > NO_DIFFERENCE * np.maximum(np.abs(low), np.abs(high)))
            with np.errstate(invalid="ignore"):  # where all are without bound, `low` is infinite, and they are the same
                scaled = (self.scores - low) / np.where(same, 1.0, high - low)
            worth = np.where(same, 0.0, np.clip(scaled, NOT_TO_BE_HAD, 1.0))
            lacking = np.isneginf(self.scores) & np.isfinite(high)
            worth[np.isfinite(self.scores) & same & lacking[some].any(0)] = 1.0
            worth[lacking] = NOT_TO_BE_HAD
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
    def score_of_kept(self) -> np.ndarray:
        """(d,) score as in `score`, but measured between the worst and best of all designs that keep the requirements.

        It tells designs apart where the front is a single one.
        """
        return self._worth_among(self.feasible) @ self.weights if self.preferences else self.score

    @cached_property
    def ranking(self) -> list[int]:
        """Indices of the designs that keep the requirements, best first; without preferences, by their smallest margin.

        Designs on the front come first, then higher scores.  Designs of equal score (a front of a single design gives
        all the score 0) are ranked by `score_of_kept`, and then by their smallest margin.
        """
        keys = [-self.margins.min(1, initial=np.inf)]
        if self.preferences:
            scores = (-np.round(score, EQUAL_SCORES) for score in (self.score, self.score_of_kept))
            keys = [~np.array(self.front), *scores, *keys]
        order = np.lexsort(keys[::-1])
        return [int(k) for k in order if self.feasible[k]]

    @property
    def winner(self) -> str | None:
        """Name of the recommended design; None if no design keeps the requirements."""
        return self.designs[self.ranking[0]] if self.ranking else None

    @cached_property
    def win_share(self) -> np.ndarray:
        """(d,) share of all weights, drawn uniformly, at which a design comes first; equal scores share the place."""
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
        """A row for each design: its numbers by requirements and preferences, margins, and results of the decision."""
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
        """Name, symbol, unit and meaning of the columns of `table` except `design`."""
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
        """Bounds within which the weight of preference `j` can move, the other weights kept, before the winner changes.

        If preference `j` has the share `t` of all weights, a design scores ``t worth_j + (1 - t) rest``, where `rest`
        is its score by the other weights.
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
            if level > ALL_THE_WEIGHT:  # the winner stays ahead at nearly all weights
                continue
            weight = rest_weight * level / (1 - level)
            if here > 0 and weight > low:
                low, below = weight, self.designs[k]
            elif here < 0 and weight < high:
                high, above = weight, self.designs[k]
        return Move(low, below, high, above)

    def excluded_alone(self, r: int) -> list[str]:
        """Names of the designs that break requirement `r` and no other one, for another reason than `unsolved`."""
        others = np.delete(self.margins, r, 1)
        alone = (others >= 0).all(1) & (self.margins[:, r] < 0)
        return [name for k, name in enumerate(self.designs) if alone[k] and not self.unsolved[k, r]]

    @cached_property
    def unsolved(self) -> np.ndarray:
        """(d, r) whether a design breaks a requirement as a case that counts has no stable equilibrium."""
        lost = np.zeros(self.margins.shape, bool)
        for place, missing in self.missing.items():
            lost[place] = missing.unsolved > 0 and self.margins[place] < 0
        return lost


def wish_columns(criteria: Sequence[Criterion]) -> list[str]:
    """Names of columns for criteria: their metrics, with a number where several criteria have the same metric."""
    metrics = [criterion.metric for criterion in criteria]
    return [
        name if metrics.count(name) == 1 else f"{name}_{metrics[: k + 1].count(name)}" for k, name in enumerate(metrics)
    ]
