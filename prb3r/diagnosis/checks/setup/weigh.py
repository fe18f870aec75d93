"""A blunder against effects: which of the two explains a recording, when both may use the whole library."""

import numpy as np

from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.worth import mean_square, photographs_of, worth_of
from prb3r.recording.recording import Recording

ALIKE_SD = 1e-6
"""Deviations of a reading by which what moves nothing may differ, as rounding does."""


def stands_beside(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search]) -> bool:
    """Whether a blunder is a rival of the effects that are found: with it mended fewer explain the recording better."""
    (after, _), (before, _) = mended, as_it_is
    fewer = len(after.kinds) < len(before.kinds) and not after.structured
    ahead, count = before.fitted.model.settings.better_exchanged, photographs_of(before.fitted)
    return fewer and _best(*mended, count)[1] - _best(*as_it_is, count)[1] > ahead


def speaks_for(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search], least: float) -> bool:
    """Whether a recording is so much better explained with a blunder mended that the blunder is to be said.

    Both were searched for effects.  What each explains is told by the best of all models that its search tried, since
    its choice supposes a noise that the other's does not share.  A photograph that belongs nowhere once the blunder is
    mended counts like the rest: to lose it is no gain.

    Parameters
    ----------
    least : logarithm of the likelihood ratio that is asked.
    """
    count = photographs_of(as_it_is[0].fitted)
    (after, there), (before, here) = _best(*mended, count), _best(*as_it_is, count)
    fall = mean_square(before, as_it_is[0].level.level) / mean_square(after, mended[0].level.level)
    return there - here > least and (not mended[0].structured or fall > after.model.settings.blunder_fall)


def _best(choice: Choice, search: Search, photographs: int) -> tuple[Fit, float]:
    """The model that is worth most of those that a search tried, and what it is worth with so many photographs."""
    worth = {fitted: worth_of(fitted, choice.level.level, search, photographs) for fitted in choice.tried}
    best = max(worth, key=worth.__getitem__)
    return best, worth[best]


def moves_nothing(as_noted: Recording, fitted: Fit) -> bool:
    """Whether what was fitted to a mended recording leaves as much of each reading `as_noted`: nothing was mended."""
    theirs = fitted.model.predict
    ours = predictor(as_noted, theirs.settings)
    if as_noted.readings.count != theirs.recording.readings.count:
        return False
    left = [predict.misfit(predict(fitted.constants, fitted.effects)) for predict in (ours, theirs)]
    return bool(np.all(np.abs(left[0] - left[1]) < ALIKE_SD * reading_sd(theirs.recording)))
