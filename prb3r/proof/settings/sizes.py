"""What counts as the same, as different and as detectable: distances of whitened readings."""

import math
from dataclasses import dataclass

from prb3r.diagnosis.chance import normal_critical


def squared_distance(error: float) -> float:
    """Squared distance of two hypotheses of which the better-fitting one is the wrong one with a probability `error`.

    Of two simple hypotheses at distance d the likelihood ratio errs with probability Phi(-d / 2) (Neyman and Pearson),
    so that d^2 = 4 z(error)^2; rounded up to a whole number.
    """
    return float(math.ceil(4 * normal_critical(error) ** 2))


def detectable_norm(alarms: float, tests: int, misses: float) -> float:
    """Norm of a change that the largest of `tests` two-sided tests misses with a probability `misses`.

    Bonferroni's threshold z(alarms / 2 / tests) for `alarms` false alarms, and z(misses) beyond it; to one decimal.
    """
    return round(float(normal_critical(alarms / 2 / tests) + normal_critical(misses)), 1)


@dataclass(frozen=True)
class Sizes:
    """Distances and norms, in units of noise, and how they are computed."""

    same: float = squared_distance(0.05)
    """Squared distance below which two effects are one: 4 z(0.05)^2 = 10.8, the wrong one wins once in twenty."""
    apart: float = squared_distance(0.01)
    """Squared distance from which on two effects are two: 4 z(0.01)^2 = 21.6, the wrong one wins once in a hundred."""
    detectable: float = detectable_norm(0.01, 100, 0.1)
    """Norm of the smallest detectable change, 5.2: noticed nine times in ten at 1 % false alarms among a hundred
    directions, which is what the hypotheses of a recording of ten plates come to."""
    far_outside: float = 100.0
    """Squared distance from every effect at which physics counts as outside the library.  A choice: at a distance
    of ten deviations the nearest effect is no description of the readings."""
    refitted_below: float = 60.0
    """Rivals that are nearer than this by the linear rule are refitted with the full rig.  A choice, nearly three times
    `apart`, for cost."""
    most_refitted: int = 3
    """Of them: the nearest.  A choice, for cost."""
    refits: int = 3
    """Gauss-Newton steps of a refit, the Jacobian kept.  A choice, for cost: distances end too large."""
    refit_gain: float = 0.99
    """A step that leaves more of the squared distance than this is the last: a per cent decides nothing."""
    relative_change: float = 1e-3
    """Of constants and tensions for one-sided derivatives; the tolerance of the rig is a thousandth of it."""
    rank_tolerance: float = 1e-9
    """Singular values of normal equations below this part of the largest are zero: columns are parallel to 3e-5."""
    size_tolerance: float = 0.05
    """To which the norm of an effect meets the one asked for: far below the steps between sizes."""
    size_trials: int = 5
    """Secant steps through zero to such a size; an effect that takes more is too far from linear to be drawn."""
    class_margin: float = 0.9
    """Of the norm that a size stands for: from there on a label counts among those of that size, its constants not
    being the nominal ones."""
