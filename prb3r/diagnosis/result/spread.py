"""Intervals of parameters from all surviving models, not from the model alone whose effects are named."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy

from prb3r.diagnosis.chance import normal_tail
from prb3r.diagnosis.confidence import NORMAL_REACH, TAIL
from prb3r.diagnosis.fit.model import Fit, Model
from prb3r.diagnosis.fit.profile import LEAST_SD, linear_interval
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.selection import Choice

TAIL_REACH = 8.0
"""Standard deviations beyond which a normal distribution counts as zero."""


class SplitNormal(NamedTuple):
    """The distribution of a parameter under one model: a split normal, with a standard deviation for either side."""

    probability: float
    """Posterior probability of the model."""
    value: float
    """Best value, in the parameter's own scale."""
    below: float
    """Standard deviation toward smaller values."""
    above: float
    """Standard deviation toward larger values."""


def quantile_over_models(distributions: Sequence[SplitNormal], share: float) -> float:
    """The value below which a parameter lies with the probability `share`, averaged over models."""
    probability, value, below, above = (np.array(column) for column in zip(*distributions, strict=True))
    probability = probability / probability.sum()

    def beyond(at: float) -> float:
        sd = np.where(at < value, below, above)
        return float(probability @ normal_tail((value - at) / sd)) - share

    low, high = (value - TAIL_REACH * below).min(), (value + TAIL_REACH * above).max()
    return float(scipy.optimize.brentq(beyond, low, high))


def ends_over_models(
    choice: Choice,
    number: int,
    where: Callable[[Model], int | None],
    ends: tuple[float, float],
    held: Callable[[Model], float | None] = lambda model: None,
) -> tuple[float, float]:
    """The ends of the 95 % interval of a parameter of the chosen model, widened by the other surviving models.

    Parameters
    ----------
    choice : the survivors other than the chosen model count with their linearised standard deviations or, where these
        are wrong, with those of the chosen model.
    number : index of the parameter in the chosen model.
    where : returns the index of the parameter in another model; None for a model that lacks it.
    ends : the interval of the chosen model alone, in the parameter's own scale.
    held : returns the value, in that scale, at which a model that lacks the parameter holds it; None if it holds none.

    Returns
    -------
    The ends, in the parameter's own scale: never inside those given, and not widened beyond the bounds.
    """
    chosen = choice.fitted
    value, effects = chosen.p[number], frozenset(chosen.model.hypotheses)
    others = [survivor for survivor in choice.survivors if survivor.effects != effects]
    probability = sum(survivor.probability for survivor in choice.survivors) - sum(
        survivor.probability for survivor in others
    )
    sides = [max(abs(end - value) / NORMAL_REACH, LEAST_SD) for end in ends]
    distributions, points = [SplitNormal(probability, value, *sides)], list[float]()
    for survivor in others:
        fitted, there = survivor.fitted, where(survivor.fitted.model)
        if there is None and (at := held(fitted.model)) is not None:
            distributions.append(SplitNormal(survivor.probability, at, LEAST_SD, LEAST_SD))
            points.append(at)
        if there is not None and np.isfinite(sd := _deviation(fitted, there)):
            far = sd > chosen.model.settings.linear_interval_factor * min(sides)
            wrong = far and linear_interval(fitted, there) is None
            distributions.append(SplitNormal(survivor.probability, fitted.p[there], *(sides if wrong else (sd, sd))))
    if len(distributions) == 1 or probability <= 0:
        return ends
    low, high = (bound[number] for bound in chosen.model.bounds(chosen.p))
    wide = [_at_held(quantile_over_models(distributions, share), points) for share in (TAIL, 1 - TAIL)]
    return min(ends[0], max(wide[0], low)), max(ends[1], min(wide[1], high))


def _at_held(end: float, points: Sequence[float]) -> float:
    """The end of an interval, or the one of the `points` where models hold the parameter that it lies at but for the
    width that these are given."""
    return next((at for at in points if abs(end - at) <= TAIL_REACH * LEAST_SD), end)


def _deviation(fitted: Fit, number: int) -> float:
    """Linearised standard deviation of a parameter; NaN where the readings do not tell it."""
    variance = fitted.covariance[number, number]
    return max(float(np.sqrt(variance)), LEAST_SD) if variance >= 0 else float("nan")


def number_of_share(hypothesis: Hypothesis, part: int) -> Callable[[Model], int | None]:
    """A function that returns the number, in a model, of the parameter at `part` of an effect, which may stand there
    with more or fewer free parameters; None for a model without it."""
    name = hypothesis.free[part].name

    def where(model: Model) -> int | None:
        number = _number_of(hypothesis, model)
        if number is None:
            return None
        names = [free.name for free in model.hypotheses[number].free]
        return model.spans[number].start + names.index(name) if name in names else None

    return where


def held_share(hypothesis: Hypothesis, part: int) -> Callable[[Model], float | None]:
    """A function that returns the value, in its own scale, at which a model holds the parameter at `part` of an effect
    that has fewer free parameters there; None for other models."""
    free = hypothesis.free[part]

    def held(model: Model) -> float | None:
        number = _number_of(hypothesis, model)
        place = {} if number is None else dict(model.hypotheses[number].place)
        return free.at(place[free.name]) if free.name in place else None

    return held


def _number_of(hypothesis: Hypothesis, model: Model) -> int | None:
    """The number, from 0, of an effect in a model, or of the same with more or fewer free parameters; None without."""
    for number, other in enumerate(model.hypotheses):
        if other == hypothesis or other.generalises(hypothesis) or hypothesis.generalises(other):
            return number
    return None


def number_of_constant(name: str) -> Callable[[Model], int | None]:
    """A function that returns the number of a constant, by name, in a model; None for a model that does not vary it."""
    return lambda model: model.varied.index(name) if name in model.varied else None
