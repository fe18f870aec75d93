"""Which effects explain a recording: forward selection, pairs, backward deletion, whole sequences left out."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from scipy.stats import chi2 as chi2_law

from prb3r.diagnosis.evidence.missing_moments import law_directions, laws, mechanism
from prb3r.diagnosis.evidence.score_test import LEVEL, NAMING_LEVEL, Direction, Scores, directions, scores
from prb3r.diagnosis.fit.calibrate import Fit, fit
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis

Each = Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]
"""Applies a function to many tasks, here or in workers, and returns what it returned in their order."""
SHORTLIST, SURE = 12, 5
"""Most hypotheses that are fitted in full, and how many always are."""
PAIRS = 8
MOST_EFFECTS = 3
BIC_FALL = 10.0
AT_BOUND = 1e-6
COSTLY = 0.7
"""Share of the largest score from which on an effect is fitted that makes every prediction slow."""
MOST_EXCHANGES, BETTER = 3, 2.0
"""How often effects are exchanged, and by how much cost must fall for that."""
UNKNOWN = 1e-9
"""Share of a parameter's information that left-out sequences are taken to leave at least."""
SHARE = 8
"""Hypotheses that are tested in one task."""
STRONG, SOFTER = 0.2, (0.35, 0.7)
"""Sizes of effects, and falls of ln stiffness, that a fit begins from where softer plates alone have no equilibrium."""


def serially(function: Callable[[Any], Any], tasks: Sequence[Any]) -> list[Any]:
    """One after the other, here."""
    return [function(task) for task in tasks]


@dataclass(frozen=True)
class Search:
    """Among what is searched, and how."""

    library: tuple[Hypothesis, ...]
    seed: int
    """Of the draws that tell how large the largest score is by chance."""
    each: Each = serially
    alone: bool = False
    """Whether every hypothesis is judged as if it were the only one: what that costs is for benchmarks to show."""


def left_out(fitted: Fit) -> np.ndarray:
    """(q,) deviance of each sequence as predicted by a fit to all others (linearised, exact for linear models).

    With the hat matrix H of the whole fit, a left-out block has the error (I - H_bb)^-1 r_b and scatters with the
    covariance (I - H_bb)^-1, so that parameters which the others do not tell are not blamed for what they cannot know.
    """
    recording = fitted.model.predict.recording
    of_reading = recording.of_sequence[recording.readings.step]
    basis, residual = fitted.basis[: len(of_reading)], fitted.residual[: len(of_reading)]
    deviance = np.zeros(len(recording.sequences))
    for k in range(len(deviance)):
        own = of_reading == k
        part = basis[own]
        inner = np.eye(part.shape[1]) - part.T @ part + UNKNOWN * np.eye(part.shape[1])
        along = part.T @ residual[own]
        deviance[k] = residual[own] @ residual[own] + along @ np.linalg.solve(inner, along)
        deviance[k] -= np.linalg.slogdet(inner)[1]
    return deviance


def bic(fitted: Fit) -> float:
    """Chi-square and a penalty on parameters; sequences, not coordinates, count as independent."""
    return fitted.chi2 + len(fitted.p) * np.log(max(len(fitted.model.predict.recording.sequences), 2))


def cost(fitted: Fit) -> float:
    """Chi-square with the penalty that ranks models of different size: every reading counts."""
    return fitted.chi2 + len(fitted.p) * np.log(fitted.model.predict.recording.readings.count)


def improves_left_out(simple: Fit, rich: Fit) -> bool:
    """Whether whole sequences left out are predicted better: their log score, paired by sequence."""
    return float((left_out(rich) - left_out(simple)).sum()) < 0


def plausible(fitted: Fit) -> bool:
    """Whether no parameter of an effect ends on its bound, but for limits where all values act alike."""
    low, high = fitted.model.bounds(fitted.p)
    own = slice(len(fitted.model.varied), None)
    limits = np.array([free.limit for each in fitted.model.hypotheses for free in each.free], bool)
    at_null = [
        each.by_degrees and abs(u).max() < AT_BOUND
        for each, u in zip(fitted.model.hypotheses, fitted.model.shares(fitted.p), strict=True)
        if len(u)
    ]
    inside = (limits | (fitted.p[own] > low[own] + AT_BOUND)) & (fitted.p[own] < high[own] - AT_BOUND)
    return bool(inside.all()) and not any(at_null)


@dataclass(frozen=True, eq=False)
class Choice:
    """What selection found."""

    fitted: Fit
    """The chosen model; without effects, the calibrated one."""
    tried: tuple[Fit, ...]
    """Every full fit, for rivals and the ranking."""
    scores: Scores
    """Score test of what the chosen model leaves."""
    chi2_threshold: float

    @property
    def structured(self) -> bool:
        """Whether something is left that chance does not explain; a model with effects has been tested before."""
        again = bool(self.fitted.model.hypotheses)
        limit = self.scores.naming if again else self.scores.threshold
        return self.scores.largest > limit or self.fitted.chi2 > self.chi2_threshold


def chi2_threshold(fitted: Fit) -> float:
    """The chi-square that a right model exceeds in a share of `LEVEL`, or of `NAMING_LEVEL` if it has effects."""
    level = NAMING_LEVEL if fitted.model.hypotheses else LEVEL
    return float(chi2_law.isf(level, fitted.freedom))


def cornered(fitted: Fit) -> bool:
    """Whether a slightly softer manipulator has no equilibrium: the fit may be pinned there."""
    softer = fitted.p.copy()
    softer[0] -= 0.1
    return not np.isfinite(fitted.model.predicted(softer)).all()


def beginnings(base: Fit, candidate: Direction, pinned: bool) -> list[np.ndarray]:
    """Where full fits with one more effect begin; from softer plates and a strong effect too where `base` is pinned."""
    found = [np.concatenate([base.p, candidate.start])]
    hypothesis = candidate.subject
    if not pinned or not hypothesis.mechanical:
        return found
    strong = [candidate.start]
    if hypothesis.by_degrees and len(hypothesis.free) == 1:
        low, high = hypothesis.free[0].bounds(base.model.friction(base.p))
        strong = [np.array([u]) for u in (-STRONG, STRONG, 3 * STRONG) if low <= u <= high]
    for softer in SOFTER:
        softened = base.p.copy()
        softened[0] -= softer
        found += [np.concatenate([softened, u]) for u in strong]
    return found


def fits(base: Fit, candidates: Sequence[Direction], each: Each = serially) -> list[Fit]:
    """Full fits of `base` with one more effect each; the best start of each hypothesis wins."""
    pinned = cornered(base)
    tasks = [(base, candidate, beginnings(base, candidate, pinned)) for candidate in candidates]
    return lowest(fitted for fitted in each(_fit_from, tasks) if fitted is not None)


def _fit_from(task: tuple[Fit, Direction, list[np.ndarray]]) -> Fit | None:
    """The best of the fits from several beginnings."""
    base, candidate, starts = task
    found = [fit(base.model.adding(candidate.subject), start, useful=base.chi2) for start in starts]
    return min((one for one in found if one is not None), key=lambda one: one.chi2, default=None)


def lowest(found: Iterable[Fit]) -> list[Fit]:
    """Of fits of the same effects the best, in order of appearance."""
    best: dict[tuple[Hypothesis, ...], Fit] = {}
    for each in found:
        own = each.model.hypotheses
        if own not in best or each.chi2 < best[own].chi2:
            best[own] = each
    return list(best.values())


def shortlist(found: Scores, residual: np.ndarray, count: int = SHORTLIST) -> list[Direction]:
    """The directions worth a full fit: the best hypotheses, and of each kind the best if it is not nothing.

    Effects that do not come by degrees are tried from their second probe too.
    """
    order = [k for k in found.best() if isinstance(found.directions[k].subject, Hypothesis)]
    chosen, kinds = [], set()
    for place, k in enumerate(order):
        hypothesis = found.directions[k].subject
        strong = found.z[k] > 0.5 * found.largest and place < count
        new = hypothesis.kind not in kinds and found.z[k] > max(0.3 * found.largest, 2.0)
        if SUSPECTS[hypothesis.kind].costly and found.z[k] < COSTLY * found.largest:
            continue  # a load path for every prediction
        if place < SURE or strong or (new and not hypothesis.by_degrees):
            kinds.add(hypothesis.kind)
            chosen.append(k)
    picked = [found.directions[k] for k in chosen]
    for k in chosen:
        others = [d for m, d in enumerate(found.directions) if d.subject is found.directions[k].subject and m != k]
        picked += sorted(others, key=lambda d: -float(d.gain(residual)))[:1]
    return picked


def best_pairs(found: Scores, residual: np.ndarray, count: int) -> list[tuple[Direction, Direction]]:
    """The pairs of directions that together would gain most, linearised; among the best and all that pair with them."""
    order = [d for k in found.best() if isinstance((d := found.directions[k]).subject, Hypothesis)][:60]
    gains = []
    for a, b in combinations(range(len(order)), 2):
        both = np.hstack([order[a].basis, order[b].basis])
        normal, along = both.T @ both, both.T @ residual
        gain = float(along @ np.linalg.solve(normal + 1e-6 * np.eye(len(normal)), along))
        gains.append((gain, a, b))
    gains.sort(reverse=True)
    return [(order[a], order[b]) for _, a, b in gains[:count]]


def accepted(simple: Fit, rich: Fit, threshold: float) -> bool:
    """Whether the additional effects of `rich` are kept: beyond chance, by BIC, on left-out sequences, plausible."""
    more = len(rich.model.hypotheses) - len(simple.model.hypotheses)
    gain = simple.chi2 - rich.chi2
    return (
        gain > more * threshold**2
        and bic(simple) - bic(rich) > BIC_FALL
        and improves_left_out(simple, rich)
        and plausible(rich)
    )


def examine(fitted: Fit, search: Search, without: Sequence[Hypothesis] = ()) -> Scores:
    """Score test of what `fitted` leaves: every hypothesis that it lacks, and every law without a mechanism."""
    left_alone = {*fitted.model.hypotheses, *without}
    rest = [hypothesis for hypothesis in search.library if hypothesis not in left_alone]
    history = fitted.model.predict.chain_of(fitted.constants, fitted.effects).presliding > 0
    share = SHARE if history else max(len(rest), 1)
    tasks = [(fitted, rest[k : k + share]) for k in range(0, len(rest), share)]
    named = [direction for part in (search.each if history else serially)(_directions, tasks) for direction in part]
    mechanics = mechanism(fitted)
    unnamed = law_directions(fitted, mechanics, laws(fitted, mechanics))
    return scores(fitted, [*named, *unnamed], search.seed, search.alone)


def _directions(task: tuple[Fit, list[Hypothesis]]) -> list[Direction]:
    return directions(*task)


def choose(calibrated: Fit, search: Search, before: Scores | None = None) -> Choice:
    """Forward selection to `MOST_EFFECTS`, with all pairs of the best at the second, and backward deletion.

    `before` is the score test of the calibrated model, if it was made.
    """
    before = before or examine(calibrated, search)
    current, left, tried = calibrated, before, []
    for _ in range(MOST_EFFECTS):
        if not Choice(current, (), left, chi2_threshold(current)).structured:
            break
        found = fits(current, shortlist(left, current.residual), search.each)
        if len(current.model.hypotheses) == 1:
            found += pair_fits(calibrated, before, search.each)
        tried += found
        good = [one for one in found if accepted(_parent(one, calibrated, current), one, left.naming)]
        if not good:
            break
        best = without_needless(min(good, key=cost), left.naming)
        current, more = exchanged(best, search)
        tried += more
        left = examine(current, search)
    return Choice(current, tuple(tried), left, chi2_threshold(current))


def exchanged(chosen: Fit, search: Search) -> tuple[Fit, list[Fit]]:
    """The model with effects exchanged for better ones, as what came first may have stood in for what came later.

    Also returns all full fits that were made on the way.
    """
    own = chosen.model.hypotheses
    known: dict[frozenset[Hypothesis], list[Fit]] = {}  # by the effects that stay
    for _ in range(MOST_EXCHANGES if len(own) > 1 else 0):
        for k in range(len(own)):
            if (others := frozenset(own) - {own[k]}) not in known:
                known[others] = replacements(chosen, k, search)
        better = [one for found in known.values() for one in found if plausible(one)]
        best = min(better, key=cost, default=chosen)
        if cost(best) >= cost(chosen) - BETTER:
            break
        chosen, own = best, best.model.hypotheses
    return chosen, [one for found in known.values() for one in found]


def replacements(chosen: Fit, number: int, search: Search) -> list[Fit]:
    """Full fits of the chosen model with effect `number` replaced."""
    own, shares = chosen.model.hypotheses, chosen.model.shares(chosen.p)
    model = replace(chosen.model, hypotheses=own[:number] + own[number + 1 :])
    base = fit(model, np.concatenate([chosen.p[: len(model.varied)], *shares[:number], *shares[number + 1 :]]))
    if base is None:
        return []
    left = examine(base, search, without=[own[number]])
    return fits(base, shortlist(left, base.residual), search.each)


def _parent(rich: Fit, calibrated: Fit, current: Fit) -> Fit:
    own = set(current.model.hypotheses)
    return current if own <= set(rich.model.hypotheses) else calibrated


def pair_fits(calibrated: Fit, before: Scores, each: Each = serially) -> list[Fit]:
    """Full fits of the pairs that promise most."""
    tasks = [(calibrated, pair) for pair in best_pairs(before, calibrated.residual, PAIRS)]
    return [fitted for fitted in each(_fit_pair, tasks) if fitted is not None]


def _fit_pair(task: tuple[Fit, tuple[Direction, Direction]]) -> Fit | None:
    base, (a, b) = task
    start = np.concatenate([base.p, a.start, b.start])
    return fit(base.model.adding(a.subject, b.subject), start, useful=base.chi2)


def without_needless(fitted: Fit, threshold: float) -> Fit:
    """Backward deletion: drop effects whose absence costs no more than chance."""
    own = fitted.model.hypotheses
    if len(own) < 2:
        return fitted
    for k in range(len(own)):
        model = replace(fitted.model, hypotheses=own[:k] + own[k + 1 :])
        shares = fitted.model.shares(fitted.p)
        start = np.concatenate([fitted.p[: len(model.varied)], *shares[:k], *shares[k + 1 :]])
        simpler = fit(model, start)
        if simpler is not None and simpler.chi2 - fitted.chi2 <= threshold**2:
            return without_needless(simpler, threshold)
    return fitted
