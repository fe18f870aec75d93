"""Calibration under doubt: covariance, gross outliers and wrong weights settled before any physics is judged."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts, NotedWeight, outlier_inflation, weight_alternatives
from prb3r.diagnosis.evidence.renewal import renewed
from prb3r.diagnosis.evidence.score_test import scores
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.settings import Settings


def without_outliers(rough: Fit) -> tuple[Fit, Doubts]:
    """A calibrated model with gross outliers weighed down, and how far."""
    settings = rough.model.settings
    fitted, doubts = rough, Doubts(np.ones(rough.model.predict.recording.readings.count))
    for _ in range(settings.doubt_rounds):
        if not settings.believe_all:
            doubts = Doubts(outlier_inflation(fitted.model.predict, fitted.solved.readings, settings))
        fitted = renewed(fitted, doubts)
    return fitted, doubts


def without_wrong_weights(fitted: Fit, doubts: Doubts, search: Search) -> tuple[Fit, Doubts]:
    """A calibrated model without belief in the weights that were noted wrongly, and these."""
    settings = fitted.model.settings
    for _ in range(0 if settings.believe_all else settings.most_wrong_weights):
        wrong = wrong_weight(fitted, search, doubts.weights)
        if wrong is None:
            break
        doubts = replace(doubts, weights=(*doubts.weights, wrong))
        fitted = renewed(fitted, doubts)
    return fitted, doubts


def wrong_weight(fitted: Fit, search: Search, known: Sequence[NotedWeight]) -> NotedWeight | None:
    """The weight that explains more than any effect and any law could, if there is one; `known` are others."""
    sensitivity = tension_response(fitted.model.predict, fitted.solved)
    doubted = {weight.step for weight in known}
    candidates = [weight for weight in weight_alternatives(fitted, sensitivity) if weight.subject.step not in doubted]
    tested = scores(fitted, candidates, search.seed)
    if tested.largest <= tested.naming:
        return None
    others = examine(fitted, search)
    if tested.largest <= others.largest:
        return None
    step = candidates[int(np.argmax(tested.z))].subject.step
    return likeliest(fitted.model.predict, fitted.model.noise, fitted.solved, step, fitted.model.settings).weight


class OtherWeight(NamedTuple):
    """A weight that was another one than was noted."""

    weight: NotedWeight
    misfit: float
    """Squared, of its step's readings, in units of their own noise."""
    readings: np.ndarray
    """(r,) predicted, m and rad."""


def likeliest(predict: Predictor, noise: Noise, solved: Solution, step: int, settings: Settings) -> OtherWeight:
    """Of all weights on a step, and what each may have been instead, what explains the step's readings best."""
    loads, there = predict.recording.loads, predict.recording.readings.step == step

    def other(cable: int, factor: float) -> OtherWeight:
        tension = loads.tension.copy()
        tension[step, cable] *= factor
        predicted = predict(solved.constants, solved.effects, loads._replace(tension=tension))
        misfit = np.sum((predict.misfit(predicted)[there] / noise.sd[there]) ** 2)
        return OtherWeight(NotedWeight(step, cable), float(np.nan_to_num(misfit, nan=np.inf)), predicted)

    cables = np.flatnonzero(loads.tension[step] > 0).tolist()
    others = [other(cable, factor) for cable in cables for factor in np.geomspace(*settings.other_weights)]
    return min(others, key=lambda other: other.misfit)
