"""A blunder against effects: which of the two explains a recording, when both may use the whole library."""

from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.worth import mean_square, worth

ORDERS = 10.0
"""Fall of the mean square from which on a blunder is said although effects of the library do not explain the rest."""


def speaks_for(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search], least: float) -> bool:
    """Whether a recording is so much better explained with a blunder mended that the blunder is to be said.

    Both were searched for effects.

    Parameters
    ----------
    least : logarithm of the likelihood ratio that is asked.
    """
    after, before = mended[0], as_it_is[0]
    gain = worth(*mended) - worth(*as_it_is)
    return gain > least and (not after.structured or mean_square(before) > ORDERS * mean_square(after))
