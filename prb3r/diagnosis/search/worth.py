r"""What a choice of effects is worth, whatever the noise: for choices that do not share the scale of it.

With the mean square :math:`S` that the chosen model leaves, in units of the stated noise, and :math:`V` its prior odds
and volumes (Occam's factor), the worth is

.. math:: V - \tfrac12 m \ln S

with what handbooks say of E and friction as a prior of the constants; `m` counts photographs, not readings: what no
model explains is common to a photograph.
"""

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.fit.covariance import NoiseLevel
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice


def worth(choice: Choice, search: Search) -> float:
    """Log evidence of the chosen model, the scale of the noise being open and a photograph counting as one number."""
    return worth_of(choice.fitted, choice.level.level, search)


def photographs_of(fitted: Fit) -> int:
    """Number of the steps whose readings a fit is of."""
    return len(np.unique(fitted.model.predict.recording.readings.step))


def worth_of(fitted: Fit, level: NoiseLevel, search: Search, photographs: int | None = None) -> float:
    """The same of any fit under a level of the noise.

    `photographs`: how many to count; absent: its own. Of two fits to be compared one may have lost some.
    """
    photographs = photographs or photographs_of(fitted)
    settings, constants = fitted.model.settings, fitted.constants
    occam = log_evidence(fitted, search.log_odds) + fitted.chi2 / 2
    odd = (constants.log_stiffness / settings.modulus_sd) ** 2 + (constants.log_friction / settings.friction_sd) ** 2
    return float(occam - odd / 2 - photographs * np.log(mean_square(fitted, level)) / 2)


def mean_square(fitted: Fit, level: NoiseLevel) -> float:
    """What a model leaves, per degree of freedom, in units of the stated variance."""
    return fitted.reduced * level.scale**2
