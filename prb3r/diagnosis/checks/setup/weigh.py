r"""A blunder against effects: which of the two explains a recording, when both may use the whole library.

A recording with a blunder and the same recording mended are each searched for effects.  With the mean square :math:`S`
that the best model leaves, in units of the stated noise, and :math:`V` its prior odds and volumes (Occam's factor), the
worth of either is

.. math:: V - \tfrac12 m \ln S

with what handbooks say of E and friction as a prior of the constants; `m` counts photographs, not readings: what no
model explains is common to a photograph.  The scale of the noise is no matter of dispute then: each has the one that
fits it best.
"""

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice

ORDERS = 10.0
"""Fall of the mean square from which on a blunder is said although effects of the library do not explain the rest."""


def worth(choice: Choice, search: Search) -> float:
    """Log evidence of the chosen model, the scale of the noise being open and a photograph counting as one number."""
    fitted = choice.fitted
    photographs = len(np.unique(fitted.model.predict.recording.readings.step))
    settings, constants = fitted.model.settings, fitted.constants
    occam = log_evidence(fitted, search.log_odds) + fitted.chi2 / 2
    odd = (constants.log_stiffness / settings.modulus_sd) ** 2 + (constants.log_friction / settings.friction_sd) ** 2
    return occam - odd / 2 - photographs * np.log(mean_square(choice)) / 2


def mean_square(choice: Choice) -> float:
    """What the chosen model leaves, per degree of freedom, in units of the stated variance."""
    return choice.fitted.reduced * choice.level.level.scale**2


def speaks_for(mended: tuple[Choice, Search], as_it_is: tuple[Choice, Search], least: float) -> bool:
    """Whether a recording is so much better explained with a blunder mended that the blunder is to be said.

    `least` : logarithm of the likelihood ratio that is asked.
    """
    after, before = mended[0], as_it_is[0]
    gain = worth(*mended) - worth(*as_it_is)
    return gain > least and (not after.structured or mean_square(before) > ORDERS * mean_square(after))
