"""A blunder weighed against effects, by searches of the recording as it is and of the mended recording."""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.worth import mean_square, photographs_of, worth_of
from prb3r.recording.recording import Recording

ALIKE_SD = 1e-6
"""Difference of two misfits, in standard deviations of the reading, that counts as rounding error."""


def is_rival(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search]) -> bool:
    """Whether a blunder is a rival of the effects found in the recording as it is.

    It is if the mended recording is explained by fewer effects, whose worth (:func:`worth_of`) is larger by
    `Settings.better_exchanged`.

    Parameters
    ----------
    mended, as_it_is : the choice on each recording, and its search.
    """
    (after, _), (before, _) = mended, as_it_is
    fewer = len(after.effects) < len(before.effects) and not after.structured
    ahead, count = before.fitted.model.settings.better_exchanged, photographs_of(before.fitted)
    return fewer and _best(*mended, count)[1] - _best(*as_it_is, count)[1] > ahead


def speaks_for(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search], least: float) -> bool:
    """Whether mending a blunder explains a recording so much better that the blunder is reported.

    Both recordings were searched for effects.  They are compared by the worth (:func:`worth_of`) of the best of all
    models tried, which does not depend on the noise that each search found.  If mending drops photographs, both are
    weighed with the number of photographs of the recording as it is, so that dropping one is no gain.  If effects do
    not explain the mended recording either, its mean square must also be smaller by the factor `Settings.blunder_fall`.

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
    """The model of the largest worth of all that a search tried, and that worth for this number of photographs."""
    worth = {fitted: worth_of(fitted, choice.level.level, search, photographs) for fitted in choice.tried}
    best = max(worth, key=worth.__getitem__)
    return best, worth[best]


def is_left_behind(mended: Fit, doubts: Doubts, as_it_is: Choice) -> bool:
    """Whether what explains a recording as it is misses the mended one by far, so that no search of that is needed.

    Effects that imitate a blunder vanish once it is mended: a model with them and with what the rig has beside holds
    for the mended recording too.  It does not where its mean square, refitted, is `Settings.blunder_fall` times as
    large as for the recording as it is, both under the noise that was found in that one.

    Parameters
    ----------
    mended, doubts : the constants alone fitted to the mended recording, and what is doubted in it.
    """
    fitted, settings = as_it_is.fitted, mended.model.settings
    noise = replace(doubts, level=as_it_is.level.level).noise(mended.model.predict, mended.solved, settings)
    refitted = fit(replace(fitted.model, predict=mended.model.predict, noise=noise), fitted.p)
    return refitted is not None and refitted.reduced > settings.blunder_fall * fitted.reduced


def moves_nothing(as_noted: Recording, mended: Recording, fitted: Fit) -> bool:
    """Whether mending has no consequence: with what was fitted to the `mended` recording every reading of that, and of
    the recording `as_noted`, has the same misfit, also in the sequences that were set aside."""
    if as_noted.readings.count != mended.readings.count:
        return False
    predictors = [predictor(recording, fitted.model.settings) for recording in (as_noted, mended)]
    before, after = (predict.misfit(predict(fitted.constants, fitted.effects)) for predict in predictors)
    lost = np.isnan(before) & np.isnan(after)
    return bool(np.all(lost | (np.abs(before - after) < ALIKE_SD * reading_sd(mended))))
