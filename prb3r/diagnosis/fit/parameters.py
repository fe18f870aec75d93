"""What is fitted to a recording: its parameters, what they are called and within which bounds they stand.

Parameters are those of the varied constants, then those of every effect in its own scale.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np

from prb3r.diagnosis.fit.belief import Belief, Rows
from prb3r.diagnosis.fit.constants import (
    Constants,
    friction_beside,
    prior_deviations,
    varied_constants,
    widest_factors,
)
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.prediction import Predictor
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect


@dataclass(frozen=True, eq=False)
class Parametrisation:
    """A recording, its noise, and which effects are fitted beside the constants."""

    predict: Predictor
    noise: Noise
    hypotheses: tuple[Hypothesis, ...] = ()
    settings: Settings = field(default_factory=Settings)
    belief: Belief | None = None
    """What other recordings say of its parameters, by `names`."""

    def adding(self, *more: Hypothesis) -> Self:
        """The same with more effects, behind those that it has."""
        return replace(self, hypotheses=(*self.hypotheses, *more))

    def without(self, number: int) -> Self:
        """The same without the effect at `number`, counted from 0."""
        return replace(self, hypotheses=self.hypotheses[:number] + self.hypotheses[number + 1 :])

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """Names of the calibrated constants that are not fixed."""
        return varied_constants(self.predict.recording)

    @cached_property
    def priors(self) -> np.ndarray:
        """(c,) standard deviations of the varied constants; infinite: flat."""
        sd = prior_deviations(self.predict.recording, self.settings)
        return np.array([sd[name] for name in self.varied])

    @property
    def count(self) -> int:
        """Number of parameters: those of the varied constants, then those of every effect."""
        return len(self.varied) + sum(len(hypothesis.free) for hypothesis in self.hypotheses)

    def constants(self, p: np.ndarray) -> Constants:
        """The constants among the parameters `p` (p,); those that are not varied at their nominal values."""
        return Constants(**dict(zip(self.varied, p, strict=False)))

    def friction(self, p: np.ndarray) -> float:
        """Friction coefficient of all holes that no effect singles out: calibrated, or that of `cable_friction`."""
        manipulator, scale = self.predict.recording.manipulator, float(np.exp(self.constants(p).log_friction))
        return friction_beside(manipulator, scale, zip(self.hypotheses, self.shares(p), strict=True))

    @cached_property
    def spans(self) -> tuple[slice, ...]:
        """Where the parameters of every effect stand among all (p,), in the order of `hypotheses`."""
        ends = len(self.varied) + np.cumsum([0, *(len(hypothesis.free) for hypothesis in self.hypotheses)])
        return tuple(slice(a, b) for a, b in pairwise(ends.tolist()))

    def shares(self, p: np.ndarray) -> list[np.ndarray]:
        """The part of `p` that belongs to each hypothesis."""
        return [p[span] for span in self.spans]

    def without_share(self, p: np.ndarray, number: int) -> np.ndarray:
        """The parameters `p` without those of one effect."""
        shares = self.shares(p)
        return np.concatenate([p[: len(self.varied)], *shares[:number], *shares[number + 1 :]])

    def effects(self, p: np.ndarray) -> list[Effect]:
        """The effects with the parameters `p` (p,), each in its own scale there and in SI units in what comes back."""
        friction = self.friction(p)
        pairs = zip(self.hypotheses, self.shares(p), strict=True)
        return [hypothesis.effect(share, friction) for hypothesis, share in pairs]

    def effects_near(self, p: np.ndarray, changed: int, at: Sequence[Effect], around: float) -> Sequence[Effect]:
        """The effects with the parameters `p`, of which one is `changed` from where they are `at`, with the friction
        coefficient that is `around`."""
        friction = self.friction(p)
        if friction != around:
            return self.effects(p)
        made = zip(self.hypotheses, self.spans, at, strict=True)
        return [
            hypothesis.effect(p[span], friction) if span.start <= changed < span.stop else old
            for hypothesis, span, old in made
        ]

    def bounds(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest value of every parameter; some move with the friction in `p`."""
        friction = self.friction(p)
        of_constants = [self.widest.get(name, (-np.inf, np.inf)) for name in self.varied]
        of_effects = [free.bounds(friction) for hypothesis in self.hypotheses for free in hypothesis.free]
        low, high = np.array(of_constants + of_effects).T
        return low, high

    @cached_property
    def widest(self) -> Mapping[str, tuple[float, float]]:
        """Ends of the logarithms of the factors on constants, by name."""
        return widest_factors(self.predict.recording.manipulator, self.settings)

    @cached_property
    def deviations(self) -> np.ndarray:
        """(p,) prior standard deviations of all parameters, in their own scale; infinite: flat."""
        free = [free.prior_sd for hypothesis in self.hypotheses for free in hypothesis.free]
        return np.concatenate([self.priors, free])

    @property
    def names(self) -> tuple[object, ...]:
        """(p,) constants by their names, parameters of effects by hypothesis and name."""
        of_effects = [(hypothesis, free.name) for hypothesis in self.hypotheses for free in hypothesis.free]
        return (*self.varied, *of_effects)

    @cached_property
    def believed(self) -> Rows:
        """What other recordings say, as rows; none where there are none."""
        return (self.belief or Belief((), np.zeros((0, 0)), np.zeros(0))).rows(self.names)
