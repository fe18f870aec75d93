"""Calibration: constants and frame alone, from the nominal ones."""

import numpy as np

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.covariance import Noise, noise_of
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit, Model
from prb3r.diagnosis.fit.prediction import Predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.settings import Settings


def nominal_noise(predict: Predictor) -> Noise:
    """The covariance of the readings as the nominal manipulator has it."""
    return noise_of(predict.recording, tension_response(predict, predict.solve(Constants())))


class OutOfBalance(ValueError):
    """Nothing near the nominal manipulator is in balance under the recorded loads."""


def fit_constants(predict: Predictor, noise: Noise | None = None, settings: Settings | None = None) -> Fit:
    """Fit the constants alone, from the nominal ones, or from other stiffnesses where these leave steps out of balance.

    `noise`: absent, that of :func:`nominal_noise`.

    Raises
    ------
    OutOfBalance
        If no stiffness among `Settings.start_factors` puts any recorded step in balance.
    """
    model = Model(predict, noise or nominal_noise(predict), settings=settings or Settings())
    fits: list[Fit] = []
    for factor in model.settings.start_factors:
        start = np.zeros(model.count)
        start[0] = np.log(factor)
        fitted = fit(model, start)
        if fitted is not None and np.isfinite(fitted.solved.readings).any():
            fits.append(fitted)
            if fitted.balanced:
                break
    if not fits:
        raise OutOfBalance("no stiffness near the nominal one puts any recorded step in balance")
    return min(fits, key=lambda fitted: (not fitted.balanced, fitted.chi2))
