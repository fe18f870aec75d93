"""Calibration under doubt: covariance, gross outliers and wrong weights settled before any physics is judged."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from prb3r.diagnosis.checks.outliers import Trust, Weight, distrust, wrong_weights
from prb3r.diagnosis.evidence.score_test import scores
from prb3r.diagnosis.fit.calibrate import Fit, Model, calibrate, fit
from prb3r.diagnosis.fit.covariance import Noise, noise_of, tension_sensitivity
from prb3r.diagnosis.fit.prediction import Constants, Predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.search.selection import Each, Search, examine, serially
from prb3r.model.effects.base import Effect

ROUNDS = 2
MOST_WRONG_WEIGHTS = 3
OTHER_WEIGHTS = np.geomspace(0.1, 10, 81)
"""What a noted weight is multiplied by to see which one was wrong."""


@dataclass(frozen=True, eq=False)
class Start:
    """A calibrated recording, ready to be explained."""

    calibrated: Fit
    trust: Trust
    search: Search


def renewed(fitted: Fit, trust: Trust) -> Fit:
    """The same model under the covariance that it predicts itself."""
    sensitivity = tension_sensitivity(fitted.model.predict, fitted.constants, fitted.effects)
    model: Model = replace(fitted.model, noise=trust.noise(fitted.model.predict.recording, sensitivity))
    return fit(model, fitted.p) or fitted


def start(
    predict: Predictor,
    without: frozenset[str],
    seed: int,
    each: Each = serially,
    *,
    trusting: bool = False,
    alone: bool = False,
) -> Start:
    """Calibrate, weigh gross outliers down, and set wrong weights aside.

    Parameters
    ----------
    without : kinds of effects that are not considered.
    trusting : believe every reading and every weight.
    alone : see `Search`.

    Raises
    ------
    ValueError
        If nothing near the nominal manipulator is in balance under the recorded loads.
    """
    recording = predict.recording
    rough = noise_of(recording, tension_sensitivity(predict, Constants()))
    fitted = calibrate(predict, rough)
    trust = Trust(np.ones(recording.readings.count))
    for _ in range(ROUNDS):
        trust = trust if trusting else Trust(distrust(fitted))
        fitted = renewed(fitted, trust)
    library = tuple(hypotheses(Scope.of(recording, predict.chain, fitted.states), without))
    search = Search(library, seed, each, alone)
    for _ in range(0 if trusting else MOST_WRONG_WEIGHTS):
        wrong = wrong_weight(fitted, search, trust.doubted)
        if wrong is None:
            break
        trust = replace(trust, doubted=(*trust.doubted, wrong))
        fitted = renewed(fitted, trust)
    return Start(fitted, trust, search)


def wrong_weight(fitted: Fit, search: Search, known: Sequence[Weight]) -> Weight | None:
    """The weight that explains more than any effect and any law could, if there is one."""
    effects: list[Effect] = fitted.effects
    sensitivity = tension_sensitivity(fitted.model.predict, fitted.constants, effects)
    doubted = {weight.step for weight in known}
    candidates = [d for d in wrong_weights(fitted, sensitivity) if d.subject.step not in doubted]
    tested = scores(fitted, candidates, search.seed)
    if tested.largest <= tested.threshold:
        return None
    others = examine(fitted, search)
    if tested.largest <= others.largest:
        return None
    step = candidates[int(np.argmax(tested.z))].subject.step
    return likeliest(fitted.model.predict, fitted.model.noise, fitted, step)


def likeliest(predict: Predictor, noise: Noise, fitted: Fit, step: int) -> Weight:
    """Of the weights on a step, the one that explains its readings best if it was another one."""
    weights = [Weight(step, int(cable)) for cable in np.flatnonzero(predict.recording.loads.tension[step] > 0)]
    return min(weights, key=lambda weight: _best_misfit(predict, noise, fitted, weight))


def _best_misfit(predict: Predictor, noise: Noise, fitted: Fit, weight: Weight) -> float:
    """Least squared misfit of the step's readings over what the weight may have been instead."""
    loads, own = predict.recording.loads, predict.recording.readings.step == weight.step
    found = []
    for factor in OTHER_WEIGHTS:
        tension = loads.tension.copy()
        tension[weight.step, weight.cable] *= factor
        misfit = predict.misfit(predict(fitted.constants, fitted.effects, loads._replace(tension=tension)))
        found.append(np.sum((misfit[own] / noise.sd[own]) ** 2))
    return float(np.nanmin(found))
