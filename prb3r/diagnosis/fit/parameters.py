"""The parameters of a model of one recording: their order, names, priors and bounds.

The parameters are the varied constants, then the free parameters `u` of every effect, each in its own scale.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
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
from prb3r.diagnosis.fit.spans import spans_of
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Parametrisation:
    """A recording with its noise and the effects that are fitted to it beside the constants."""

    predict: Predictor
    noise: Noise
    hypotheses: tuple[Hypothesis, ...] = ()
    """The effects that are fitted."""
    settings: Settings = field(default_factory=Settings)
    belief: Belief | None = None
    """What other recordings say of the parameters, keyed by `names`; None: nothing."""
    varied: tuple[str, ...] = ()
    """Names of the constants that are fitted; absent: those that the recording tells.  A model that is held against a
    part of its recording, or against another one, keeps its own."""

    def __post_init__(self) -> None:
        if not self.varied:
            object.__setattr__(self, "varied", varied_constants(self.recording))

    @property
    def recording(self) -> Recording:
        """The recording that the model predicts."""
        return self.predict.recording

    def adding(self, *more: Hypothesis) -> Self:
        """This model with more effects, behind those that it has."""
        return replace(self, hypotheses=(*self.hypotheses, *more))

    def without(self, number: int) -> Self:
        """This model without the effect at `number`, counted from 0."""
        return replace(self, hypotheses=self.hypotheses[:number] + self.hypotheses[number + 1 :])

    @cached_property
    def priors(self) -> np.ndarray:
        """(c,) prior standard deviations of the varied constants; infinite: flat."""
        sd = prior_deviations(self.recording, self.settings)
        return np.array([sd[name] for name in self.varied])

    @property
    def count(self) -> int:
        """Number of parameters: those of the varied constants, then those of every effect."""
        return len(self.varied) + sum(len(hypothesis.free) for hypothesis in self.hypotheses)

    def constants(self, p: np.ndarray) -> Constants:
        """The constants among the parameters `p` (p,); those that are not varied at their nominal values."""
        return Constants(**dict(zip(self.varied, p, strict=False)))

    def friction(self, p: np.ndarray) -> float:
        """Friction coefficient of all holes that no effect singles out: the calibrated one, or that of an effect
        `cable_friction` on all cables."""
        manipulator, scale = self.recording.manipulator, float(np.exp(self.constants(p).log_friction))
        return friction_beside(manipulator, scale, zip(self.hypotheses, self.shares(p), strict=True))

    @cached_property
    def spans(self) -> tuple[slice, ...]:
        """Where the parameters of each effect stand among all (p,), in the order of `hypotheses`."""
        return spans_of((len(hypothesis.free) for hypothesis in self.hypotheses), len(self.varied))

    def shares(self, p: np.ndarray) -> list[np.ndarray]:
        """The part of `p` that belongs to each hypothesis."""
        return [p[span] for span in self.spans]

    def without_share(self, p: np.ndarray, number: int) -> np.ndarray:
        """The parameters `p` without those of the effect at `number`."""
        shares = self.shares(p)
        return np.concatenate([p[: len(self.varied)], *shares[:number], *shares[number + 1 :]])

    def effects(self, p: np.ndarray) -> list[Effect]:
        """The effects for the parameters `p` (p,), with their values in SI units."""
        friction = self.friction(p)
        pairs = zip(self.hypotheses, self.shares(p), strict=True)
        return [hypothesis.effect(share, friction) for hypothesis, share in pairs]

    def effects_near(self, p: np.ndarray, changed: int, at: Sequence[Effect], around: float) -> Sequence[Effect]:
        """The effects for the parameters `p`, which differ from those of the effects `at` in number `changed` only.

        Effects that stay the same are the objects of `at`, which `Chains` does not apply again.  `around`: friction
        coefficient that `at` were made with; where that changes all are made anew, as some depend on it.
        """
        friction = self.friction(p)
        if friction != around:
            return self.effects(p)
        made = zip(self.hypotheses, self.spans, at, strict=True)
        return [
            hypothesis.effect(p[span], friction) if span.start <= changed < span.stop else old
            for hypothesis, span, old in made
        ]

    def bounds(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(p,) lowest and highest value of every parameter; some depend on the friction coefficient that `p` gives."""
        friction = self.friction(p)
        of_constants = [self.widest.get(name, (-np.inf, np.inf)) for name in self.varied]
        of_effects = [free.bounds(friction) for hypothesis in self.hypotheses for free in hypothesis.free]
        low, high = np.array(of_constants + of_effects).T
        return low, high

    @cached_property
    def poles(self) -> np.ndarray:
        """(p,) value of every parameter at which its law has a pole; -inf without one."""
        of_effects = [free.pole_at for hypothesis in self.hypotheses for free in hypothesis.free]
        return np.array([-np.inf] * len(self.varied) + of_effects)

    @cached_property
    def widest(self) -> Mapping[str, tuple[float, float]]:
        """Lowest and highest ln of the factor on each constant that is one, by name."""
        return widest_factors(self.recording.manipulator, self.settings)

    @cached_property
    def deviations(self) -> np.ndarray:
        """(p,) prior standard deviations of all parameters, each in its own scale; infinite: flat."""
        free = [free.prior_sd for hypothesis in self.hypotheses for free in hypothesis.free]
        return np.concatenate([self.priors, free])

    @property
    def names(self) -> tuple[object, ...]:
        """(p,) keys of the parameters: the name of a constant, the hypothesis and parameter name of an effect."""
        of_effects = [(hypothesis, free.name) for hypothesis in self.hypotheses for free in hypothesis.free]
        return (*self.varied, *of_effects)

    @cached_property
    def believed(self) -> Rows:
        """`belief` as rows of the least squares; no rows without one."""
        return (self.belief or Belief((), np.zeros((0, 0)), np.zeros(0))).rows(self.names)
