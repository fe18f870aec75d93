"""The starts of a search: effects that explain the small loads, all common effects at once, plates that soften until a
stop."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.assumed import fit_assumed
from prb3r.diagnosis.search.dissipating import DISSIPATING, dissipating
from prb3r.diagnosis.search.pairs import paired
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.saturated import eliminated, saturated
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import (
    Choice,
    Explored,
    begun_anew,
    choose,
    exchange_effects,
    explore_until_settled,
)
from prb3r.diagnosis.search.small_loads import from_small_loads
from prb3r.diagnosis.search.worth import worth_of


def search_effects(
    calibrated: Fit, search: Search, doubts: Doubts, least_worth: float = -np.inf, begun: Explored | None = None
) -> Choice:
    """The choice of effects by a search from several starts.

    If the constants alone leave little unexplained, the only start is the constants and the effects found before.
    Otherwise the starts are these:

    1. The effects that explain the small loads, under which a rig is nearly linear.  This start leads into one valley,
       which may explain the recording and yet be far from the best: sets of effects that explain the large loads
       otherwise cannot be reached from it.
    2. All common effects at once, unless they leave most of the chi-square of the constants.  Left out if the search
       from 1 explains the recording with few effects.
    3. If neither explains it: the fits of backward elimination from all common effects.
    4. If much is still unexplained: plates that soften until something stops them, unless they leave most of the
       chi-square of the constants.  Left out if `least_worth` is given.
    5. If the choice leaves more than noise in the end: plates that dissipate, likewise.

    If a prediction is slow, the constants alone are the only start beside 1, tried if 1 does not explain the recording.
    The search then goes on from the best result by exchanging effects, with the best models of the other starts in its
    pool, and, where the choice leaves more than noise, by random restarts (:func:`begun_anew`).

    Parameters
    ----------
    least_worth : the search ends after the first start if the worth reached (:func:`worth_of`) is less than this.
    begun : what was reached from the first start by a search that ended there (`Choice.begun`); absent: nothing yet.
    """
    first = begun and _Result(begun, not choose(begun, search).structured, None)
    results = _from_all_starts(_beginning(calibrated, search, doubts), least_worth, first)
    worth_of_first_start, best = results[0].worth(search), results[0]
    for other in results[1:]:
        if mean_log_odds(other.best, best.best, search) > calibrated.model.settings.better_exchanged:
            best = other
    explored = best.explored.sought_by(search)
    add_refitted([result.best for result in results if result is not best], explored.pool)
    if worth_of_first_start < least_worth:
        return replace(choose(explored, search), worth_of_first_start=worth_of_first_start, begun=explored)
    settled = exchange_effects(explored, search)
    choice = choose(settled, search)
    for _ in range(calibrated.model.settings.exchanges):
        if not choice.structured or (again := begun_anew(settled, search)) is None:
            break
        settled, choice = again, choose(again, search)
    if choice.structured and least_worth == -np.inf:
        choice = _or_dissipating(choice, _beginning(calibrated, search, doubts))
    return replace(choice, worth_of_first_start=worth_of_first_start)


def _or_dissipating(choice: Choice, beginning: "_Beginning") -> Choice:
    """A choice that leaves more than noise, or the one of a search from plates that dissipate if that is better: more
    probable, or without anything left but noise."""
    if choice.fitted.costly or not choice.kinds.isdisjoint(DISSIPATING):
        return choice
    law = dissipating(beginning.calibrated, beginning.search)
    if law is None:
        return choice
    other = choose(exchange_effects(_from_known(beginning, law).explored, beginning.search), beginning.search)
    ahead = mean_log_odds(other.survivors[0].fitted, choice.survivors[0].fitted, beginning.search)
    better = ahead > choice.fitted.model.settings.better_exchanged
    return other if better or (not other.structured and choice.structured) else choice


def search_from_known(calibrated: Fit, search: Search, doubts: Doubts) -> Choice:
    """The choice of effects by a search from the constants alone and from the effects found before."""
    return choose(_from_known(_beginning(calibrated, search, doubts)).explored, search)


def _from_all_starts(beginning: "_Beginning", least_worth: float, begun: "_Result | None") -> list["_Result"]:
    """The results of the searches from all starts; of the first alone if its worth is below `least_worth`.

    The searches from small loads and from all common effects run side by side, one worker each, unless `least_worth`
    may make the second unnecessary.  The first is not repeated if it is `begun`.
    """
    calibrated, _, search, _ = beginning
    if calibrated.reduced <= calibrated.model.settings.gross:
        return [begun or _from_known(beginning)]
    if calibrated.costly:
        first = begun or _from_small_loads(beginning)
        return [first] if first.explains or first.worth(search) < least_worth else [first, _from_known(beginning)]
    alone = beginning._replace(search=search.here)
    sides = [(_from_small_loads, alone), (_from_full_side, alone)]
    results = list[_Result]()
    if begun or least_worth > -np.inf:
        results, sides = [begun or _from_small_loads(beginning)], sides[1:]
        if _is_simple(results[0]) or results[0].worth(search) < least_worth:
            return results
    results += [result for result in search.until(_from_side, sides, _is_simple) if result is not None]
    full = results[-1].started_from if len(results) == 2 else None
    if full is not None and not any(result.explains for result in results):
        results.append(_from_known(beginning, *eliminated(full, search)))
    unexplained = all(result.best.reduced > calibrated.model.settings.gross for result in results)
    if least_worth == -np.inf and unexplained and (pairs := paired(calibrated, search)):
        results.append(_from_known(beginning, *pairs))
    return results


def add_refitted(others: Sequence[Fit], pool: Pool) -> None:
    """Add the models of `others` to a pool, refitted under the pool's noise."""
    for other in others:
        pool.add(fit(replace(other.model, noise=pool.best.model.noise), other.p))


def _beginning(calibrated: Fit, search: Search, doubts: Doubts) -> "_Beginning":
    """The common input of the searches from all starts."""
    return _Beginning(calibrated, fit_assumed(calibrated, search.found_before), search, doubts)


class _Beginning(NamedTuple):
    """The input that the searches from all starts have in common."""

    calibrated: Fit
    """The constants alone."""
    known: Fit | None
    """The model with the effects found before (`Search.found_before`); None if there are none."""
    search: Search
    doubts: Doubts


class _Result(NamedTuple):
    """The result of the search from one start."""

    explored: Explored
    explains: bool
    """Whether the chosen model leaves nothing but noise."""
    started_from: Fit | None
    """The fit that the search started from, beside the constants and the effects found before; None if it had none."""

    @property
    def best(self) -> Fit:
        """The most probable model."""
        return self.explored.pool.survivors()[0].fitted

    def worth(self, search: Search) -> float:
        """The worth of the most probable model (:func:`worth_of`)."""
        return worth_of(self.best, self.explored.level.level, search)


def _is_simple(result: _Result | None) -> bool:
    """Whether a result explains the recording with fewer than `Settings.several_effects` effects, so that no other
    start is needed."""
    if result is None or not result.explains:
        return False
    return len(result.best.model.hypotheses) < result.best.model.settings.several_effects


def _from_side(task: tuple[Callable[[_Beginning], _Result | None], _Beginning]) -> _Result | None:
    side, beginning = task
    return side(beginning)


def _from_known(beginning: _Beginning, *begun: Fit | None) -> _Result:
    """The result of a search from the constants alone, from the effects found before, and from the fits `begun`."""
    calibrated, known, search, doubts = beginning
    pool = Pool(search, calibrated.model.settings, [calibrated, known, *begun])
    explored = explore_until_settled(pool, search, doubts)
    return _Result(explored, not choose(explored, search).structured, begun[0] if begun else None)


def _from_small_loads(beginning: _Beginning) -> _Result:
    """The result of a search from the model that explains the small loads."""
    return _from_known(beginning, from_small_loads(beginning.calibrated, beginning.search, beginning.doubts))


def _from_full_side(beginning: _Beginning) -> _Result | None:
    """The result of a search from all common effects at once, or from the constants alone if these cannot be fitted.

    None if the fit leaves most of the chi-square of the constants alone (`Settings.saturated_leaves`).
    """
    calibrated = beginning.calibrated
    full = saturated(calibrated, beginning.search, beginning.doubts)
    if full is not None and full.chi2 >= calibrated.model.settings.saturated_leaves * calibrated.chi2:
        return None
    return _from_known(beginning, full)


def mean_log_odds(model: Fit, other: Fit, search: Search) -> float:
    """ln of the posterior odds of a model against another that was found under another noise.

    Both are fitted under the noise of each, and the two ln odds are averaged.
    """
    total, rivals = 0.0, (model, other)
    for noise in [rival.model.noise for rival in rivals]:
        ours, theirs = (fit(replace(rival.model, noise=noise), rival.p) or rival for rival in rivals)
        total += log_evidence(ours, search.log_odds) - log_evidence(theirs, search.log_odds)
    return total / 2
