"""Selection: which sets of effects explain a recording under the noise that the best of them leaves, and which of them
is chosen."""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import chi2_threshold
from prb3r.diagnosis.evidence.noise_level import EstimatedLevel
from prb3r.diagnosis.evidence.outliers import Doubts, lone_outliers
from prb3r.diagnosis.evidence.renewal import level_under
from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.evidence.smooth_moments import chance_of_smooth_moments
from prb3r.diagnosis.fit.least_squares import polished
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.exchange import with_confounded
from prb3r.diagnosis.search.pool import Effects, Pool, Survivor
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.search.twins import in_special_forms, twins_of
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects import EFFECT_KINDS


@dataclass(frozen=True, eq=False)
class Choice:
    """The model that is chosen for a recording, with all that survive and what was tried."""

    calibrated: Fit
    """The constants alone, under the same noise."""
    fitted: Fit
    """The chosen model: the smallest part of the most probable one that is not much less probable (`simplest`)."""
    tried: tuple[Fit, ...]
    """Every full fit under the same noise; rivals and the ranking are taken from these."""
    survivors: tuple[Survivor, ...]
    """Surviving models, most probable first; of the first ones that are nearly as probable, the one that explains the
    recording with the fewest effects stands before them (:func:`choose`)."""
    scores: Scores
    """Score test of what the chosen model leaves."""
    scores_of_best: Scores
    """Score test of what the most probable model leaves, which may be larger than the chosen one."""
    smooth_moments: float
    """The p-value of the smooth structure that the most probable model leaves (:func:`chance_of_smooth_moments`)."""
    chi2_threshold: float
    """Critical value of the chosen model's chi-square: above it the residuals are structured."""
    doubts: Doubts
    """Readings and weights that are not believed, and the noise level under which all is fitted."""
    level: EstimatedLevel
    """The noise level estimated from the best model."""
    exchanged: frozenset[Effects] = frozenset()
    """Sets of effects every one of whose effects was exchanged; `tried` holds the replacements too."""
    settled: frozenset[Hypothesis] = frozenset()
    """Effects that other recordings show too, so that no rival is sought for them on this one."""
    worth_of_first_start: float = -np.inf
    """The worth of the best model found from the first start (`worth_of`)."""
    begun: "Explored | None" = None
    """The search from the first start where the search ended there, to go on from; None where it did not end there."""
    share_of_stated: float = 1.0
    """Root mean square of the residuals of a structured choice over the stated noise: below 1 if they are smaller than
    stated everywhere, else 1 or more (function `share_of_stated`); 1 for a choice that is not structured."""

    @property
    def structured(self) -> bool:
        """Whether the residuals hold more than noise.

        Scores and smooth moments are those of the most probable model: what its further effects take up is explained,
        though too weakly for these to be named.  If it has effects, the stricter `Scores.naming` is the critical value,
        as the search has already tested many models.
        """
        scores, again = self.scores_of_best, bool(self.survivors[0].effects)
        limit = scores.naming if again else scores.threshold
        return scores.largest > limit or self.fitted.chi2 > self.chi2_threshold or self.smooth

    @property
    def by_score_alone(self) -> bool:
        """Whether the residuals are structured by their largest score alone, and that one is beyond `Scores.threshold`
        and not beyond `Scores.naming`."""
        faint = self.scores_of_best.largest <= self.scores_of_best.naming
        return self.structured and faint and self.fitted.chi2 <= self.chi2_threshold and not self.smooth

    @property
    def beyond_stated(self) -> bool:
        """Whether the residuals are structured and larger than the stated accuracy of the recording."""
        return self.structured and self.share_of_stated >= 1.0

    @property
    def smooth(self) -> bool:
        """Whether the residuals show missing moments that vary smoothly between plates or loads, unlike noise."""
        return self.smooth_moments < self.fitted.model.settings.naming_rate

    @property
    def kinds(self) -> frozenset[str]:
        """The kinds of the effects of the chosen model, such as `worn_hole`; empty where constants alone are chosen."""
        return frozenset(hypothesis.kind for hypothesis in self.fitted.model.hypotheses)

    @property
    def effects(self) -> Effects:
        """The hypotheses of the chosen model, in no order."""
        return frozenset(self.fitted.model.hypotheses)

    @property
    def presence(self) -> Mapping[str, float]:
        """Probability that each kind of effect is present, summed over surviving models and places."""
        return presence_of(self.survivors)

    def refuted_by(self, refutes: Callable[[Fit], bool]) -> tuple[Survivor, ...]:
        """The surviving models, other than the chosen one, that held-out data refute; none if the chosen one is too.

        Parameters
        ----------
        refutes : returns whether held-out data contradict a fit.
        """
        if refutes(self.fitted):
            return ()
        return tuple(s for s in self.survivors if s.effects != self.effects and refutes(s.fitted))

    def without(self, refuted: Sequence[Survivor]) -> "Choice":
        """The choice without the `refuted` survivors; the probabilities of the others sum to 1 again."""
        left = [survivor for survivor in self.survivors if survivor not in refuted]
        total = sum(survivor.probability for survivor in left)
        survivors = (replace(survivor, probability=survivor.probability / total) for survivor in left)
        return replace(self, survivors=tuple(survivors)) if refuted else self

    def probability_of(self, hypothesis: Hypothesis) -> float:
        """Probability that a chosen effect is present, at its place or another one.

        Several chosen effects of one kind are ranked by the probability of their places.  That of rank n is present in
        the surviving models that have at least n effects of the kind.
        """
        same = [other for other in self.fitted.model.hypotheses if other.kind == hypothesis.kind]
        same.sort(key=lambda other: -sum(s.probability for s in self.survivors if other in s.effects))
        number = same.index(hypothesis)
        having = (s for s in self.survivors if sum(other.kind == hypothesis.kind for other in s.effects) > number)
        return sum(survivor.probability for survivor in having)

    @property
    def likely(self) -> Mapping[str, float]:
        """Probability of what the chosen model lacks although it is more likely present than absent.

        These are kinds of effects, by kind, and, if the kind is chosen at other places, effects at their place, by
        name; none of a kind that a manipulator has but once.
        """
        kinds = {kind: p for kind, p in self.presence.items() if kind not in self.kinds and p > 0.5}
        elsewhere = dict[str, float]()
        for survivor in self.survivors:
            for one in survivor.effects - self.effects:
                same = any(one.generalises(chosen) or chosen.generalises(one) for chosen in self.effects)
                if one.kind in self.kinds and not same and not EFFECT_KINDS[one.kind].once:
                    elsewhere[one.name] = elsewhere.get(one.name, 0.0) + survivor.probability
        return kinds | {name: p for name, p in elsewhere.items() if p > 0.5}

    def tried_with(self, hypothesis: Hypothesis) -> list[Fit]:
        """The full fits of models with an effect."""
        return [fitted for fitted in self.tried if hypothesis in fitted.model.hypotheses]

    @property
    def of_any(self) -> float:
        """Probability that any effect is present."""
        return sum(survivor.probability for survivor in self.survivors if survivor.effects)

    @property
    def alternatives(self) -> tuple[frozenset[str], ...]:
        """Sets of kinds of surviving models that lack a chosen kind, the most probable first.

        Only sets whose probability, summed over their models, is `Settings.alike_rate` or more.
        """
        settings, shares = self.fitted.model.settings, dict[frozenset[str], float]()
        for survivor in self.survivors:
            if not survivor.kinds >= self.kinds:
                shares[survivor.kinds] = shares.get(survivor.kinds, 0.0) + survivor.probability
        ranked = sorted(shares, key=lambda kinds: -shares[kinds])
        return tuple(kinds for kinds in ranked if shares[kinds] >= settings.alike_rate)


def presence_of(survivors: Sequence[Survivor]) -> Mapping[str, float]:
    """Probability that each kind of effect is present, summed over the models and places of `survivors`."""
    kinds = sorted({kind for survivor in survivors for kind in survivor.kinds})
    return {kind: sum(s.probability for s in survivors if kind in s.kinds) for kind in kinds}


class Explored(NamedTuple):
    """A finished search, under the noise estimated from its best model."""

    pool: Pool
    doubts: Doubts
    """Readings and weights that are not believed, and the noise level of the pool."""
    level: EstimatedLevel
    """The noise level as the best model of the pool tells it."""

    def sought_by(self, search: Search) -> "Explored":
        """A copy whose pool uses another `search`, such as one that runs tasks in other worker processes."""
        pool = copy(self.pool)
        pool.search = search
        return self._replace(pool=pool)

    def chosen(self) -> Fit:
        """The smallest part of the best model that is not much less probable (:func:`simplest`), fitted until it
        converges."""
        return polished(simplest(self.pool.survivors(), self.pool.settings))


def explore_until_settled(pool: Pool, search: Search, doubts: Doubts) -> Explored:
    """Search from the models of `pool`, and estimate the noise anew from the best model until both no longer change.

    At most `Settings.renewals` rounds of search are made.
    """
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
        noise = doubts.noise(best.model.predict, best.solved, settings)
        pool, expansions = pool.under(noise), settings.later_expansions
    return Explored(pool, doubts, estimate)


def exchange_effects(explored: Explored, search: Search) -> Explored:
    """Exchange the effects of the chosen model for others, and try special forms of those of all surviving models and
    effects that leave the constants much less certain.

    Exchanges are repeated, each time followed by another search, as long as they find a better model, at most
    `Settings.exchanges` times.
    """
    for _ in range(explored.pool.settings.exchanges):
        if not explored.pool.exchange(explored.chosen()):
            break
        explored = explore_until_settled(explored.pool, search, explored.doubts)
    for survivor in explored.pool.survivors():
        for special in in_special_forms(survivor.fitted, search.library):
            explored.pool.add(special)
    for wider in with_confounded(explored.chosen(), search):
        explored.pool.add(wider)
    return explored


def begun_anew(explored: Explored, search: Search) -> Explored | None:
    """A further search from a better fit of the best model, begun at random points around it (`Pool.restart`).

    A fit ends in the valley of chi-square that it begins in, and where plates soften until something stops them there
    are several.  None if no fit is better, if predictions are slow, or if the best model has no effects.
    """
    pool = explored.pool
    if pool.best.costly or not pool.best.model.hypotheses or not pool.restart():
        return None
    return exchange_effects(explore_until_settled(pool, search, explored.doubts), search)


def choose(explored: Explored, search: Search) -> Choice:
    """The choice at the end of a search, with tests of the residuals of the chosen and of the most probable model.

    The evidence does not tell whether a model leaves structured residuals.  If the most probable model does, another
    one that leaves none takes its place, unless the former is strongly more probable (`Settings.simpler_reach`); all
    effects of the other model must then be named.  Models within `Settings.better_exchanged` of the most probable one
    count as equally probable, as so small a difference depends on rounding; the one that names the fewest effects is
    taken first.  If all leave structured residuals, the most probable model is kept.
    """
    survivors, settings = explored.pool.survivors(), explored.pool.settings
    behind = {survivor: survivors[0].log_evidence - survivor.log_evidence for survivor in survivors}
    ranked = list[tuple[float, int, tuple[Survivor, ...]]]()
    for first in (near for near in survivors if behind[near] <= settings.simpler_reach):
        order = (first, *(other for other in survivors if other is not first))
        named = simplest(order, settings).model.hypotheses
        if behind[first] <= settings.better_exchanged:
            ranked.append((0.0, len(named), order))
        elif frozenset(named) == first.effects:
            ranked.append((behind[first], 0, order))
    choices = []
    for *_, order in sorted(ranked, key=lambda each: each[:2]):
        choices.append(_choice_of(order, explored, search))
        if not choices[-1].structured:
            return choices[-1]
    return next(choice for choice in choices if choice.survivors[0] is survivors[0])


def _choice_of(survivors: tuple[Survivor, ...], explored: Explored, search: Search) -> Choice:
    """The choice if the first of the `survivors` is taken as the most probable model."""
    pool, best = explored.pool, survivors[0]
    chosen = polished(simplest(survivors, pool.settings))
    scores = examine(chosen, search)
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
    """The surviving model with the fewest effects, all of them in the most probable one.

    Its ln evidence is within `Settings.simpler_reach` of that model, and it has every kind of that model whose
    probability over all survivors is `Settings.certain` or more.
    """
    best, presence = survivors[0], presence_of(survivors)
    certain = {kind for kind in best.kinds if presence[kind] >= settings.certain}
    parts = [part for part in survivors if part.effects <= best.effects and part.kinds >= certain]
    near = [part for part in parts if part.log_evidence >= best.log_evidence - settings.simpler_reach]
    return min(near, key=lambda part: (len(part.effects), -part.log_evidence)).fitted
