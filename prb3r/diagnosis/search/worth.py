r"""The worth of a model irrespective of the noise level, by which models fitted under different levels are compared.

With :math:`S` the mean squared residual of the model, in units of the stated variance, and :math:`V` the logarithm of
its prior odds and of Occam's factor (the volumes), the worth is

.. math:: V - \tfrac12 m \ln S

less half the squared distance of E and friction from their nominal values, in the spread of handbook values.  The
number `m` counts photographs (steps with readings), not readings, as the residuals of a photograph go together where no
model explains them.
"""

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.fit.covariance import NoiseLevel
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice


def worth(choice: Choice, search: Search) -> float:
    """The worth of the chosen model of a search."""
    return worth_of(choice.fitted, choice.level.level, search)


def photographs_of(fitted: Fit) -> int:
    """Number of the steps that have readings in the recording of a fit."""
    return len(np.unique(fitted.recording.readings.step))


def worth_of(fitted: Fit, level: NoiseLevel, search: Search, photographs: int | None = None) -> float:
    """The worth of a fit: its ln evidence for an unknown scale of the noise, each photograph counting as one number.

    Parameters
    ----------
    level : noise level under which it was fitted.
    photographs : number `m`; absent: that of the fit's recording.  Fits that are compared need the same number, though
        the recording of one may lack some photographs.
    """
    photographs = photographs or photographs_of(fitted)
    settings, constants = fitted.model.settings, fitted.constants
    occam = log_evidence(fitted, search.log_odds) + fitted.chi2 / 2
    odd = (constants.log_stiffness / settings.modulus_sd) ** 2 + (constants.log_friction / settings.friction_sd) ** 2
    return float(occam - odd / 2 - photographs * np.log(mean_square(fitted, level)) / 2)


def mean_square(fitted: Fit, level: NoiseLevel) -> float:
    """Chi-square per degree of freedom in units of the stated variance, for a fit under a `level` of the noise."""
    return fitted.reduced * level.scale**2
