"""How hypotheses would move the readings of a fitted model.

Effects that come by degrees are differentiated exactly along the load path of the fit, all of them together.  Three
sorts cannot be, and are solved for themselves: an effect that adds nodes to the plates is differentiated along a path
of its own, one that has no small size (a dead cable, another rule of friction, a knee) is compared as a whole.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Predictor
from prb3r.diagnosis.fit.response import CHANGE, across, interval, response, without_slack
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.derivatives.sensitivity import Direction
from prb3r.model.effects.base import Effect

POINTS_KEPT = 4
"""Parameter points at which it is kept what is known: of a small diagnosis with one effect 2 serve as well as 32."""
Probe = tuple[Hypothesis, np.ndarray]
"""A hypothesis and its free parameters (k,)."""


def moved_readings(fitted: Fit, probes: Sequence[Probe]) -> list[np.ndarray]:
    """(r, k) of each probe: change of the readings per unit of each free parameter, or by the whole effect.

    Toward lower values where a parameter is at its upper bound.  0 where the effect leads out of equilibrium.
    """
    model = fitted.model
    known = _known_at(model.predict, fitted.constants, model.hypotheses, fitted.p.tobytes())
    names = [(hypothesis, start.tobytes()) for hypothesis, start in probes]
    fresh = {name: probe for name, probe in zip(names, probes, strict=True) if name not in known}
    if fresh:
        known.update(zip(fresh, _moved(fitted, list(fresh.values())), strict=True))
    return [known[name] for name in names]


@lru_cache(maxsize=POINTS_KEPT)
def _known_at(
    predict: Predictor, constants: Constants, hypotheses: tuple[Hypothesis, ...], p: bytes
) -> dict[tuple[Hypothesis, bytes], np.ndarray]:
    """What is known already of a model with the parameters `p`, by hypothesis and where it begins.

    No noise has a say in it: under another one the same is asked once more.
    """
    return {}


def _moved(fitted: Fit, probes: Sequence[Probe]) -> list[np.ndarray]:
    """The same, of probes of which nothing is known yet."""
    out: dict[int, np.ndarray] = {}
    along: dict[int, list[Direction]] = {}
    for number, (hypothesis, start) in enumerate(probes):
        if not hypothesis.by_degrees:
            out[number] = _whole(fitted, hypothesis, start)
        elif not hypothesis.mechanical:
            out[number] = _seen(fitted, hypothesis, start)
        elif hypothesis.structural:
            out[number] = _along_own_path(fitted, hypothesis, start)
        else:
            along[number] = _directions(fitted, hypothesis, start)
    shared = [direction for directions in along.values() for direction in directions]
    moved, first = response(fitted.model.predict, fitted.solved, shared), 0
    for number, directions in along.items():
        out[number] = moved[:, first : first + len(directions)]
        first += len(directions)
    friction = fitted.model.friction(fitted.p)
    return [out[number] * _way(*probe, friction) for number, probe in enumerate(probes)]


def _way(hypothesis: Hypothesis, start: np.ndarray, friction: float) -> np.ndarray | float:
    """(k,) 1 or -1: which way the free parameters can go from `start`."""
    if hypothesis.kinked or not hypothesis.by_degrees:
        return 1.0
    highest = [free.bounds(friction)[1] for free in hypothesis.free]
    return np.where(start < highest, 1.0, -1.0)


def _effects(fitted: Fit, hypothesis: Hypothesis, u: np.ndarray) -> list[Effect]:
    return [*fitted.effects, hypothesis.effect(u, fitted.model.friction(fitted.p))]


def _problem(fitted: Fit, hypothesis: Hypothesis, u: np.ndarray) -> tuple[Chain, Loads]:
    chain = fitted.model.predict.chain_of(fitted.constants, _effects(fitted, hypothesis, u))
    return chain, fitted.solved.loads


def _directions(fitted: Fit, hypothesis: Hypothesis, start: np.ndarray) -> list[Direction]:
    """One a free parameter; of a kinked effect in the direction of `start`, per unit of its size."""
    if hypothesis.kinked:
        begins = fitted.model.predict.recording.begins
        at_rest = without_slack(*_problem(fitted, hypothesis, 0 * start), begins)
        small = without_slack(*_problem(fitted, hypothesis, CHANGE * np.sign(start)), begins)
        return [Direction(small, at_rest, CHANGE)]
    friction, directions = fitted.model.friction(fitted.p), []
    for k, free in enumerate(hypothesis.free):

        def problem(value: float, k: int = k) -> tuple[Chain, Loads]:
            u = start.copy()
            u[k] = value
            return _problem(fitted, hypothesis, u)

        directions.append(across(problem, interval(start[k], *free.bounds(friction))))
    return directions


def _along_own_path(fitted: Fit, hypothesis: Hypothesis, start: np.ndarray) -> np.ndarray:
    predict = fitted.model.predict
    solved = predict.solve(fitted.constants, _effects(fitted, hypothesis, start))
    return response(predict, solved, _directions(fitted, hypothesis, start))


def _seen(fitted: Fit, hypothesis: Hypothesis, start: np.ndarray) -> np.ndarray:
    """(r, k) change of the readings per unit of each free parameter of an effect of the camera; the states stay."""
    predict, friction, columns = fitted.model.predict, fitted.model.friction(fitted.p), []
    for k, free in enumerate(hypothesis.free):
        ends, seen = interval(start[k], *free.bounds(friction)), []
        for value in ends:
            u = start.copy()
            u[k] = value
            seen.append(predict.read(fitted.solved.states, fitted.constants, _effects(fitted, hypothesis, u)))
        columns.append((seen[1] - seen[0]) / (ends[1] - ends[0]))
    return np.nan_to_num(np.stack(columns, 1))


def _whole(fitted: Fit, hypothesis: Hypothesis, start: np.ndarray) -> np.ndarray:
    """(r, 1) change of the readings by all of an effect that has no small size; 0 where a step loses balance."""
    moved = fitted.model.predict(fitted.constants, _effects(fitted, hypothesis, start)) - fitted.solved.readings
    return moved[:, None] if np.isfinite(moved).all() else np.zeros((len(moved), 1))
