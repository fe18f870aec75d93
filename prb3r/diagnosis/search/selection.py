"""Which effects explain a recording: forward selection, pairs, backward deletion, whole sequences left out."""

from collections.abc import Sequence
from dataclasses import dataclass

from prb3r.diagnosis.evidence.missing_moments import law_alternatives, laws, mechanism
from prb3r.diagnosis.evidence.model_evidence import bic, chi2_threshold, cost, improves_left_out, plausible
from prb3r.diagnosis.evidence.score_test import Alternative, Scores, alternatives, scores
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.full_fits import Apply, fits, pair_fits, serially, shortlist, without_effect

TESTED_TOGETHER = 16
"""Hypotheses that are tested in one task: as many as are differentiated together."""


@dataclass(frozen=True)
class Search:
    """Among what is searched, and how."""

    library: tuple[Hypothesis, ...]
    seed: int
    """Of the draws that tell how large the largest score is by chance."""
    apply: Apply = serially
    """Where full fits and costly tests are made."""


@dataclass(frozen=True, eq=False)
class Choice:
    """What selection found."""

    fitted: Fit
    """The chosen model; without effects, the calibrated one."""
    tried: tuple[Fit, ...]
    """Every full fit, for rivals and the ranking."""
    scores: Scores
    """Score test of what the chosen model leaves."""
    chi2_threshold: float

    @property
    def structured(self) -> bool:
        """Whether something is left that chance does not explain; a model with effects has been tested before."""
        again = bool(self.fitted.model.hypotheses)
        limit = self.scores.naming if again else self.scores.threshold
        return self.scores.largest > limit or self.fitted.chi2 > self.chi2_threshold


def accepted(simple: Fit, rich: Fit, threshold: float) -> bool:
    """Whether the additional effects of `rich` are kept: beyond chance, by BIC, on left-out sequences, plausible."""
    more = len(rich.model.hypotheses) - len(simple.model.hypotheses)
    gain = simple.chi2 - rich.chi2
    return (
        gain > more * threshold**2
        and bic(simple) - bic(rich) > simple.model.settings.bic_fall
        and improves_left_out(simple, rich)
        and plausible(rich)
    )


def examine(fitted: Fit, search: Search, without: Sequence[Hypothesis] = ()) -> Scores:
    """Score test of what `fitted` leaves: every hypothesis that it lacks, and every law without a mechanism."""
    left_alone = {*fitted.model.hypotheses, *without}
    rest = [hypothesis for hypothesis in search.library if hypothesis not in left_alone]
    history = fitted.solved.chain.presliding > 0
    share = TESTED_TOGETHER if history else max(len(rest), 1)
    tasks = [(fitted, rest[k : k + share]) for k in range(0, len(rest), share)]
    parts = (search.apply if history else serially)(_alternatives, tasks)
    mechanics = mechanism(fitted)
    unnamed = law_alternatives(fitted, mechanics, laws(fitted, mechanics))
    return scores(fitted, [*(candidate for part in parts for candidate in part), *unnamed], search.seed)


def _alternatives(task: tuple[Fit, list[Hypothesis]]) -> list[Alternative]:
    return alternatives(*task)


def choose(calibrated: Fit, search: Search, before: Scores | None = None) -> Choice:
    """Forward selection to `most_effects`, with all pairs of the best at the second, and backward deletion.

    `before` is the score test of the calibrated model, if it was made.
    """
    before = before or examine(calibrated, search)
    current, left = calibrated, before
    tried: list[Fit] = []
    for _ in range(calibrated.model.settings.most_effects):
        if not Choice(current, (), left, chi2_threshold(current)).structured:
            break
        richer = fits(current, shortlist(left, current), search.apply)
        if len(current.model.hypotheses) == 1:
            richer += pair_fits(calibrated, before, search.apply)
        tried += richer
        good = [rich for rich in richer if accepted(_parent(rich, calibrated, current), rich, left.naming)]
        if not good:
            break
        best = without_needless(min(good, key=cost), left.naming)
        current, more = exchanged(best, search)
        tried += more
        left = examine(current, search)
    return Choice(current, tuple(tried), left, chi2_threshold(current))


def exchanged(chosen: Fit, search: Search) -> tuple[Fit, list[Fit]]:
    """The model with effects exchanged for better ones, as what came first may have stood in for what came later.

    Also returns all full fits that were made on the way.
    """
    settings, effects = chosen.model.settings, chosen.model.hypotheses
    known: dict[frozenset[Hypothesis], list[Fit]] = {}  # by the effects that stay
    for _ in range(settings.most_exchanges if len(effects) > 1 else 0):
        for k in range(len(effects)):
            if (others := frozenset(effects) - {effects[k]}) not in known:
                known[others] = replacements(chosen, k, search)
        better = [fitted for fits_of in known.values() for fitted in fits_of if plausible(fitted)]
        best = min(better, key=cost, default=chosen)
        if cost(best) >= cost(chosen) - settings.exchange_fall:
            break
        chosen, effects = best, best.model.hypotheses
    return chosen, [fitted for fits_of in known.values() for fitted in fits_of]


def replacements(chosen: Fit, number: int, search: Search) -> list[Fit]:
    """Full fits of the chosen model with effect `number` replaced."""
    base = without_effect(chosen, number)
    if base is None:
        return []
    left = examine(base, search, without=[chosen.model.hypotheses[number]])
    return fits(base, shortlist(left, base), search.apply)


def _parent(rich: Fit, calibrated: Fit, current: Fit) -> Fit:
    """Of the two the model that `rich` adds effects to."""
    return current if set(current.model.hypotheses) <= set(rich.model.hypotheses) else calibrated


def without_needless(fitted: Fit, threshold: float) -> Fit:
    """Backward deletion: drop effects whose absence costs no more than chance."""
    for k in range(len(fitted.model.hypotheses) if len(fitted.model.hypotheses) > 1 else 0):
        simpler = without_effect(fitted, k)
        if simpler is not None and simpler.chi2 - fitted.chi2 <= threshold**2:
            return without_needless(simpler, threshold)
    return fitted
