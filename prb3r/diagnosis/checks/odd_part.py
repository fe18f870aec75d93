"""A part of another rig that is not as it was drawn: what a changed plate or hole does to readings that nothing was
fitted to."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.chance import chi2_tail, normal_critical
from prb3r.diagnosis.evidence.outliers import Doubts, outlier_inflation
from prb3r.diagnosis.evidence.rig_as_made import rig_as_made
from prb3r.diagnosis.fit.covariance import NoiseLevel
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Model
from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.diagnosis.library.hypothesis import Hypothesis

LEAST_TOLD = 1e-6
"""Share of the variance of a tolerance at or below which readings tell nothing of it but rounding."""
MOST_TOLERANCES = 100.0
"""Tolerances that a part may be off to be named.  Choice: a plate of a fifth of its stiffness; what would take more is
no part that was made badly, and the readings are not linear in it."""


class OddPart(NamedTuple):
    """A part that deviates from its drawing by more than its tolerance and chance allow."""

    name: str
    """As of :func:`prb3r.diagnosis.fit.tolerance.tolerances`."""
    z: float
    """Its deviation in units of what tolerance and noise would make of it by chance."""
    size: float
    """The deviation that the readings alone tell, m or rad; of a stiffness its ln."""
    suffices: bool
    """Whether what else the readings are missed by is no more than chance."""


def odd_part(predict: Predictor, solved: Solution, effects: Sequence[Hypothesis], level: NoiseLevel) -> OddPart | None:
    """The part of the rig of `predict` that deviates most from its drawing, if one does significantly; else None.

    Effects keep the numbers that they were found with elsewhere; constants and the frame of the camera are fitted to
    the readings, from those of `solved`.  Given the readings, a tolerance has a normal distribution; if the part was
    made within it, its mean scatters by the root of 1 - v, where v is its variance, both in units of the tolerance
    (:func:`prb3r.diagnosis.evidence.rig_as_made.rig_as_made`).  The level of significance is `Settings.naming_rate`,
    divided among all parts.

    Parameters
    ----------
    solved : states and readings as the effects predict them.
    effects : without free parameters.
    level : of the noise of the readings.
    """
    settings = predict.settings
    doubts = Doubts(outlier_inflation(predict, solved.readings, settings), level=level)
    model = Model(predict, doubts.noise(predict, solved, settings), tuple(effects), settings)
    fitted = fit(model, np.array([getattr(solved.constants, name) for name in model.varied]))
    if fitted is None or not fitted.balanced:
        return None
    made = rig_as_made(fitted, doubts)
    told = 1 - np.diag(made.covariance)[len(fitted.p) :]
    felt = np.flatnonzero(told > LEAST_TOLD)
    if not len(felt):
        return None
    z = made.mean[felt] / np.sqrt(told[felt])
    worst = int(np.argmax(np.abs(z)))
    k, left = felt[worst], max(fitted.chi2 - float(z[worst]) ** 2, 0.0)
    by_chance = abs(z[worst]) <= normal_critical(settings.naming_rate / 2 / len(z))
    if by_chance or abs(made.mean[k]) > MOST_TOLERANCES * told[k]:
        return None
    size = float(made.sd[k] * made.mean[k] / told[k])
    return OddPart(made.names[k], float(z[worst]), size, chi2_tail(left, fitted.freedom) >= settings.naming_rate)
