r"""A recording, its noise and what is fitted: residuals and their exact derivatives.

Residuals are whitened with the full covariance and followed by one row for each prior, so that the sum of their
squares is minus twice the logarithm of the posterior density, up to a constant.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from prb3r.diagnosis.fit.basis import basis_of
from prb3r.diagnosis.fit.belief import Belief, Rows
from prb3r.diagnosis.fit.constants import (
    FRAME,
    Constants,
    friction_beside,
    prior_deviations,
    varied_constants,
    widest_factors,
)
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.diagnosis.fit.response import across, interval, response
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.chain import Chain, Loads
from prb3r.model.effects.base import Effect

LOST_AT_LEAST, FARTHER = 3.0, 10.0
"""What a reading costs whose step is not in balance: so many standard deviations beside what the last step in balance
misses it by, and so many times as much where nothing of the step has an equilibrium."""


@dataclass(frozen=True, eq=False)
class Model:
    """A recording, its noise, and which effects are fitted beside the constants."""

    predict: Predictor
    noise: Noise
    hypotheses: tuple[Hypothesis, ...] = ()
    settings: Settings = field(default_factory=Settings)
    belief: Belief | None = None
    """What other recordings say of its parameters, by `names`."""

    def adding(self, *more: Hypothesis) -> "Model":
        """The model with more effects."""
        return replace(self, hypotheses=(*self.hypotheses, *more))

    def without(self, number: int) -> "Model":
        """The model without one of its effects."""
        return replace(self, hypotheses=self.hypotheses[:number] + self.hypotheses[number + 1 :])

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """Names of the calibrated constants that are not fixed."""
        return varied_constants(self.predict.recording)

    @cached_property
    def priors(self) -> np.ndarray:
        """(c,) standard deviations of the varied constants; infinite: flat."""
        sd = prior_deviations(self.predict.recording)
        return np.array([sd[name] for name in self.varied])

    @property
    def count(self) -> int:
        """Number of parameters."""
        return len(self.varied) + sum(len(hypothesis.free) for hypothesis in self.hypotheses)

    def constants(self, p: np.ndarray) -> Constants:
        """The constants among the parameters `p`."""
        return Constants(**dict(zip(self.varied, p, strict=False)))

    def friction(self, p: np.ndarray) -> float:
        """Friction coefficient of all holes that no effect singles out: calibrated, or that of `cable_friction`."""
        manipulator, scale = self.predict.recording.manipulator, float(np.exp(self.constants(p).log_friction))
        return friction_beside(manipulator, scale, zip(self.hypotheses, self.shares(p), strict=True))

    @cached_property
    def spans(self) -> tuple[slice, ...]:
        """Where the parameters of every effect stand."""
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
        """The effects with the parameters `p`."""
        friction = self.friction(p)
        pairs = zip(self.hypotheses, self.shares(p), strict=True)
        return [hypothesis.effect(share, friction) for hypothesis, share in pairs]

    def effects_near(self, p: np.ndarray, changed: int, at: Sequence[Effect], around: np.ndarray) -> Sequence[Effect]:
        """The effects with the parameters `p`, of which one is `changed` from `around`, where they are `at`."""
        friction = self.friction(p)
        if friction != self.friction(around):
            return self.effects(p)
        made = zip(self.hypotheses, self.spans, at, strict=True)
        return [
            each.effect(p[span], friction) if span.start <= changed < span.stop else old for each, span, old in made
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

    def solve(self, p: np.ndarray) -> Solution:
        """States and readings for the parameters `p`."""
        return self.predict.solve(self.constants(p), self.effects(p))

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

    def readings(self, solved: Solution) -> np.ndarray:
        """(r,) of a solution; steps that are not in balance held where the last one was."""
        lost = self.predict.lost(solved)
        return solved.readings if lost is None else lost.readings

    def residuals(self, p: np.ndarray, solved: Solution) -> np.ndarray:
        """(r + p + k,) whitened misfit of predicted readings, then the priors, then what other recordings say.

        A step without equilibrium counts as held where the last one was, and dearer the less of it was followed.
        """
        lost = self.predict.lost(solved)
        if lost is None:
            white = self.noise.whiten(self.predict.misfit(solved.readings))
        else:
            white = self.noise.whiten(self.predict.misfit(lost.readings)) * (1 + FARTHER * lost.missing)
            white += np.where(lost.missing > 0, np.where(white < 0, -LOST_AT_LEAST, LOST_AT_LEAST), 0.0)
        others = self.believed
        return np.concatenate([white, -p / self.deviations, others.target - others.root @ p])

    def moved(self, p: np.ndarray, solved: Solution) -> np.ndarray:
        """(r, p) derivatives of the readings; 0 where a step has no equilibrium."""
        low, high = self.bounds(p)
        mechanical = [name not in FRAME for name in self.varied]
        mechanical += [hypothesis.mechanical for hypothesis in self.hypotheses for _ in hypothesis.free]

        def moved(k: int, value: float) -> tuple[Constants, Sequence[Effect]]:
            there = np.concatenate([p[:k], [value], p[k + 1 :]])
            return self.constants(there), self.effects_near(there, k, solved.effects, p)

        def problem(k: int, value: float) -> tuple[Chain, Loads]:
            return self.predict.chain_of(*moved(k, value)), solved.loads

        def seen(k: int, value: float) -> np.ndarray:
            return self.predict.read(solved.states, *moved(k, value))

        out = np.empty((len(solved.readings), len(p)))
        ends = [interval(*bounded) for bounded in zip(p, low, high, strict=True)]
        acting, looking = np.flatnonzero(mechanical).tolist(), np.flatnonzero(np.logical_not(mechanical)).tolist()
        ways = [across(lambda value, k=k: problem(k, value), ends[k]) for k in acting]  # type: ignore[misc]
        out[:, acting] = response(self.predict, solved, ways)
        for k in looking:
            first, last = ends[k]
            out[:, k] = (seen(k, last) - seen(k, first)) / (last - first)
        return np.nan_to_num(out)

    def jacobian(self, p: np.ndarray, solved: Solution) -> np.ndarray:
        """(r + p + k, p) derivatives of the residuals."""
        white = self.noise.whiten(self.moved(p, solved))
        return -np.vstack([white, np.diag(1 / self.deviations), self.believed.root])

    def fitted(self, p: np.ndarray, residual: np.ndarray, jacobian: np.ndarray, solved: Solution, done: bool) -> "Fit":
        """The fit that ended at `p`; `done`: whether it has converged."""
        return Fit(self, p, residual, jacobian, solved, done)


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to a recording."""

    model: Model
    p: np.ndarray
    """(p,) parameters; those of effects in their own scale."""
    residual: np.ndarray
    """(r + p + k,) whitened, with prior rows and those of other recordings."""
    jacobian: np.ndarray
    """(r + p + k, p) of the residuals."""
    solved: Solution
    converged: bool = True
    """Whether no step promises, or begun again brings, a fall of chi-square that counts."""

    @property
    def chi2(self) -> float:
        """Sum of squared residuals, priors included."""
        return float(self.residual @ self.residual)

    @property
    def freedom(self) -> int:
        """Degrees of freedom that are left: readings and what is known of constants less parameters."""
        known = np.isfinite(self.model.priors).sum() + len(self.model.believed.target)
        return int(self.model.predict.recording.readings.count + known - len(self.p))

    @property
    def costly(self) -> bool:
        """Whether a prediction is slow, as states follow the load path where else each stands alone."""
        return self.solved.chain.presliding > 0

    @property
    def balanced(self) -> bool:
        """Whether all steps are in equilibrium."""
        return bool(np.isfinite(self.solved.readings).all())

    @property
    def reduced(self) -> float:
        """Chi-square per degree of freedom."""
        return self.chi2 / max(self.freedom, 1)

    @property
    def constants(self) -> Constants:
        return self.solved.constants

    @property
    def effects(self) -> tuple[Effect, ...]:
        return self.solved.effects

    @property
    def covariance(self) -> np.ndarray:
        """(p, p) of the parameters, linearised."""
        return np.linalg.pinv(self.jacobian.T @ self.jacobian, hermitian=True)

    def apart(self, other: "Fit") -> np.ndarray:
        """(r + p + k,) residuals of this fit less those of another one, 0 at priors of effects, which need not be the
        same."""
        shared = self.model.predict.recording.readings.count + len(self.model.varied)
        out = np.zeros(len(self.residual))
        out[:shared] = self.residual[:shared] - other.residual[:shared]
        return out

    @cached_property
    def basis(self) -> np.ndarray:
        """(r + p + k, b) orthonormal basis of what the parameters can explain."""
        return basis_of(self.jacobian)
