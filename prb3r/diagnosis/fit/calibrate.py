"""Calibration: a fit of the constants and the frame alone, begun at the nominal manipulator."""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.fit.constants import FRAME, Constants
from prb3r.diagnosis.fit.covariance import Noise, independent, noise_of
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit, Model
from prb3r.diagnosis.fit.prediction import Predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.settings import Settings


def nominal_noise(predict: Predictor) -> Noise:
    """The covariance of the readings around the nominal manipulator, for noise as stated and without tolerances."""
    return noise_of(predict.recording, tension_response(predict, predict.solve(Constants())))


class OutOfBalance(ValueError):
    """Raised if no stiffness near the nominal one gives any recorded step an equilibrium."""


def fit_constants(predict: Predictor, noise: Noise | None = None, settings: Settings | None = None) -> Fit:
    """The constants, fitted without effects: the first fit in which every step has an equilibrium.

    Fits begin at the nominal constants, then at other stiffnesses, `Settings.start_factors` times the nominal one.
    Where none balances every step, the fit of least chi-square is returned.  `noise`: absent, :func:`nominal_noise`.

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
        fitted = fit(model, start, least_promise=model.settings.small_gain)
        if fitted is not None and np.isfinite(fitted.solved.readings).any():
            fits.append(fitted)
            if fitted.balanced:
                break
    if not fits:
        raise OutOfBalance("no stiffness near the nominal one puts any recorded step in balance")
    return min(fits, key=lambda fitted: (not fitted.balanced, fitted.chi2))


def as_drawn(fitted: Fit) -> Fit:
    """The model of a fit, refitted from there with every part of the rig as drawn (see `constants_as_drawn`); the fit
    itself where that fails."""
    return fit(replace(fitted.model, noise=independent(fitted.model.noise.total_sd)), fitted.p) or fitted


def constants_as_drawn(calibrated: Fit) -> Fit:
    """The constants alone, refitted to the readings of a `calibrated` fit with every part of the rig as drawn.

    The covariance of a diagnosis lets parts and tensions lie anywhere within their tolerances.  These then absorb part
    of the errors of a wrong model, and its constants may be far from those that predict best (in one case twice the
    best Young's modulus, with errors four times those of the nominal file).  Here readings are independent, each with
    its own standard deviation, as in an ordinary refit of constants.
    """
    model = calibrated.model
    return fit_constants(model.predict, independent(model.noise.total_sd), model.settings)


def constants_as_filed(calibrated: Fit) -> Fit | None:
    """The constants of the manipulator file, every part as drawn, with what the recording states of the camera's frame;
    what it leaves open of the frame is refitted to the readings of a `calibrated` fit.  None where a step has no
    equilibrium with them."""
    model = calibrated.model
    held = Model(model.predict, independent(model.noise.total_sd), settings=model.settings)
    stated = np.isfinite(held.deviations) | ~np.isin(held.varied, FRAME)
    fitted = fit(held, np.zeros(held.count), fixed=np.flatnonzero(stated).tolist())
    return fitted if fitted and fitted.balanced else None
