"""Which sets of effects explain a recording: those that survive under the noise that the best of them leaves."""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import chi2_threshold
from prb3r.diagnosis.evidence.noise_level import EstimatedLevel
from prb3r.diagnosis.evidence.outliers import Doubts, lone_outliers
from prb3r.diagnosis.evidence.renewal import level_under, renewed
from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.evidence.smooth_moments import chance_of_smooth_moments
from prb3r.diagnosis.fit.least_squares import polished
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.pool import Effects, Pool, Survivor
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.search.twins import twins_of
from prb3r.diagnosis.settings import Settings


@dataclass(frozen=True, eq=False)
class Choice:
    """What selection found."""

    calibrated: Fit
    """The constants alone, under the same noise."""
    fitted: Fit
    """The smallest model that is not much less probable than the best that contains it."""
    tried: tuple[Fit, ...]
    """Every full fit under the same noise, for rivals and the ranking."""
    survivors: tuple[Survivor, ...]
    """Most probable first."""
    scores: Scores
    """Score test of what the chosen model leaves."""
    scores_of_best: Scores
    """The same of the most probable model, which may be larger than what is chosen."""
    smooth_moments: float
    """Chance of as much smooth structure as the most probable model leaves."""
    chi2_threshold: float
    doubts: Doubts
    level: EstimatedLevel
    exchanged: frozenset[Effects] = frozenset()
    """The sets of effects of whose fits every effect was exchanged for what comes nearest; `tried` holds these too."""
    settled: frozenset[Hypothesis] = frozenset()
    """Effects that other recordings show too, so that no rival is sought for them on this one."""
    first_worth: float = -np.inf
    """What the best model of the first beginning is worth, see `worth_of`."""
    share_of_stated: float = 1.0
    """Of the stated noise, what the chosen model leaves; 1 unless it is structured and less than that everywhere."""

    @property
    def structured(self) -> bool:
        """Whether something is left that chance does not explain; a model with effects has been tested before.

        A direction that the most probable model takes is explained, though too weakly to be named.
        """
        scores, again = self.scores_of_best, bool(self.survivors[0].effects)
        limit = scores.naming if again else scores.threshold
        return scores.largest > limit or self.fitted.chi2 > self.chi2_threshold or self.smooth

    @property
    def beyond_stated(self) -> bool:
        """Whether what is left is structured, and more than the recording states of its accuracy."""
        return self.structured and self.share_of_stated >= 1.0

    @property
    def smooth(self) -> bool:
        """Whether moments are left that change smoothly, as noise does not."""
        return self.smooth_moments < self.fitted.model.settings.naming_rate

    @property
    def kinds(self) -> frozenset[str]:
        """The kinds of the effects of the chosen model, such as `worn_hole`; empty where constants alone are chosen."""
        return frozenset(hypothesis.kind for hypothesis in self.fitted.model.hypotheses)

    @property
    def presence(self) -> Mapping[str, float]:
        """Probability that each kind of effect is there, summed over surviving models and places."""
        return presence_of(self.survivors)

    def refuted_by(self, refutes: Callable[[Fit], bool]) -> tuple[Survivor, ...]:
        """Surviving models that something else than what was fitted speaks against, where it does not against what is
        chosen."""
        if refutes(self.fitted):
            return ()
        return tuple(s for s in self.survivors if s.fitted is not self.fitted and refutes(s.fitted))

    def without(self, refuted: Sequence[Survivor]) -> "Choice":
        """The same with the other surviving models alone."""
        left = [survivor for survivor in self.survivors if survivor not in refuted]
        total = sum(survivor.probability for survivor in left)
        survivors = (replace(survivor, probability=survivor.probability / total) for survivor in left)
        return replace(self, survivors=tuple(survivors)) if refuted else self

    @property
    def likely(self) -> Mapping[str, float]:
        """Probability of each kind that is likelier there than not, though what is chosen does without it."""
        return {kind: p for kind, p in self.presence.items() if kind not in self.kinds and p > 0.5}

    @property
    def alternatives(self) -> tuple[frozenset[str], ...]:
        """Sets of kinds of surviving models that lack a chosen kind, the most probable first, with a share that
        counts."""
        settings, shares = self.fitted.model.settings, dict[frozenset[str], float]()
        for survivor in self.survivors:
            if not survivor.kinds >= self.kinds:
                shares[survivor.kinds] = shares.get(survivor.kinds, 0.0) + survivor.probability
        ranked = sorted(shares, key=lambda kinds: -shares[kinds])
        return tuple(kinds for kinds in ranked if shares[kinds] >= settings.alike_rate)


def presence_of(survivors: Sequence[Survivor]) -> Mapping[str, float]:
    """Probability that each kind of effect is there, summed over surviving models and places."""
    kinds = sorted({kind for survivor in survivors for kind in survivor.kinds})
    return {kind: sum(s.probability for s in survivors if kind in s.kinds) for kind in kinds}


class Explored(NamedTuple):
    """A search that has come to an end: the noise is that which its best model leaves."""

    pool: Pool
    doubts: Doubts
    level: EstimatedLevel

    def sought_by(self, search: Search) -> "Explored":
        """The same, to be searched on with other worker processes, or without."""
        pool = copy(self.pool)
        pool.search = search
        return self._replace(pool=pool)

    def chosen(self) -> Fit:
        """The smallest model that is not much less probable than the best, which contains it, as `simplest` has it."""
        return polished(simplest(self.pool.survivors(), self.pool.settings))


def explore_until_settled(pool: Pool, search: Search, doubts: Doubts) -> Explored:
    """Explore, beginning from what `pool` holds, under the noise that the best model leaves."""
    settings, around = pool.settings, Effects()
    expansions = settings.most_expansions
    for _ in range(settings.renewals):
        pool.explore(expansions)
        pool.thin()
        present = frozenset(pool.best.model.hypotheses)
        for twin in twins_of(pool.best, search.library):
            pool.add(twin)
            there = frozenset(twin.model.hypotheses)
            if pool.near(there):
                pool.expand(there, keeping=there - present)
        best = pool.polished_best()
        inflation = doubts.inflation if settings.believe_all else lone_outliers(best, doubts)
        alike = np.array_equal(inflation > 1, doubts.inflation > 1)
        doubts = doubts if alike else replace(doubts, inflation=inflation)
        estimate = level_under(best, doubts, search.library)
        settled = alike and estimate.level.near(doubts.level, settings)
        if settled and around == frozenset(best.model.hypotheses):
            break
        doubts, around = replace(doubts, level=estimate.level), frozenset(best.model.hypotheses)
        pool, expansions = pool.under(renewed(best, doubts).model.noise), settings.later_expansions
    return Explored(pool, doubts, estimate)


def exchange_effects(explored: Explored, search: Search) -> Explored:
    """Exchange every chosen effect for others, and search on from there as long as one of them makes a better model."""
    for _ in range(explored.pool.settings.exchanges):
        if not explored.pool.exchange(explored.chosen()):
            break
        explored = explore_until_settled(explored.pool, search, explored.doubts)
    return explored


def choose(explored: Explored, search: Search) -> Choice:
    """What has been found, with what the chosen model leaves."""
    pool, chosen = explored.pool, explored.chosen()
    survivors = pool.survivors()
    scores, best = examine(chosen, search), survivors[0]
    same = best.effects == frozenset(chosen.model.hypotheses)
    return Choice(
        calibrated=pool.fits[Effects()],
        fitted=chosen,
        tried=tuple(pool.fits.values()),
        survivors=survivors,
        scores=scores,
        scores_of_best=scores if same else examine(best.fitted, search),
        smooth_moments=chance_of_smooth_moments(best.fitted, search.seed),
        chi2_threshold=chi2_threshold(chosen),
        doubts=explored.doubts,
        level=explored.level,
        exchanged=frozenset(pool.exchanged),
    )


def simplest(survivors: Sequence[Survivor], settings: Settings) -> Fit:
    """The smallest part of the most probable model that is within `Settings.simpler_reach` of it in ln evidence and
    has all of its kinds that are certain, as all survivors together have it."""
    best, presence = survivors[0], presence_of(survivors)
    certain = {kind for kind in best.kinds if presence[kind] >= settings.certain}
    parts = [part for part in survivors if part.effects <= best.effects and part.kinds >= certain]
    near = [part for part in parts if part.log_evidence >= best.log_evidence - settings.simpler_reach]
    return min(near, key=lambda part: (len(part.effects), -part.log_evidence)).fitted
