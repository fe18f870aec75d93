"""Several starts of one search: what small loads show first, and all common effects at once."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.assumed import fit_assumed
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.saturated import saturated
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice, Explored, choose, exchange_effects, explore_until_settled
from prb3r.diagnosis.search.small_loads import from_small_loads


def search_effects(calibrated: Fit, search: Search, doubts: Doubts) -> Choice:
    """The better choice of effects from two sides, where much is unexplained; from what is known before else.

    One begins from what explains small loads, as there a rig is nearly linear.  It leads into one valley, which may
    explain the recording and yet be far from the best: sets that explain the large loads by other means are not seen
    from it.  The other begins from all common effects at once, unless they leave most of what constants leave; where a
    prediction is slow, from the constants alone, and only if the first does not explain the recording.  From the better
    end the search goes on by exchange.
    """
    beginning = _Beginning(calibrated, fit_assumed(calibrated, search.assumed), search, doubts)
    if calibrated.reduced <= calibrated.model.settings.gross:
        ends = [_from_known(beginning)]
    elif calibrated.costly:
        ends = [_from_small_loads(beginning)]
        ends += [_from_known(beginning)] if choose(ends[0], search).structured else []
    else:
        alone = beginning._replace(search=search.here)
        found = search.apply(_from_side, [(_from_small_loads, alone), (_from_full_side, alone)])
        ends = [end for end in found if end is not None]
    best, *others = ends
    for other in others:
        best = other if lead(_most_probable(other), _most_probable(best), search) > 0 else best
    return choose(exchange_effects(best.sought_by(search), search), search)


class _Beginning(NamedTuple):
    """What a search begins from."""

    calibrated: Fit
    known: Fit | None
    """With what was found before; None where nothing was."""
    search: Search
    doubts: Doubts


def _from_side(task: tuple[Callable[[_Beginning], Explored | None], _Beginning]) -> Explored | None:
    side, beginning = task
    return side(beginning)


def _from_known(beginning: _Beginning, begun: Fit | None = None) -> Explored:
    """The end of a search from the constants alone, from what was found before, and from what was `begun`."""
    calibrated, known, search, doubts = beginning
    return explore_until_settled(Pool(search, calibrated.model.settings, [calibrated, known, begun]), search, doubts)


def _from_small_loads(beginning: _Beginning) -> Explored:
    """The end of a search from what explains small loads."""
    return _from_known(beginning, from_small_loads(beginning.calibrated, beginning.search, beginning.doubts))


def _from_full_side(beginning: _Beginning) -> Explored | None:
    """The end of a search from all common effects at once; None where they leave most of what constants leave."""
    calibrated = beginning.calibrated
    full = saturated(calibrated, beginning.search, beginning.doubts)
    if full is not None and full.chi2 >= calibrated.model.settings.saturated_leaves * calibrated.chi2:
        return None
    return _from_known(beginning, full)


def _most_probable(end: Explored) -> Fit:
    return end.pool.survivors()[0].fitted


def lead(model: Fit, other: Fit, search: Search) -> float:
    """By how much a model is more probable than another, ln of the odds.

    Each was found under a noise of its own: the mean under both, with both fitted under each.
    """
    total, rivals = 0.0, (model, other)
    for noise in [rival.model.noise for rival in rivals]:
        ours, theirs = (fit(replace(rival.model, noise=noise), rival.p) or rival for rival in rivals)
        total += log_evidence(ours, search.log_odds) - log_evidence(theirs, search.log_odds)
    return total / 2
