"""The starts of a search: what small loads show first, all common effects at once, plates that soften until a stop."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.assumed import fit_assumed
from prb3r.diagnosis.search.pairs import paired
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.saturated import eliminated, saturated
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice, Explored, choose, exchange_effects, explore_until_settled
from prb3r.diagnosis.search.small_loads import from_small_loads
from prb3r.diagnosis.search.worth import worth_of


def search_effects(calibrated: Fit, search: Search, doubts: Doubts, least_worth: float = -np.inf) -> Choice:
    """The choice of effects that a search from several starts finds.

    Where the constants alone leave little, the only start is the constants and what was found before.  Otherwise:

    1. What explains the small loads, under which a rig is nearly linear.  It leads into one valley, which may explain
       the recording and yet be far from the best: sets that explain large loads by other means are not seen from it.
    2. All common effects at once, unless they leave most of the chi-square of the constants.  Left out where the search
       from 1 explains the recording with few effects.
    3. Where neither explains it: the fits of backward elimination from all common effects.
    4. Where much is still unexplained: plates that soften until something stops them.  Left out where `least_worth` is
       given.

    Where a prediction is slow the constants alone are the only other start, tried if 1 does not explain the recording.
    From the best end the search goes on by exchanging effects, with the best models of the other ends in its pool.

    Parameters
    ----------
    least_worth : the search ends after the first start where its end is worth less (:func:`worth_of`).
    """
    known = search.start_from if search.start_from.values else search.assumed
    beginning = _Beginning(calibrated, fit_assumed(calibrated, known), search, doubts)
    ends = _ends(beginning, least_worth)
    worth_of_first_start, best = ends[0].worth(search), ends[0]
    for other in ends[1:]:
        best = other if lead(other.best, best.best, search) > calibrated.model.settings.better_exchanged else best
    explored = best.explored.sought_by(search)
    beside([end.best for end in ends if end is not best], explored.pool)
    settled = explored if worth_of_first_start < least_worth else exchange_effects(explored, search)
    return replace(choose(settled, search), worth_of_first_start=worth_of_first_start)


def search_from_known(calibrated: Fit, search: Search, doubts: Doubts) -> Choice:
    """The choice of effects that a search from the constants alone and from what was found before finds."""
    known = search.start_from if search.start_from.values else search.assumed
    return choose(_from_known(_Beginning(calibrated, fit_assumed(calibrated, known), search, doubts)).explored, search)


def _ends(beginning: "_Beginning", least_worth: float) -> list["_End"]:
    """The ends of the searches from all starts; the first alone where that is worth less than `least_worth`.

    Small loads and all common effects are searched from side by side, one worker each, unless `least_worth` may make
    the second needless.
    """
    calibrated, _, search, _ = beginning
    if calibrated.reduced <= calibrated.model.settings.gross:
        return [_from_known(beginning)]
    if calibrated.costly:
        first = _from_small_loads(beginning)
        return [first] if first.explains or first.worth(search) < least_worth else [first, _from_known(beginning)]
    alone = beginning._replace(search=search.here)
    sides = [(_from_small_loads, alone), (_from_full_side, alone)]
    ends = []
    if least_worth > -np.inf:
        ends, sides = [_from_small_loads(beginning)], sides[1:]
        if _plain(ends[0]) or ends[0].worth(search) < least_worth:
            return ends
    ends += [end for end in search.until(_from_side, sides, _plain) if end is not None]
    full = ends[-1].started_from if len(ends) == 2 else None
    if full is not None and not any(end.explains for end in ends):
        ends.append(_from_known(beginning, *eliminated(full, search)))
    if least_worth == -np.inf and all(end.best.reduced > calibrated.model.settings.gross for end in ends):
        ends.append(_from_known(beginning, *paired(calibrated, search)))
    return ends


def beside(others: Sequence[Fit], pool: Pool) -> None:
    """Add the best models of `others` to a pool, refitted under its noise, so that they survive where they are as
    probable."""
    for other in others:
        pool.add(fit(replace(other.model, noise=pool.best.model.noise), other.p))


class _Beginning(NamedTuple):
    """What the search from every start has in common."""

    calibrated: Fit
    """The constants alone."""
    known: Fit | None
    """The model with the effects that were found before (`Search.start_from`, else `Search.assumed`); None without."""
    search: Search
    doubts: Doubts


class _End(NamedTuple):
    """Where the search from one start has come to rest."""

    explored: Explored
    explains: bool
    """Whether the chosen model leaves nothing that noise does not explain."""
    started_from: Fit | None
    """The fit that it started from, beside the constants and what was known before; None without one."""

    @property
    def best(self) -> Fit:
        """The most probable model."""
        return self.explored.pool.survivors()[0].fitted

    def worth(self, search: Search) -> float:
        """What the most probable model is worth (:func:`worth_of`)."""
        return worth_of(self.best, self.explored.level.level, search)


def _plain(end: _End | None) -> bool:
    """Whether an end explains the recording with fewer than `Settings.several_effects`, so that no other start is
    needed."""
    if end is None or not end.explains:
        return False
    return len(end.best.model.hypotheses) < end.best.model.settings.several_effects


def _from_side(task: tuple[Callable[[_Beginning], _End | None], _Beginning]) -> _End | None:
    side, beginning = task
    return side(beginning)


def _from_known(beginning: _Beginning, *begun: Fit | None) -> _End:
    """The end of a search from the constants alone, from what was found before, and from the fits `begun`."""
    calibrated, known, search, doubts = beginning
    pool = Pool(search, calibrated.model.settings, [calibrated, known, *begun])
    explored = explore_until_settled(pool, search, doubts)
    return _End(explored, not choose(explored, search).structured, begun[0] if begun else None)


def _from_small_loads(beginning: _Beginning) -> _End:
    """The end of a search from the model that explains the small loads."""
    return _from_known(beginning, from_small_loads(beginning.calibrated, beginning.search, beginning.doubts))


def _from_full_side(beginning: _Beginning) -> _End | None:
    """The end of a search from all common effects at once; None where they leave most of the chi-square of constants
    alone (`Settings.saturated_leaves`).  Without such a fit the search is from the constants alone."""
    calibrated = beginning.calibrated
    full = saturated(calibrated, beginning.search, beginning.doubts)
    if full is not None and full.chi2 >= calibrated.model.settings.saturated_leaves * calibrated.chi2:
        return None
    return _from_known(beginning, full)


def lead(model: Fit, other: Fit, search: Search) -> float:
    """ln of the posterior odds of a model against another.

    Each was found under a noise of its own: both are fitted under each of the two, and the mean of the ln odds counts.
    """
    total, rivals = 0.0, (model, other)
    for noise in [rival.model.noise for rival in rivals]:
        ours, theirs = (fit(replace(rival.model, noise=noise), rival.p) or rival for rival in rivals)
        total += log_evidence(ours, search.log_odds) - log_evidence(theirs, search.log_odds)
    return total / 2
