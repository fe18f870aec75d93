"""95 % intervals of one parameter: by the profile of chi-square, all others refitted, or linearised."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.confidence import INTERVAL_RISE, NORMAL_REACH
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit

LEAST_SD = 1e-12
"""Least standard deviation of a parameter, in its own scale, against division by zero."""


@dataclass(frozen=True)
class Profile:
    """Chi-square along one parameter, all others refitted."""

    u: np.ndarray
    """Values of the parameter in its own scale, ascending."""
    rise: np.ndarray
    """Chi-square above that of the fit, at each of these values."""
    low: float
    """Lower end of the 95 % interval, in the same scale; the bound where the interval reaches it."""
    high: float
    """Upper end, likewise."""


class LikelihoodInterval(NamedTuple):
    """The 95 % interval of one parameter, in the parameter's own scale."""

    low: float
    high: float
    curve: Profile | None
    """The profile that the ends are taken from; None where they are linearised."""


def likelihood_interval(fitted: Fit, number: int) -> LikelihoodInterval:
    """The 95 % interval of parameter `number`.

    By its profile; where a prediction is slow, linearised, unless chi-square at the ends shows that this is wrong.
    """
    ends = linear_interval(fitted, number) if fitted.costly else None
    if ends is not None:
        return LikelihoodInterval(*ends, None)
    curve = profile(fitted, number)
    return LikelihoodInterval(curve.low, curve.high, curve)


def interval_ends(fitted: Fit, number: int) -> tuple[float, float]:
    """The ends of the 95 % interval of parameter `number`: linearised, or by its profile where that is wrong."""
    if linear := linear_interval(fitted, number):
        return linear
    curve = profile(fitted, number)
    return curve.low, curve.high


def profile(fitted: Fit, number: int) -> Profile:
    """The profile of parameter `number`.

    On either side, trials with all other parameters refitted begin at the end of the linearised interval.  They move
    inward or outward until chi-square has risen by that of a 95 % interval (`INTERVAL_RISE`).  If that is not met by
    `Settings.profile_trials` trials, the end is extrapolated from the last one.
    """
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
    """Ends of the linearised 95 % interval of parameter `number`, in its own scale and within its bounds, or None.

    Chi-square is evaluated at both ends, with the other parameters moved as the covariance says, by two predictions.
    None comes back where the rise shows the length of the interval off by more than a factor of
    `Settings.linear_interval_factor`, as where the readings feel the parameter to one side alone, and where the
    parameter is on one of its bounds.
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
