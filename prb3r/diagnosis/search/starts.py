"""Several starts of one search: what small loads show first, and the constants alone."""

from collections.abc import Iterator

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.assumed import fit_assumed
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice, choose
from prb3r.diagnosis.search.small_loads import from_small_loads
from prb3r.diagnosis.search.worth import worth


def search_effects(calibrated: Fit, search: Search, doubts: Doubts) -> Choice:
    """The best choice of effects from all starts; those after one that explains the recording are not tried."""
    best: Choice | None = None
    for pool in _starts(calibrated, search, doubts):
        choice = choose(pool, search, doubts)
        if best is None or worth(choice, search) > worth(best, search):
            best = choice
        if not best.structured:
            break
    assert best is not None  # there is always a start
    return best


def _starts(calibrated: Fit, search: Search, doubts: Doubts) -> Iterator[Pool]:
    """Where much is unexplained, what explains small loads, as there a rig is nearly linear; then constants alone.

    The first leads into one valley, from which sets that explain the large loads by other means are not seen.
    """
    settings, known = calibrated.model.settings, [calibrated, fit_assumed(calibrated, search.assumed)]
    if calibrated.reduced > settings.gross:
        small = from_small_loads(calibrated, search, doubts)
        if small is not None:
            yield Pool(search, settings, [*known, small])
    yield Pool(search, settings, known)
