"""Calibration: constants and frame alone, from the nominal ones."""

import numpy as np

from prb3r.diagnosis.fit.covariance import Noise, noise_of
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit, Model
from prb3r.diagnosis.fit.prediction import Constants, Predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.settings import Settings


def nominal_noise(predict: Predictor) -> Noise:
    """The covariance of the readings as the nominal manipulator has it."""
    return noise_of(predict.recording, tension_response(predict, predict.solve(Constants())))


def fit_constants(predict: Predictor, noise: Noise | None = None, settings: Settings | None = None) -> Fit:
    """Fit the constants alone, from the nominal ones, or from the nearest stiffness at which all steps are in balance.

    `noise`: absent, that of :func:`nominal_noise`.

    Raises
    ------
    ValueError
        If no stiffness among `Settings.start_factors` puts all steps in balance.
    """
    model = Model(predict, noise or nominal_noise(predict), settings=settings or Settings())
    best = None
    for factor in model.settings.start_factors:
        start = np.zeros(model.count)
        start[0] = np.log(factor)
        fitted = fit(model, start)
        if fitted is not None and (best is None or fitted.chi2 < best.chi2):
            best = fitted
        if best is not None and factor == 1:
            break
    if best is None:
        raise ValueError("no stiffness near the nominal one puts all recorded steps in balance")
    return best
