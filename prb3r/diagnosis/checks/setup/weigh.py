"""A blunder against effects: which of the two explains a recording, when both may use the whole library."""

from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.worth import mean_square, worth


def speaks_for(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search], least: float) -> bool:
    """Whether a recording is so much better explained with a blunder mended that the blunder is to be said.

    Both were searched for effects.

    Parameters
    ----------
    least : logarithm of the likelihood ratio that is asked.
    """
    after, before = mended[0], as_it_is[0]
    gain, fall = worth(*mended) - worth(*as_it_is), mean_square(before) / mean_square(after)
    return gain > least and (not after.structured or fall > after.fitted.model.settings.blunder_fall)
