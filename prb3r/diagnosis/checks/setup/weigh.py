"""A blunder against effects: which of the two explains a recording, when both may use the whole library."""

from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.worth import mean_square, worth, worth_of


def speaks_for(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search], least: float) -> bool:
    """Whether a recording is so much better explained with a blunder mended that the blunder is to be said.

    Both were searched for effects.  A search may stop in a valley that is worth less than another, so the recording as
    it is may use the best of all models that its search tried.

    Parameters
    ----------
    least : logarithm of the likelihood ratio that is asked.
    """
    after, (before, search) = mended[0], as_it_is
    level = before.level.level
    best = max(before.tried, key=lambda fitted: worth_of(fitted, level, search))
    gain = worth(*mended) - worth_of(best, level, search)
    fall = mean_square(best, level) / mean_square(after.fitted, after.level.level)
    return gain > least and (not after.structured or fall > best.model.settings.blunder_fall)
