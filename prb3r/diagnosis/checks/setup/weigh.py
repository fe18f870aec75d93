"""A blunder weighed against effects: searches of the recording as it is and of the mended one, both with the whole
library, are compared."""

import numpy as np

from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.worth import mean_square, photographs_of, worth_of
from prb3r.recording.recording import Recording

ALIKE_SD = 1e-6
"""Difference of two misfits, in standard deviations of the reading, up to which they are equal but for rounding."""


def stands_beside(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search]) -> bool:
    """Whether a blunder is a rival of the effects that are found: once it is mended, effects of fewer kinds explain the
    recording, and are worth more by `Settings.better_exchanged`.

    Parameters
    ----------
    mended, as_it_is : the choice on each recording, and its search.
    """
    (after, _), (before, _) = mended, as_it_is
    fewer = len(after.kinds) < len(before.kinds) and not after.structured
    ahead, count = before.fitted.model.settings.better_exchanged, photographs_of(before.fitted)
    return fewer and _best(*mended, count)[1] - _best(*as_it_is, count)[1] > ahead


def speaks_for(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search], least: float) -> bool:
    """Whether a recording is so much better explained with a blunder mended that the blunder is said.

    Both recordings were searched for effects.  Each counts as what the best of all its tried models is worth
    (:func:`worth_of`), irrespective of the noise that each search found.  If mending leaves photographs out, both count
    with the number of the recording as it is, so that losing one is no gain.  Where effects do not explain the mended
    recording, the mean square must fall by the factor `Settings.blunder_fall` too.

    Parameters
    ----------
    mended, as_it_is : the choice on each recording, and its search.
    least : logarithm of the likelihood ratio that is needed.
    """
    count = photographs_of(as_it_is[0].fitted)
    (after, there), (before, here) = _best(*mended, count), _best(*as_it_is, count)
    fall = mean_square(before, as_it_is[0].level.level) / mean_square(after, mended[0].level.level)
    return there - here > least and (not mended[0].structured or fall > after.model.settings.blunder_fall)


def _best(choice: Choice, search: Search, photographs: int) -> tuple[Fit, float]:
    """The model that is worth most of those that a search tried, and its worth with this number of photographs."""
    worth = {fitted: worth_of(fitted, choice.level.level, search, photographs) for fitted in choice.tried}
    best = max(worth, key=worth.__getitem__)
    return best, worth[best]


def moves_nothing(as_noted: Recording, fitted: Fit) -> bool:
    """Whether mending is without consequence: a model fitted to the mended recording misses each reading `as_noted` by
    as much."""
    theirs = fitted.model.predict
    ours = predictor(as_noted, theirs.settings)
    if as_noted.readings.count != theirs.recording.readings.count:
        return False
    left = [predict.misfit(predict(fitted.constants, fitted.effects)) for predict in (ours, theirs)]
    return bool(np.all(np.abs(left[0] - left[1]) < ALIKE_SD * reading_sd(theirs.recording)))
