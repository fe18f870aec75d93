"""How far a parameter may move before the fit, all others refitted, becomes too poor: intervals by profile."""

from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.confidence import INTERVAL_RISE, NORMAL_REACH
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit

LEAST_SD = 1e-12
"""Standard deviation of a parameter at least, in its own scale: against division by zero."""


@dataclass(frozen=True)
class Profile:
    """Chi-square along one parameter, all others refitted."""

    u: np.ndarray
    """Values of the parameter in its own scale, ascending."""
    rise: np.ndarray
    """Chi-square above its minimum."""
    low: float
    """End of the 95 % interval; the bound where the interval reaches it."""
    high: float


def profile(fitted: Fit, number: int) -> Profile:
    """Profile of parameter `number`: refits from the ends of the linearised interval on, inward or outward, until
    chi-square has risen by that of a 95 % interval, at most `Settings.profile_trials` on either side."""
    settings, middle = fitted.model.settings, fitted.p[number]
    sd = float(np.sqrt(max(fitted.covariance[number, number], LEAST_SD**2)))
    low, high = (bound[number] for bound in fitted.model.bounds(fitted.p))
    u, rise, ends = [middle], [0.0], []
    for sign, bound in ((-1, low), (1, high)):
        most, reach, inside, crossing = abs(bound - middle), NORMAL_REACH * sd, 0.0, None
        start = fitted
        for _ in range(settings.profile_trials):
            away = min(reach, most)
            p = start.p.copy()
            p[number] = middle + sign * away
            trial = fit(fitted.model, p, fixed=(number,))
            risen = trial.chi2 - fitted.chi2 if trial is not None else np.inf
            u.append(middle + sign * away)
            rise.append(risen)
            start = trial or start
            if abs(risen - INTERVAL_RISE) < settings.profile_error or (away < reach and risen < INTERVAL_RISE):
                crossing = away
                break
            guess = (inside + away) / 2
            if np.isfinite(risen):
                guess = away * np.sqrt(INTERVAL_RISE / max(risen, settings.least_trial_rise))
            if risen < INTERVAL_RISE:
                inside = away
            shortest, longest = max(settings.least_trial_ratio * away, inside), settings.most_trial_ratio * away
            reach, crossing = float(np.clip(guess, shortest, longest)), guess
        ends.append(middle + sign * min(crossing or reach, most))
    order = np.argsort(u)
    finite = np.isfinite(np.asarray(rise)[order])
    return Profile(np.asarray(u)[order][finite], np.asarray(rise)[order][finite], float(ends[0]), float(ends[1]))


def linear_interval(fitted: Fit, number: int) -> tuple[float, float] | None:
    """Ends of the linearised 95 % interval of parameter `number`, in its own scale and within its bounds.

    None where chi-square, the others moved along as they are where all is linear, has not risen there as it should: the
    interval would be wrong by a factor of more than `Settings.linear_interval_factor`, as where the readings feel a
    parameter to one side alone.  Two predictions are made.
    """
    within = fitted.model.settings.linear_interval_factor
    sd = float(np.sqrt(fitted.covariance[number, number]))
    direction = fitted.covariance[:, number] / max(sd, LEAST_SD)
    bounds, ends = fitted.model.bounds(fitted.p), []
    for sign, bound in zip((-1, 1), bounds, strict=True):
        away = min(NORMAL_REACH * sd, abs(bound[number] - fitted.p[number]))
        p = np.clip(fitted.p + sign * away / max(sd, LEAST_SD) * direction, *bounds)
        residual = fitted.model.residuals(p, fitted.model.solve(p))
        risen, due = float(residual @ residual) - fitted.chi2, (away / max(sd, LEAST_SD)) ** 2
        cut = away < NORMAL_REACH * sd
        if not risen < within**2 * due or (risen < due / within**2 and not cut):
            return None
        ends.append(float(fitted.p[number] + sign * away))
    return ends[0], ends[1]
