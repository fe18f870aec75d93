"""Calibration without gross outliers and wrongly noted weights, which are found before any effect is considered."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts, NotedWeight, outlier_inflation, student, weight_alternatives
from prb3r.diagnosis.evidence.renewal import level_under, renewed
from prb3r.diagnosis.evidence.score_test import scores
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.settings import Settings
from prb3r.model.steps import with_tensions

FEWEST_TO_TELL = 3
"""Readings of a step from which on a wrong reading is told from a wrong weight: of two, one may always be left out."""


def without_outliers(rough: Fit) -> tuple[Fit, Doubts]:
    """The calibrated model refitted with gross outliers down-weighted, and the factors on their standard deviations."""
    settings = rough.model.settings
    fitted, doubts = rough, Doubts.as_stated(rough.recording, np.ones(rough.recording.readings.count))
    for _ in range(settings.doubt_rounds):
        if not settings.believe_all:
            doubts = Doubts.as_stated(
                fitted.recording, outlier_inflation(fitted.model.predict, fitted.solved.readings, settings)
            )
        fitted = renewed(fitted, doubts)
    return fitted, doubts


def without_wrong_weights(fitted: Fit, doubts: Doubts, search: Search) -> tuple[Fit, Doubts]:
    """The calibrated model refitted without wrongly noted weights, and `doubts` with these added.

    At most `Settings.most_wrong_weights` are sought, one after the other.  Where a single reading of the step is off,
    and no other weight explains all of them as well, that reading is down-weighted instead.
    """
    settings = fitted.model.settings
    for _ in range(0 if settings.believe_all else settings.most_wrong_weights):
        wrong = wrong_weight(fitted, search, doubts)
        if wrong is None:
            break
        alone = lone_reading(fitted, wrong)
        if alone is None:
            doubts = replace(doubts, weights=(*doubts.weights, wrong.weight))
        else:
            inflation = doubts.inflation.copy()
            inflation[alone] = student(_deviation(fitted)[alone])
            doubts = replace(doubts, inflation=inflation)
        fitted = renewed(fitted, doubts)
    return fitted, doubts


def lone_reading(fitted: Fit, wrong: "OtherWeight") -> int | None:
    """The reading of a step that is off alone: but for it the step is explained no worse than with the weight that
    explains all its readings best; None if there is none, or if the step has too few readings to tell
    (`FEWEST_TO_TELL`).
    """
    there = np.flatnonzero(fitted.recording.readings.step == wrong.weight.step)
    missed = _deviation(fitted)[there] ** 2
    if len(there) < FEWEST_TO_TELL or missed.sum() - missed.max() > wrong.misfit:
        return None
    return int(there[np.argmax(missed)])


def _deviation(fitted: Fit) -> np.ndarray:
    """(r,) distance of every reading from a fit, in its standard deviations."""
    return fitted.model.predict.misfit(fitted.solved.readings) / fitted.model.noise.sd


def wrong_weight(fitted: Fit, search: Search, doubts: Doubts) -> "OtherWeight | None":
    """The weight that was noted wrongly, with the value that explains its step best; None unless its score is
    significant and above that of any effect or moment law.

    Scores are in units of the stated noise.  If the readings scatter more than stated, so do the scores of right
    weights; the critical value is therefore scaled to the noise level estimated beside all effects of the library.

    The weight with the largest score determines the step.  Of all weights on that step, the one is returned of which
    another value explains the readings of the step best (:func:`likeliest`).

    Parameters
    ----------
    doubts : readings and weights doubted so far; the steps of these weights are not examined again.
    """
    sensitivity = tension_response(fitted.model.predict, fitted.solved)
    doubted = {weight.step for weight in doubts.weights}
    candidates = [weight for weight in weight_alternatives(fitted, sensitivity) if weight.subject.step not in doubted]
    tested = scores(fitted, candidates, search.seed)
    if tested.largest <= tested.naming:
        return None
    others = examine(fitted, search)
    if tested.largest <= others.largest:
        return None
    if tested.largest <= tested.naming * level_under(fitted, doubts, search.library).level.scale:
        return None
    step = candidates[int(np.argmax(tested.z))].subject.step
    return likeliest(fitted.model.predict, fitted.model.noise, fitted.solved, step, fitted.model.settings)


class OtherWeight(NamedTuple):
    """A noted weight with another value tried in its place."""

    weight: NotedWeight
    misfit: float
    """Sum of squared misfits of the readings of its step in units of their noise; infinite without equilibrium."""
    readings: np.ndarray
    """(r,) all readings predicted with that value, m and rad."""


def likeliest(predict: Predictor, noise: Noise, solved: Solution, step: int, settings: Settings) -> OtherWeight:
    """The weight on a step, and the other value of it, that explain the readings of the step best.

    Every weight on the step is tried, multiplied by each of the factors of `Settings.other_weights`.
    """
    loads, there = predict.recording.loads, predict.recording.readings.step == step

    def other(cable: int, factor: float) -> OtherWeight:
        tension = loads.tension.copy()
        tension[step, cable] *= factor
        pulled = with_tensions(loads, tension, predict.recording.begins)
        predicted = predict(solved.constants, solved.effects, pulled)
        misfit = np.sum((predict.misfit(predicted)[there] / noise.sd[there]) ** 2)
        return OtherWeight(NotedWeight(step, cable), float(np.nan_to_num(misfit, nan=np.inf)), predicted)

    cables = np.flatnonzero(loads.tension[step] > 0).tolist()
    others = [other(cable, factor) for cable in cables for factor in np.geomspace(*settings.other_weights)]
    return min(others, key=lambda other: other.misfit)
