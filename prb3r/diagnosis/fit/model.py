r"""A recording, its noise and what is fitted: residuals and their exact derivatives.

Residuals are whitened with the full covariance and followed by one row for each prior, so that the sum of their
squares is minus twice the logarithm of the posterior density, up to a constant.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from prb3r.diagnosis.fit.basis import basis_of
from prb3r.diagnosis.fit.constants import FRAME, Constants
from prb3r.diagnosis.fit.parameters import Parametrisation
from prb3r.diagnosis.fit.prediction import Solution
from prb3r.diagnosis.fit.response import across, interval, response
from prb3r.mechanics.chain import Chain, Loads
from prb3r.model.effects.base import Effect


@dataclass(frozen=True, eq=False)
class Model(Parametrisation):
    """What is fitted to a recording, with the residuals and their derivatives."""

    def solve(self, p: np.ndarray) -> Solution:
        """States and readings (r,) for the parameters `p` (p,); not a number where a step has no equilibrium."""
        return self.predict.solve(self.constants(p), self.effects(p))

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
            dearer, least = 1 + self.settings.out_of_balance_factor * lost.missing, self.settings.out_of_balance_sd
            white = self.noise.whiten(self.predict.misfit(lost.readings)) * dearer
            white += np.where(lost.missing > 0, np.where(white < 0, -least, least), 0.0)
        others = self.believed
        return np.concatenate([white, -p / self.deviations, others.target - others.root @ p])

    def moved(self, p: np.ndarray, solved: Solution) -> np.ndarray:
        """(r, p) derivatives of the readings; 0 where a step has no equilibrium."""
        (low, high), friction = self.bounds(p), self.friction(p)
        mechanical = [name not in FRAME for name in self.varied]
        mechanical += [hypothesis.mechanical for hypothesis in self.hypotheses for _ in hypothesis.free]

        def moved(k: int, value: float) -> tuple[Constants, Sequence[Effect]]:
            there = np.concatenate([p[:k], [value], p[k + 1 :]])
            return self.constants(there), self.effects_near(there, k, solved.effects, friction)

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
        """Sum of squared residuals, priors and what other recordings say included."""
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
        """Whether every step has an equilibrium, so that all readings are predicted as numbers."""
        return bool(np.isfinite(self.solved.readings).all())

    @property
    def reduced(self) -> float:
        """Chi-square per degree of freedom: 1 on the average where model and noise are right."""
        return self.chi2 / max(self.freedom, 1)

    @property
    def constants(self) -> Constants:
        return self.solved.constants

    @property
    def effects(self) -> tuple[Effect, ...]:
        return self.solved.effects

    @property
    def covariance(self) -> np.ndarray:
        """(p, p) covariance of the parameters, linearised: the inverse of the normal equations, effects in their own
        scale."""
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
