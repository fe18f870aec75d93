"""Measures of a fitted model: information criteria, Laplace evidence, left-out sequences, the test of chi-square."""

from collections.abc import Mapping

import numpy as np

from prb3r.diagnosis.chance import chi2_critical
from prb3r.diagnosis.fit.model import Fit, normal_matrix
from prb3r.diagnosis.library.hypothesis import Hypothesis

AT_BOUND = 1e-6
"""Distance, in a parameter's own scale, up to which it counts as on its bound, or an effect as having vanished."""
LEAST_INFORMATION = 1e-9
"""Lower bound of the share of the information on a parameter that remains when a sequence is left out: keeps the
deviance finite for parameters that only one sequence shows."""


def left_out_deviance(fitted: Fit) -> np.ndarray:
    """(q,) deviance of each sequence as predicted by a fit to all others (linearised; exact for linear models).

    The deviance is minus twice the ln of the predictive density, up to a constant.  With the hat matrix H of the whole
    fit, the error of a left-out block b is (I - H_bb)^-1 r_b, with the covariance (I - H_bb)^-1.  The covariance is
    large along parameters that the other sequences do not determine, so a model is not penalised for these.
    """
    recording = fitted.recording
    of_reading = recording.of_sequence[recording.readings.step]
    basis, residual = fitted.basis[: len(of_reading)], fitted.misfit
    deviance = np.zeros(len(recording.sequences))
    for k in range(len(deviance)):
        in_sequence = of_reading == k
        part = basis[in_sequence]
        inner = np.eye(part.shape[1]) - part.T @ part + LEAST_INFORMATION * np.eye(part.shape[1])
        along = part.T @ residual[in_sequence]
        deviance[k] = residual[in_sequence] @ residual[in_sequence] + along @ np.linalg.solve(inner, along)
        deviance[k] -= np.linalg.slogdet(inner)[1]
    return deviance


def bic(fitted: Fit) -> float:
    """Bayesian information criterion in which sequences, not readings, count as independent: chi-square plus the ln of
    their number for each parameter."""
    return fitted.chi2 + len(fitted.p) * np.log(max(len(fitted.recording.sequences), 2))


def cost(fitted: Fit) -> float:
    """Bayesian information criterion in which every reading counts as independent; ranks models of different size."""
    return fitted.chi2 + len(fitted.p) * np.log(fitted.recording.readings.count)


def log_evidence(fitted: Fit, log_odds: Mapping[Hypothesis, float]) -> float:
    """ln of the marginal likelihood by Laplace's method plus the prior log odds of the effects, up to a constant.

    Models can only be compared if they have the same readings and noise.  The volume of the constants by themselves is
    left out, as it is nearly the same for all models.  The prior of an effect parameter with a bound at 0 is a
    half-normal, of twice the density.  A constant with a flat prior that hardly moves a reading is as uncertain as its
    bounds allow.

    Parameters
    ----------
    log_odds : ln of the prior odds of presence of every hypothesis.
    """
    model, constants = fitted.model, len(fitted.model.varied)
    normal = normal_matrix(fitted)
    of_constants = np.linalg.slogdet(normal[:constants, :constants])[1]
    if not np.isfinite(of_constants):
        return -np.inf
    volume = np.linalg.slogdet(normal)[1] - of_constants
    volume += 2 * np.log(model.deviations[constants:]).sum()
    sided = sum(0.0 in ends for ends in list(zip(*model.bounds(fitted.p), strict=True))[constants:])
    odds = sum(log_odds[hypothesis] for hypothesis in model.hypotheses)
    return float(-fitted.chi2 / 2 - volume / 2 + sided * np.log(2) + odds)


def log_evidence_in_full(fitted: Fit, log_odds: Mapping[Hypothesis, float]) -> float:
    """As :func:`log_evidence`, with the density of the noise in full: also models under another noise, or with other
    tolerances of the rig, can be compared."""
    return log_evidence(fitted, log_odds) + fitted.model.noise.log_density(np.zeros(fitted.recording.readings.count))


def improves_left_out(simple: Fit, rich: Fit) -> bool:
    """Whether `rich` predicts left-out sequences better than `simple`: by log score, summed over the sequences."""
    return float((left_out_deviance(rich) - left_out_deviance(simple)).sum()) < 0


def plausible(fitted: Fit) -> bool:
    """Whether no parameter of an effect is on a bound, and no effect that can vanish continuously has vanished.

    The lower bound of a parameter is allowed if all values below it act alike (`Free.limit`).
    """
    low, high = fitted.model.bounds(fitted.p)
    of_effects = slice(len(fitted.model.varied), None)
    hypotheses = fitted.model.hypotheses
    limits = np.array([free.limit for hypothesis in hypotheses for free in hypothesis.free], bool)
    at_null = [
        hypothesis.continuous and abs(u).max() < AT_BOUND
        for hypothesis, u in zip(hypotheses, fitted.model.shares(fitted.p), strict=True)
        if len(u)
    ]
    inside = (limits | (fitted.p[of_effects] > low[of_effects] + AT_BOUND)) & (
        fitted.p[of_effects] < high[of_effects] - AT_BOUND
    )
    return bool(inside.all()) and not any(at_null)


def chi2_threshold(fitted: Fit) -> float:
    """Critical value of chi-square: at the level `Settings.alarm_rate`, or `naming_rate` for a model with effects."""
    settings = fitted.model.settings
    rate = settings.naming_rate if fitted.model.hypotheses else settings.alarm_rate
    return float(chi2_critical(rate, fitted.freedom))
