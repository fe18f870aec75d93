"""The linearised model around a fit: how every hypothesis moves the readings, and what all effects have to explain."""

from collections.abc import Mapping, Sequence

import numpy as np

from prb3r.diagnosis.evidence.linearised import moved_readings, probes_of
from prb3r.diagnosis.fit.basis import all_at_once, basis_of, projected_out
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.linear_selection import Column, LinearModel

STEEPEST = 1e8
"""Largest credible change of a whitened reading by one prior standard deviation of a parameter.  An arm of a metre that
is read to 10 nm does not move by more, but derivatives grow without bound where a branch of equilibria ends."""
LARGE_EFFECT, LEAST_FELT = 3.0, 0.1
"""Size of an effect in prior standard deviations, and the part of its standard deviation by which some reading has to
move at that size.  An effect that moves none further, such as the weight of a wrist of a gram, is as probable after the
recording as before: sets need not hold it.  Choice: a hundred readings tell no more than a unit of chi-square of it."""


def linear_model(
    fitted: Fit, library: Sequence[Hypothesis], log_odds: Mapping[Hypothesis, float]
) -> tuple[LinearModel, frozenset[int]]:
    """The linearised model around `fitted`, and the numbers of the columns of its own effects, which come first.

    Hypotheses that no reading feels (:func:`may_be_felt`), or that move some by more than `STEEPEST`, get no column.
    """
    model = fitted.model
    constants = len(model.varied)
    rows = model.recording.readings.count + constants
    basis = basis_of(fitted.jacobian[:rows, :constants])

    target = fitted.residual[:rows, None]
    columns = []
    for number, (hypothesis, span) in enumerate(zip(model.hypotheses, model.spans, strict=True)):
        moved, at = _of_fitted(fitted, number)
        moved = no_steeper(moved)
        columns.append(Column(hypothesis, projected_out(moved, basis), fitted.p[span], 0, log_odds[hypothesis]))
        target = target + np.vstack([moved, np.zeros((constants, moved.shape[1]))]) @ at[:, None]
    friction = model.friction(fitted.p)
    probes = probes_of(fitted, [hypothesis for hypothesis in library if hypothesis not in model.hypotheses])
    changes = [
        change * (hypothesis.deviations if hypothesis.continuous else 1.0)
        for (hypothesis, _), change in zip(probes, moved_readings(fitted, probes), strict=True)
    ]
    felt = [k for k, (one, _) in enumerate(probes) if not one.continuous or may_be_felt(changes[k], model.noise)]
    white = all_at_once(lambda whole: projected_out(model.noise.whiten(whole), basis), [changes[k] for k in felt])
    for (hypothesis, start), values in zip([probes[k] for k in felt], white, strict=True):
        if not felt_within_bounds(values):
            continue
        sign = int(hypothesis.one_sided(friction))
        columns.append(Column(hypothesis, values, start, sign, log_odds[hypothesis]))
    target = target - basis @ (basis.T @ target)
    return LinearModel(columns, target[:, 0]), frozenset(range(len(model.hypotheses)))


def may_be_felt(change: np.ndarray, noise: Noise) -> bool:
    """Whether an effect of `LARGE_EFFECT` prior sd moves any reading by more than `LEAST_FELT` of its sd.

    `change`: (r, k) of the readings, per prior standard deviation of each free parameter.
    """
    return bool((LARGE_EFFECT * np.abs(change) > LEAST_FELT * noise.total_sd[:, None]).any())


def no_steeper(moved: np.ndarray) -> np.ndarray:
    """(r, k) whitened changes, all scaled by one factor if need be, so that none exceeds `STEEPEST`."""
    return moved * min(1.0, STEEPEST / max(np.abs(moved).max(initial=0.0), 1.0))


def felt_within_bounds(moved: np.ndarray) -> bool:
    """Whether whitened changes (r, k) move any reading, and none by more than `STEEPEST`."""
    return bool(np.abs(moved).max(initial=0.0) <= STEEPEST and moved.any())


def _of_fitted(fitted: Fit, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns of the fitted effect `number`, (r, k) whitened, and the coefficients (k,) that they have in the fit.

    The columns of an effect that vanishes continuously are its derivatives per prior standard deviation.  The first
    column of any other is the change by the whole effect, with the coefficient 1; its derivatives follow, with 0.
    """
    model = fitted.model
    hypothesis, span = model.hypotheses[number], model.spans[number]
    tangent = -fitted.jacobian[: len(fitted.misfit), span] * hypothesis.deviations
    if hypothesis.continuous:
        return tangent, fitted.p[span] / hypothesis.deviations
    less = model.without(number)
    without = less.predict.solve(fitted.constants, less.effects(model.without_share(fitted.p, number)))
    whole = model.noise.whiten(model.readings(fitted.solved) - less.readings(without))
    return np.hstack([whole[:, None], tangent]), np.concatenate([[1.0], np.zeros(len(hypothesis.free))])


def beginning(fitted: Fit, linear: LinearModel, chosen: Sequence[int]) -> tuple[tuple[Hypothesis, ...], np.ndarray]:
    """The hypotheses of the `chosen` columns, and the parameters (p,) that a full fit of them begins from."""
    model, known = fitted.model, fitted.model.hypotheses
    parts = [fitted.p[: len(model.varied)]]
    for k, coefficient in zip(chosen, linear.coefficients(chosen), strict=True):
        column = linear.columns[k]
        hypothesis = column.hypothesis
        if hypothesis in known or not hypothesis.continuous:
            parts.append(column.start)
            continue
        parts.append(first_size(hypothesis, column.start, coefficient, model.friction(fitted.p)))
    return tuple(linear.columns[k].hypothesis for k in chosen), np.concatenate(parts)


def first_size(hypothesis: Hypothesis, start: np.ndarray, coefficient: np.ndarray, friction: float) -> np.ndarray:
    """(k,) free parameters from which a full fit of a new effect begins.

    They are those of the linearised model, limited to half of the distance to their bounds, or those of `start` where
    these are larger.
    """
    low, high = np.array([free.bounds(friction) for free in hypothesis.free]).T
    way = np.sign(start) if hypothesis.kinked else np.where(start < high, 1.0, -1.0)
    size = np.clip(coefficient * hypothesis.deviations * way, low / 2, high / 2)
    return np.where(np.abs(size) > np.abs(start), size, start)
