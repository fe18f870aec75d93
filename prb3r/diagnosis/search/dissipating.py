"""A start from plates that dissipate, for recordings that no other start explains.

Where plates are bent to and fro, loops that they make by themselves look in part like what goes on from step to step:
creep, drifts, a stiffness that changes.  Each of these takes a part of a loop's chi-square with one number, where a law
of the plates takes two, so that a search which adds one effect after another is led past the law.
"""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import FORMS, Hypothesis
from prb3r.diagnosis.search.pairs import fitted_from
from prb3r.diagnosis.search.search import Search

DISSIPATING = "hysteretic_plate", "flag_hysteresis"
"""Kinds of effects by which plates dissipate."""


def dissipating(calibrated: Fit, search: Search) -> Fit | None:
    """The best fit of one law by which all plates dissipate, with constants; None where the library has none, or where
    each leaves most of the chi-square of the constants alone (`Settings.saturated_leaves`)."""
    laws = [each for each in search.library if each.kind in DISSIPATING and {name for name, _ in each.place} <= FORMS]
    found = search.apply(_best_of_law, [(calibrated, law) for law in laws])
    return min(filter(None, found), key=lambda fitted: fitted.chi2, default=None)


def _best_of_law(task: tuple[Fit, Hypothesis]) -> Fit | None:
    """The best fit of a law: a few steps from every start, then a full fit from the best; None as of
    :func:`dissipating`."""
    calibrated, law = task
    model, friction = replace(calibrated.model, hypotheses=(law,)), calibrated.model.friction(calibrated.p)
    starts = [np.concatenate([calibrated.p, u]) for u in law.starts(friction)]
    begun = fitted_from(model, starts, model.settings.pair_steps)
    if not begun or begun[0].chi2 >= model.settings.saturated_leaves * calibrated.chi2:
        return None
    return fit(model, begun[0].p)
