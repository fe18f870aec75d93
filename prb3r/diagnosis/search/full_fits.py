"""Which alternatives are worth a full fit, and these fits."""

from collections.abc import Callable, Iterable, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from prb3r.diagnosis.evidence.score_test import Alternative, Scores
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis

Apply = Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]
"""Applies a function to many tasks, here or in workers, and returns what it returned in their order."""


def serially(function: Callable[[Any], Any], tasks: Sequence[Any]) -> list[Any]:
    """One after the other, here."""
    return [function(task) for task in tasks]


def cornered(fitted: Fit) -> bool:
    """Whether a slightly softer manipulator has no equilibrium: the fit may be pinned there."""
    softer = fitted.p.copy()
    softer[0] -= fitted.model.settings.pinned_fall
    return not np.isfinite(fitted.model.solve(softer).readings).all()


def beginnings(base: Fit, candidate: Alternative, pinned: bool) -> list[np.ndarray]:
    """Where full fits with one more effect begin; from softer plates and a strong effect too where `base` is pinned."""
    found = [np.concatenate([base.p, candidate.start])]
    hypothesis = candidate.subject
    if not pinned or not hypothesis.mechanical:
        return found
    strong = [candidate.start]
    if hypothesis.by_degrees and len(hypothesis.free) == 1:
        low, high = hypothesis.free[0].bounds(base.model.friction(base.p))
        size = base.model.settings.strong_effect
        strong = [np.array([u]) for u in (-size, size, 3 * size) if low <= u <= high]
    for softer in base.model.settings.softer:
        softened = base.p.copy()
        softened[0] -= softer
        found += [np.concatenate([softened, u]) for u in strong]
    return found


def fits(base: Fit, candidates: Sequence[Alternative], apply: Apply = serially) -> list[Fit]:
    """Full fits of `base` with one more effect each; the best start of each hypothesis wins."""
    pinned = cornered(base)
    tasks = [(base, candidate, beginnings(base, candidate, pinned)) for candidate in candidates]
    return lowest(fitted for fitted in apply(_fit_from, tasks) if fitted is not None)


def _fit_from(task: tuple[Fit, Alternative, list[np.ndarray]]) -> Fit | None:
    """The best of the fits from several beginnings."""
    base, candidate, starts = task
    ends = [fit(base.model.adding(candidate.subject), start, useful=base.chi2) for start in starts]
    return min((fitted for fitted in ends if fitted is not None), key=lambda fitted: fitted.chi2, default=None)


def lowest(fits: Iterable[Fit]) -> list[Fit]:
    """Of fits of the same effects the best, in order of appearance."""
    best: dict[tuple[Hypothesis, ...], Fit] = {}
    for fitted in fits:
        effects = fitted.model.hypotheses
        if effects not in best or fitted.chi2 < best[effects].chi2:
            best[effects] = fitted
    return list(best.values())


def shortlist(tested: Scores, base: Fit) -> list[Alternative]:
    """The alternatives worth a full fit: the best hypotheses, and of each kind the best if it is not nothing.

    Effects that do not come by degrees are tried from their second probe too.
    """
    settings = base.model.settings
    order = [k for k in tested.best() if isinstance(tested.alternatives[k].subject, Hypothesis)]
    chosen, kinds = [], set()
    for place, k in enumerate(order):
        hypothesis, z = tested.alternatives[k].subject, tested.z[k]
        strong = z > settings.shortlist_share * tested.largest and place < settings.shortlist
        new = hypothesis.kind not in kinds and z > max(settings.kind_share * tested.largest, settings.kind_score)
        if SUSPECTS[hypothesis.kind].costly and z < settings.costly_share * tested.largest:
            continue  # a load path for every prediction
        if place < settings.always_fitted or strong or (new and not hypothesis.by_degrees):
            kinds.add(hypothesis.kind)
            chosen.append(k)
    picked = [tested.alternatives[k] for k in chosen]
    for first in picked[:]:
        others = [probe for probe in tested.alternatives if probe.subject is first.subject and probe is not first]
        picked += sorted(others, key=lambda probe: -float(probe.gain(base.residual)))[:1]
    return picked


def best_pairs(tested: Scores, base: Fit) -> list[tuple[Alternative, Alternative]]:
    """The pairs of alternatives that together would gain most, linearised; among the best and all that pair with
    them."""
    settings = base.model.settings
    best = [tested.alternatives[k] for k in tested.best()]
    best = [candidate for candidate in best if isinstance(candidate.subject, Hypothesis)][: settings.paired]
    gains = []
    for a, b in combinations(range(len(best)), 2):
        both = np.hstack([best[a].basis, best[b].basis])
        normal, along = both.T @ both, both.T @ base.residual
        gain = float(along @ np.linalg.solve(normal + 1e-6 * np.eye(len(normal)), along))
        gains.append((gain, a, b))
    gains.sort(reverse=True)
    return [(best[a], best[b]) for _, a, b in gains[: settings.pairs]]


def without_effect(fitted: Fit, number: int) -> Fit | None:
    """The model refitted without one of its effects; None where it has no equilibrium then."""
    return fit(fitted.model.without(number), fitted.model.without_share(fitted.p, number))


def pair_fits(calibrated: Fit, before: Scores, apply: Apply = serially) -> list[Fit]:
    """Full fits of the pairs that promise most."""
    tasks = [(calibrated, pair) for pair in best_pairs(before, calibrated)]
    return [fitted for fitted in apply(_fit_pair, tasks) if fitted is not None]


def _fit_pair(task: tuple[Fit, tuple[Alternative, Alternative]]) -> Fit | None:
    base, (a, b) = task
    start = np.concatenate([base.p, a.start, b.start])
    return fit(base.model.adding(a.subject, b.subject), start, useful=base.chi2)
