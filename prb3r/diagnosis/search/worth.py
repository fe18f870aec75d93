r"""What a model is worth irrespective of the noise level: compares models that were fitted under different levels.

With the mean square :math:`S` that the model leaves, in units of the stated variance, and :math:`V` the logarithm of
its prior odds and of Occam's factor (the volumes), the worth is

.. math:: V - \tfrac12 m \ln S

less half the squared distance of E and friction from their nominal values, in the spread of handbook values.  The
number `m` counts photographs (steps that were read), not readings: what no model explains is common to a photograph.
"""

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.fit.covariance import NoiseLevel
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice


def worth(choice: Choice, search: Search) -> float:
    """What the chosen model of a search is worth."""
    return worth_of(choice.fitted, choice.level.level, search)


def photographs_of(fitted: Fit) -> int:
    """Number of the steps that have readings in the recording of a fit."""
    return len(np.unique(fitted.recording.readings.step))


def worth_of(fitted: Fit, level: NoiseLevel, search: Search, photographs: int | None = None) -> float:
    """What a fit is worth: its ln evidence with the scale of the noise open, a photograph counting as one number.

    Parameters
    ----------
    level : of the noise under which it was fitted.
    photographs : number to count, the same for fits that are compared, as one may have lost some; absent: its own.
    """
    photographs = photographs or photographs_of(fitted)
    settings, constants = fitted.model.settings, fitted.constants
    occam = log_evidence(fitted, search.log_odds) + fitted.chi2 / 2
    odd = (constants.log_stiffness / settings.modulus_sd) ** 2 + (constants.log_friction / settings.friction_sd) ** 2
    return float(occam - odd / 2 - photographs * np.log(mean_square(fitted, level)) / 2)


def mean_square(fitted: Fit, level: NoiseLevel) -> float:
    """Chi-square per degree of freedom in units of the stated variance, for a fit under a `level` of the noise."""
    return fitted.reduced * level.scale**2
