"""Several starts of one search: what small loads show first, and all common effects at once."""

from dataclasses import replace

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.assumed import fit_assumed
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.saturated import saturated
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice, choose, exchange_effects, explore_until_settled
from prb3r.diagnosis.search.small_loads import from_small_loads


def search_effects(calibrated: Fit, search: Search, doubts: Doubts) -> Choice:
    """The better choice of effects from two starts; the second is not tried where the first explains the recording.

    Where much is unexplained, the first is what explains small loads, as there a rig is nearly linear.  It leads into
    one valley, from which sets that explain the large loads by other means are not seen: the second is all common
    effects at once, unless they explain next to nothing, or the constants alone where that is too slow.  From the
    better one the search goes on by exchange.
    """
    settings, known = calibrated.model.settings, [calibrated, fit_assumed(calibrated, search.assumed)]
    gross = calibrated.reduced > settings.gross
    first = from_small_loads(calibrated, search, doubts) if gross else None
    explored = explore_until_settled(Pool(search, settings, [*known, first]), search, doubts)
    if gross and choose(explored, search).structured:
        second = saturated(calibrated, search, doubts)
        if second is None or second.chi2 < settings.saturated_leaves * calibrated.chi2:
            other = explore_until_settled(Pool(search, settings, [*known, second]), search, doubts)
            first_best, other_best = (start.pool.survivors()[0].fitted for start in (explored, other))
            explored = other if lead(other_best, first_best, search) > 0 else explored
    return choose(exchange_effects(explored, search), search)


def lead(model: Fit, other: Fit, search: Search) -> float:
    """By how much a model is more probable than another, ln of the odds.

    Each was found under a noise of its own: the mean under both, with both fitted under each.
    """
    total, rivals = 0.0, (model, other)
    for noise in [rival.model.noise for rival in rivals]:
        ours, theirs = (fit(replace(rival.model, noise=noise), rival.p) or rival for rival in rivals)
        total += log_evidence(ours, search.log_odds) - log_evidence(theirs, search.log_odds)
    return total / 2
