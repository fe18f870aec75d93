"""How hypotheses would move the readings of a fitted model, linearised around the fit.

Effects that can vanish continuously are differentiated exactly along the load path of the fit, all of them together.
Three sorts are treated one by one: an effect of the camera is differenced in the reading of the states, one that
changes the structure of the chain is differentiated along a path of its own, and one without a small size (a dead
cable, another rule of friction, a knee) is applied as a whole.
"""

from collections.abc import Iterable, Sequence
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

BEYOND_SENSE = 1e6
"""Change of a reading, m or rad, by an effect of its prior size at or above which a derivative is meaningless, as no
arm moves so far.  With friction that grows without bound as a tension falls, the first tension of an idle cable that is
paid out moves readings by up to 1e69.  Guard of the arithmetic: squares of such changes overflow."""
POINTS_KEPT = 4
"""Parameter points whose changes of readings are cached: in a small diagnosis with one effect 2 serve as well as 32."""
Probe = tuple[Hypothesis, np.ndarray]
"""A hypothesis, and the values (k,) of its free parameters `u` around which it is tried."""


def probes_of(fitted: Fit, hypotheses: Iterable[Hypothesis]) -> list[Probe]:
    """Every hypothesis with each of its starts, for the friction coefficient of `fitted`."""
    friction = fitted.model.friction(fitted.p)
    return [(hypothesis, start) for hypothesis in hypotheses for start in hypothesis.starts(friction)]


def moved_readings(fitted: Fit, probes: Sequence[Probe]) -> list[np.ndarray]:
    """(r, k) for each probe: change of the readings per unit of each free parameter, or (r, 1) by the whole effect.

    For a parameter on its upper bound, the change is that toward lower values.  Changes are 0 at steps without
    equilibrium.  All are 0 if a whole effect leads out of equilibrium, or if some reading would move by
    `BEYOND_SENSE`.  Results are cached.
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
    """Cache of the changes around a model with the parameters `p`, by hypothesis and probe; empty at first.

    The noise is not part of the key, as the changes do not depend on it and are needed under several noise levels.
    """
    return {}


def _moved(fitted: Fit, probes: Sequence[Probe]) -> list[np.ndarray]:
    """(r, k) for each probe, as of :func:`moved_readings`, without the cache."""
    out: dict[int, np.ndarray] = {}
    along: dict[int, list[Direction]] = {}
    for number, (hypothesis, start) in enumerate(probes):
        if not hypothesis.continuous:
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
    return [_sensible(out[number], probe[0]) * _way(*probe, friction) for number, probe in enumerate(probes)]


def _sensible(moved: np.ndarray, hypothesis: Hypothesis) -> np.ndarray:
    """(r, k) changes by a hypothesis; 0 for a free parameter of which some change is no number or `BEYOND_SENSE`."""
    if not hypothesis.continuous:
        return moved
    return np.where(np.abs(moved).max(0, initial=0.0) * hypothesis.deviations < BEYOND_SENSE, moved, 0.0)


def _way(hypothesis: Hypothesis, start: np.ndarray, friction: float) -> np.ndarray | float:
    """(k,) signs: -1 for a free parameter that is on its upper bound at `start`, else 1."""
    if hypothesis.kinked or not hypothesis.continuous:
        return 1.0
    highest = [free.bounds(friction)[1] for free in hypothesis.free]
    return np.where(start < highest, 1.0, -1.0)


def _effects(fitted: Fit, hypothesis: Hypothesis, u: np.ndarray) -> list[Effect]:
    """The effects of the fit, and that of a hypothesis with the free parameters `u`."""
    return [*fitted.effects, hypothesis.effect(u, fitted.model.friction(fitted.p))]


def _problem(fitted: Fit, hypothesis: Hypothesis, u: np.ndarray) -> tuple[Chain, Loads]:
    """Chain and loads of the fit with that effect added."""
    chain = fitted.model.predict.chain_of(fitted.constants, _effects(fitted, hypothesis, u))
    return chain, fitted.solved.loads


def _directions(fitted: Fit, hypothesis: Hypothesis, start: np.ndarray) -> list[Direction]:
    """A direction for each free parameter; for a kinked effect one from nothing to the side of `start`, per unit."""
    if hypothesis.kinked:
        begins = fitted.recording.begins
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
    """(r, k) change of the readings per unit of each free parameter, along the path solved with the effect."""
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
    """(r, 1) change of the readings by all of an effect without a small size; all 0 if any step has no equilibrium."""
    moved = fitted.model.predict(fitted.constants, _effects(fitted, hypothesis, start)) - fitted.solved.readings
    return moved[:, None] if np.isfinite(moved).all() else np.zeros((len(moved), 1))
