"""The models fitted in full under one covariance: which to expand, which sets of effects to fit next, which survive.

A model is expanded at most once: around its fit thousands of sets of effects are compared in the linearised model, and
the best of the new sets are fitted in full.  These sets are sought from the empty one and from that of the fit.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.least_squares import fit, polished
from prb3r.diagnosis.fit.model import Fit, Model
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.columns import beginning, linear_model
from prb3r.diagnosis.search.exchange import replacements_of, without_effect
from prb3r.diagnosis.search.linear_selection import LinearModel, best_sets, worth_fitting
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.settings import Settings

Effects = frozenset[Hypothesis]
"""The set of effects of a model, by which its fits are known."""


@dataclass(frozen=True, eq=False)
class Survivor:
    """A model whose evidence is within reach of the best, so that the recording does not rule it out."""

    fitted: Fit
    log_evidence: float
    """Natural logarithm of the Laplace evidence, prior odds included, up to a constant."""
    probability: float
    """Posterior probability among all survivors."""

    @property
    def effects(self) -> Effects:
        """The hypotheses of the model, in no order."""
        return frozenset(self.fitted.model.hypotheses)

    @property
    def kinds(self) -> frozenset[str]:
        """The kinds of the effects of the model, such as `worn_hole`; an effect at two places counts once."""
        return frozenset(hypothesis.kind for hypothesis in self.effects)


class Pool:
    """All models that were fitted in full under one covariance, by their sets of effects.

    `expanded`, `exchanged` and `thinned` hold the sets for which that was done already.
    """

    def __init__(self, search: Search, settings: Settings, fits: Iterable[Fit | None]) -> None:
        self.search, self.settings = search, settings
        self.fits: dict[Effects, Fit] = {}
        self.evidence: dict[Effects, float] = {}
        self.expanded: set[Effects] = set()
        self.exchanged: set[Effects] = set()
        self.thinned: set[Effects] = set()
        for fitted in fits:
            self.add(fitted)

    def add(self, fitted: Fit | None) -> None:
        """Keep a fit if none of the same effects has as much evidence; one without finite evidence is never kept."""
        if fitted is None:
            return
        effects, worth = frozenset(fitted.model.hypotheses), log_evidence(fitted, self.search.log_odds)
        if worth > self.evidence.get(effects, -np.inf):
            self.fits[effects], self.evidence[effects] = fitted, worth

    @property
    def ranked(self) -> list[Effects]:
        """The sets of effects that were fitted in full, largest evidence first."""
        return sorted(self.fits, key=lambda effects: -self.evidence[effects])

    @property
    def best(self) -> Fit:
        """The full fit with the largest evidence."""
        return self.fits[self.ranked[0]]

    def polished_best(self) -> Fit:
        """The fit with the largest evidence, begun again until it converges, as the noise is estimated from it."""
        effects = self.ranked[0]
        self.fits[effects] = polished(self.fits[effects])
        self.evidence[effects] = log_evidence(self.fits[effects], self.search.log_odds)
        return self.best

    def explore(self, most: int) -> None:
        """Expand promising models, the best first, until none is left or `most` expansions are spent, of which a slow
        one counts as `Settings.costly_price`."""
        spent = 0.0
        while spent < most:
            fresh = next((effects for effects in self.ranked if self._promising(effects)), None)
            if fresh is None:
                break
            spent += self.settings.costly_price if self.fits[fresh].costly else 1.0
            self.expand(fresh)

    def _promising(self, effects: Effects) -> bool:
        """Whether a model is near the best, not yet expanded, and has more evidence than every model that is a part of
        it."""
        worth = self.evidence[effects]
        idle = any(other < effects and better >= worth for other, better in self.evidence.items())
        return self.near(effects) and not idle and effects not in self.expanded

    def near(self, effects: Effects) -> bool:
        """Whether the ln evidence of a fitted model is within `Settings.expansion_reach` of the best."""
        worth = self.evidence.get(effects, -np.inf)
        return worth >= self.evidence[self.ranked[0]] - self.settings.expansion_reach

    def expand(self, effects: Effects, keeping: Effects = frozenset()) -> None:
        """Fit in full the new sets of effects that the linearised model around the fit of `effects` ranks highest.

        Parameters
        ----------
        keeping : effects of that fit that every set to be fitted must have.
        """
        fitted, settings = self.fits[effects], self.settings
        self.expanded.add(effects)
        linear, present = self.linearised(fitted)
        most = min(len(present) + settings.most_new, settings.most_effects)
        kept = frozenset(k for k in present if linear.columns[k].hypothesis in keeping)
        sets = [
            proposal
            for proposal in best_sets(linear, [frozenset(), present], settings, most)
            if kept <= proposal.chosen
        ]
        base, tasks = linear.evidence(present), []
        count = settings.costly_proposals if fitted.costly else settings.proposals
        for proposal in worth_fitting(sets, len(present), count, settings.small_steps):
            hypotheses, start = self.beginning(fitted, linear, sorted(proposal.chosen))
            costly = any(hypothesis.costly for hypothesis in set(hypotheses) - effects)
            least = base + settings.costly_gain if costly else base - settings.proposal_reach
            if frozenset(hypotheses) not in self.fits and proposal.evidence >= least:
                model = replace(fitted.model, hypotheses=hypotheses)
                tasks.append((model, start, self._give_up_above(hypotheses)))
        for richer in self.search.apply(_fitted, tasks):
            self.add(richer)

    def exchange(self, fitted: Fit) -> bool:
        """Fit the most promising replacements of every effect of a model.

        Returns whether the largest ln evidence rises by more than `Settings.better_exchanged`.  Nothing is fitted for a
        model that leaves much unexplained, as there no single effect stands in for another.
        """
        before, effects = self.evidence[self.ranked[0]], frozenset(fitted.model.hypotheses)
        if effects in self.exchanged or fitted.reduced > self.settings.gross:
            return False
        self.exchanged.add(effects)
        for other in replacements_of(fitted, range(len(effects)), self.search):
            self.add(other)
        self.fit_parts()
        return self.evidence[self.ranked[0]] - before > self.settings.better_exchanged

    def restart(self) -> bool:
        """Fit the best model anew from `Settings.restarts` random points around its fit.

        Each parameter is scattered by `Settings.restart_sd` posterior standard deviations, or by that of its prior if
        this is less.  Returns whether the largest ln evidence rises by more than `Settings.better_exchanged`.
        """
        before, best = self.evidence[self.ranked[0]], self.best
        posterior = np.sqrt(np.diag(best.covariance))
        scatter = np.minimum(self.settings.restart_sd * posterior, best.model.deviations)
        away = np.random.default_rng(self.search.seed).standard_normal((self.settings.restarts, len(best.p)))
        limit = self._give_up_above(best.model.hypotheses)
        for again in self.search.apply(_fitted, [(best.model, best.p + scatter * each, limit) for each in away]):
            self.add(again)
        return self.evidence[self.ranked[0]] - before > self.settings.better_exchanged

    def thin(self) -> None:
        """Leave one effect after another out of the best model as long as the model without it is more probable.

        The linearised model is a poor guide to which effect of a large model can be left out, as effects that replace
        each other around the fit may not do so once one of them is gone.  So each of the effects whose removal costs
        least in the linearised model is left out in a full fit.
        """
        while (effects := self.ranked[0]) and effects not in self.thinned:
            self.thinned.add(effects)
            fitted = self.fits[effects]
            for hypothesis in self._least_missed(fitted):
                limit = self._give_up_above([*effects - {hypothesis}])
                self.add(without_effect(fitted, fitted.model.hypotheses.index(hypothesis), limit))
                if self.ranked[0] != effects:
                    break

    def fit_parts(self) -> None:
        """Fit every surviving model without each of the effects that it may not need.

        These are the effects of `_least_missed` without which, in the linearised model, the evidence stays within
        `Settings.better_exchanged` of the best.  A model that was found by an exchange may no longer need all effects
        of the one before it.
        """
        best = self.evidence[self.ranked[0]]
        least, good = best - np.log(self.settings.survival_odds), best - self.settings.better_exchanged
        tasks = list[tuple[Fit, int, float]]()
        for effects in self.ranked:
            if self.evidence[effects] < least or effects in self.thinned:
                continue
            self.thinned.add(effects)
            fitted = self.fits[effects]
            for hypothesis in self._least_missed(fitted, self.evidence[effects] - good):
                rest = effects - {hypothesis}
                if rest not in self.fits:
                    tasks.append((fitted, fitted.model.hypotheses.index(hypothesis), self._give_up_above([*rest])))
        for part in self.search.apply(_part, tasks):
            self.add(part)

    def _least_missed(self, fitted: Fit, most_missed: float | None = None) -> list[Hypothesis]:
        """The effects of a model whose removal costs least evidence in the linearised model, the cheapest first.

        At most `Settings.left_out` effects that cost less than `most_missed` (absent: `Settings.useful_reach`); all
        effects of a model that leaves much unexplained, as there the linearised model is far from the truth.
        """
        most_missed = self.settings.useful_reach if most_missed is None else most_missed
        linear, present = self.linearised(fitted)
        missed = {number: linear.evidence(present) - linear.evidence(present - {number}) for number in present}
        order = sorted(present, key=missed.__getitem__)
        if fitted.costly or fitted.reduced < self.settings.gross:
            most = self.settings.costly_left_out if fitted.costly else self.settings.left_out
            order = [number for number in order[:most] if missed[number] < most_missed]
        return [linear.columns[number].hypothesis for number in order]

    def linearised(self, fitted: Fit) -> tuple[LinearModel, frozenset[int]]:
        """The linearised model around a fit, and the numbers of the columns that belong to the effects of the fit."""
        return linear_model(fitted, self.search.general_forms, self.search.log_odds)

    def beginning(
        self, fitted: Fit, linear: LinearModel, chosen: Sequence[int]
    ) -> tuple[tuple[Hypothesis, ...], np.ndarray]:
        """The hypotheses of the `chosen` columns, and the parameters (p,) that a full fit of them begins from."""
        return beginning(fitted, linear, chosen)

    def _give_up_above(self, hypotheses: Sequence[Hypothesis]) -> float:
        """Chi-square above which a fit of these effects is given up: even without Occam's factor, its evidence would be
        more than `Settings.useful_reach` below the best."""
        odds = sum(self.search.log_odds[hypothesis] for hypothesis in hypotheses)
        return 2 * (odds - self.evidence[self.ranked[0]] + self.settings.useful_reach)

    def under(self, noise: Noise) -> "Pool":
        """A new pool under another covariance: the models of :meth:`worth_keeping`, refitted."""
        chosen = self.worth_keeping()
        tasks = [(replace(self.fits[effects].model, noise=noise), self.fits[effects].p, np.inf) for effects in chosen]
        pool = Pool(self.search, self.settings, self.search.apply(_fitted, tasks))
        pool.thinned = set(self.thinned)
        return pool

    def worth_keeping(self) -> list[Effects]:
        """The sets of effects that may still be good under another covariance, best first, and the empty set."""
        least = self.evidence[self.ranked[0]] - self.settings.useful_reach
        most = self.settings.costly_kept if self.best.costly else self.settings.kept_models
        kept = [effects for effects in self.ranked if self.evidence[effects] >= least][:most]
        return list(dict.fromkeys([*kept, Effects()]))

    def survivors(self) -> tuple[Survivor, ...]:
        """The models that the recording does not rule out, most probable first; if there are none, the best one.

        They have an equilibrium at every step, are within `Settings.survival_odds` of the best, and have no effect that
        moves no reading.
        """
        best = self.evidence[self.ranked[0]]
        least = best - np.log(self.settings.survival_odds)
        telling = [e for e in self.ranked if self.fits[e].balanced and not self.fits[e].idle]
        kept = [e for e in telling if self.evidence[e] >= least] or self.ranked[:1]
        weight = np.exp([self.evidence[effects] - best for effects in kept])
        shares = (weight / weight.sum()).tolist()
        return tuple(Survivor(self.fits[e], self.evidence[e], share) for e, share in zip(kept, shares, strict=True))


def _part(task: tuple[Fit, int, float]) -> Fit | None:
    return without_effect(*task)


def _fitted(task: tuple[Model, np.ndarray, float]) -> Fit | None:
    model, start, give_up_above = task
    return fit(model, start, give_up_above=give_up_above)
