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
from prb3r.diagnosis.search.selection import Choice, choose
from prb3r.diagnosis.search.small_loads import from_small_loads


def search_effects(calibrated: Fit, search: Search, doubts: Doubts) -> Choice:
    """The better choice of effects from two starts; the second is not tried where the first explains the recording.

    Where much is unexplained, the first is what explains small loads, as there a rig is nearly linear.  It leads into
    one valley, from which sets that explain the large loads by other means are not seen: the second is all common
    effects at once, or the constants alone where that is too slow.
    """
    settings, known = calibrated.model.settings, [calibrated, fit_assumed(calibrated, search.assumed)]
    if calibrated.reduced <= settings.gross:
        return choose(Pool(search, settings, known), search, doubts)
    first = choose(Pool(search, settings, [*known, from_small_loads(calibrated, search, doubts)]), search, doubts)
    if not first.structured:
        return first
    second = choose(Pool(search, settings, [*known, saturated(calibrated, search, doubts)]), search, doubts)
    return second if lead(second, first, search) > 0 else first


def lead(choice: Choice, other: Choice, search: Search) -> float:
    """By how much the best model of a choice is more probable than that of another, ln of the odds.

    Each choice has found a noise of its own: the mean under both, with both models fitted under each.
    """
    rivals, total = [each.survivors[0].fitted for each in (choice, other)], 0.0
    for noise in [rival.model.noise for rival in rivals]:
        own, its = (fit(replace(rival.model, noise=noise), rival.p) or rival for rival in rivals)
        total += log_evidence(own, search.log_odds) - log_evidence(its, search.log_odds)
    return total / 2
