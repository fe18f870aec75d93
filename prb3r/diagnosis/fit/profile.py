"""How far a parameter may move before the fit, all others refitted, becomes too poor: intervals by profile."""

from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.fit.calibrate import Fit, fit

RISE = 3.841
"""Rise of chi-square at the ends of a 95 % interval."""
TRIALS = 5


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
    """Profile of parameter `number`: from the linearised interval outward, until the rise is passed on both sides."""
    middle = fitted.p[number]
    sd = float(np.sqrt(max(fitted.covariance[number, number], 1e-24)))
    low, high = (bound[number] for bound in fitted.model.bounds(fitted.p))
    u, rise, ends = [middle], [0.0], []
    for sign, bound in ((-1, low), (1, high)):
        reach, inside, found = 1.96 * sd, 0.0, None
        start = fitted
        for _ in range(TRIALS):
            away = min(reach, abs(bound - middle))
            p = start.p.copy()
            p[number] = middle + sign * away
            trial = fit(fitted.model, p, fixed=(number,))
            risen = trial.chi2 - fitted.chi2 if trial is not None else np.inf
            u.append(middle + sign * away)
            rise.append(risen)
            if trial is not None:
                start = trial
            if abs(risen - RISE) < 0.1 or (away < reach and risen < RISE):
                found = away
                break
            guess = away * np.sqrt(RISE / max(risen, 0.05)) if np.isfinite(risen) else (inside + away) / 2
            if risen < RISE:
                inside = away
            reach, found = float(np.clip(guess, max(0.3 * away, inside), 3 * away)), guess
        ends.append(middle + sign * min(found or reach, abs(bound - middle)))
    order = np.argsort(u)
    finite = np.isfinite(np.asarray(rise)[order])
    return Profile(np.asarray(u)[order][finite], np.asarray(rise)[order][finite], float(ends[0]), float(ends[1]))
