"""A start from plates that soften until something stops them, for recordings that no other start explains.

Plates that soften bend so far that notches close or disks touch; without that stop the arm has no equilibrium under the
recorded loads.  So neither effect is of use alone, the linearised model around a fit without both shows neither, and a
fit of all common effects may end where neither acts.  A pair is fitted from all sizes at which its effects are tried.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit, Model
from prb3r.diagnosis.library.hypothesis import FORMS, Hypothesis
from prb3r.diagnosis.search.search import Search

SOFTENING = frozenset({"nonlinear_plate", "superelastic_plate", "hysteretic_plate"})
"""Kinds of effects by which plates soften."""
STOPPING = frozenset({"disk_contact", "notch_closing"})
"""Kinds of effects that stop plates from bending further."""


def paired(calibrated: Fit, search: Search) -> list[Fit]:
    """The best fit of every softening law together with every stop and constants.

    Left out are pairs without a fit, and those that leave most of the chi-square of the constants alone
    (`Settings.saturated_leaves`).
    """
    tasks = [(calibrated, pair) for pair in softening_to_a_stop(search.library)]
    return [fitted for fitted in search.apply(_best_of_pair, tasks) if fitted is not None]


def softening_to_a_stop(library: Sequence[Hypothesis]) -> Iterator[tuple[Hypothesis, Hypothesis]]:
    """Every softening law with every stop, of those hypotheses on the whole rig that have probes and are not costly."""
    tried = [each for each in library if each.probes and not each.costly and {name for name, _ in each.place} <= FORMS]
    for law, stop in product(tried, tried):
        if law.kind in SOFTENING and stop.kind in STOPPING:
            yield law, stop


def _best_of_pair(task: tuple[Fit, tuple[Hypothesis, Hypothesis]]) -> Fit | None:
    """The best fit of a pair: a few steps from every combination of starts, then full fits from the best of these.

    None without a fit, or if the few steps leave most of the chi-square of the constants alone.
    """
    calibrated, pair = task
    model, friction = replace(calibrated.model, hypotheses=pair), calibrated.model.friction(calibrated.p)
    starts = [np.concatenate([calibrated.p, *u]) for u in product(*(effect.starts(friction) for effect in pair))]
    begun = fitted_from(model, starts, model.settings.pair_steps)
    if not begun or begun[0].chi2 >= model.settings.saturated_leaves * calibrated.chi2:
        return None
    lowest = [fitted.p for fitted in begun[: model.settings.pair_starts]]
    return next(iter(fitted_from(model, lowest)), None)


def fitted_from(model: Model, starts: Sequence[np.ndarray], most: int | None = None) -> list[Fit]:
    """Fits from some starts after at most `most` steps, smallest chi-square first; starts without a fit left out."""
    fits = (fit(model, start, most_steps=most) for start in starts)
    return sorted((fitted for fitted in fits if fitted is not None), key=lambda fitted: fitted.chi2)
