"""What a fitted model is worth: chi-square against chance, information criteria, whole sequences left out."""

from collections.abc import Mapping

import numpy as np

from prb3r.diagnosis.chance import chi2_critical
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis

AT_BOUND = 1e-6
"""Distance from a bound, in a parameter's own scale, that counts as none."""
UNKNOWN = 1e-9
"""Share of a parameter's information that left-out sequences are taken to leave at least."""


def left_out_deviance(fitted: Fit) -> np.ndarray:
    """(q,) deviance of each sequence as predicted by a fit to all others (linearised, exact for linear models).

    With the hat matrix H of the whole fit, a left-out block has the error (I - H_bb)^-1 r_b and scatters with the
    covariance (I - H_bb)^-1, so that parameters which the others do not tell are not blamed for what they cannot know.
    """
    recording = fitted.model.predict.recording
    of_reading = recording.of_sequence[recording.readings.step]
    basis, residual = fitted.basis[: len(of_reading)], fitted.residual[: len(of_reading)]
    deviance = np.zeros(len(recording.sequences))
    for k in range(len(deviance)):
        in_sequence = of_reading == k
        part = basis[in_sequence]
        inner = np.eye(part.shape[1]) - part.T @ part + UNKNOWN * np.eye(part.shape[1])
        along = part.T @ residual[in_sequence]
        deviance[k] = residual[in_sequence] @ residual[in_sequence] + along @ np.linalg.solve(inner, along)
        deviance[k] -= np.linalg.slogdet(inner)[1]
    return deviance


def bic(fitted: Fit) -> float:
    """Chi-square and a penalty on parameters; sequences, not coordinates, count as independent."""
    return fitted.chi2 + len(fitted.p) * np.log(max(len(fitted.model.predict.recording.sequences), 2))


def cost(fitted: Fit) -> float:
    """Chi-square with the penalty that ranks models of different size: every reading counts."""
    return fitted.chi2 + len(fitted.p) * np.log(fitted.model.predict.recording.readings.count)


def log_evidence(fitted: Fit, log_odds: Mapping[Hypothesis, float]) -> float:
    """ln of the marginal likelihood by Laplace's method, prior odds of the effects included, up to a constant.

    The integral over the constants is common to all models but for what effects can do as well.  A constant with a flat
    prior that hardly a reading feels is as uncertain as its bounds allow.
    """
    model, constants = fitted.model, len(fitted.model.varied)
    normal = fitted.jacobian.T @ fitted.jacobian
    flat = np.flatnonzero(np.isinf(model.deviations[:constants]))
    normal[flat, flat] += 1 / model.settings.farthest**2
    of_constants = np.linalg.slogdet(normal[:constants, :constants])[1]
    if not np.isfinite(of_constants):
        return -np.inf
    volume = np.linalg.slogdet(normal)[1] - of_constants
    volume += 2 * np.log(model.deviations[constants:]).sum()
    sided = sum(0.0 in ends for ends in list(zip(*model.bounds(fitted.p), strict=True))[constants:])
    odds = sum(log_odds[hypothesis] for hypothesis in model.hypotheses)
    return float(-fitted.chi2 / 2 - volume / 2 + sided * np.log(2) + odds)


def improves_left_out(simple: Fit, rich: Fit) -> bool:
    """Whether whole sequences left out are predicted better: their log score, paired by sequence."""
    return float((left_out_deviance(rich) - left_out_deviance(simple)).sum()) < 0


def plausible(fitted: Fit) -> bool:
    """Whether no parameter of an effect ends on its bound, but for limits where all values act alike, and no effect
    that comes by degrees ends at nothing."""
    low, high = fitted.model.bounds(fitted.p)
    of_effects = slice(len(fitted.model.varied), None)
    hypotheses = fitted.model.hypotheses
    limits = np.array([free.limit for hypothesis in hypotheses for free in hypothesis.free], bool)
    at_null = [
        hypothesis.by_degrees and abs(u).max() < AT_BOUND
        for hypothesis, u in zip(hypotheses, fitted.model.shares(fitted.p), strict=True)
        if len(u)
    ]
    inside = (limits | (fitted.p[of_effects] > low[of_effects] + AT_BOUND)) & (
        fitted.p[of_effects] < high[of_effects] - AT_BOUND
    )
    return bool(inside.all()) and not any(at_null)


def chi2_threshold(fitted: Fit) -> float:
    """The chi-square that a right model exceeds in a share of `alarm_rate`, or of `naming_rate` if it has effects."""
    settings = fitted.model.settings
    rate = settings.naming_rate if fitted.model.hypotheses else settings.alarm_rate
    return float(chi2_critical(rate, fitted.freedom))
