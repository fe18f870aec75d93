r"""A model of one recording, its residuals with their derivatives, and the finished fit.

Residuals are whitened with the full covariance of the readings and followed by one row for each prior, so that the sum
of their squares is minus twice the logarithm of the posterior density, up to a constant.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from prb3r.diagnosis.fit.basis import basis_of
from prb3r.diagnosis.fit.constants import FRAME, Constants
from prb3r.diagnosis.fit.parameters import Parametrisation
from prb3r.diagnosis.fit.prediction import Solution
from prb3r.diagnosis.fit.response import across, interval, response
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.mechanics.chain import Chain, Loads
from prb3r.model.effects.base import Effect
from prb3r.recording.recording import Recording

MOVES_NOTHING = 1e-9
"""Largest derivative of a reading, in standard deviations, by a parameter that moves nothing: rounding."""


@dataclass(frozen=True, eq=False)
class Model(Parametrisation):
    """A parametrised model of one recording, in the form that :func:`prb3r.diagnosis.fit.least_squares.fit` minimises.

    Below, r is the number of readings, p that of parameters, k that of rows from other recordings (`believed`).
    """

    def solve(self, p: np.ndarray) -> Solution:
        """States of all steps and predicted readings for the parameters `p`; NaN where a step has no equilibrium."""
        return self.predict.solve(self.constants(p), self.effects(p))

    def readings(self, solved: Solution) -> np.ndarray:
        """(r,) predicted readings, none NaN: a step without equilibrium is read as `Predictor.lost` holds it."""
        lost = self.predict.lost(solved)
        return solved.readings if lost is None else lost.readings

    def residuals(self, p: np.ndarray, solved: Solution) -> np.ndarray:
        """(r + p + k,) whitened misfits of the readings, then one row for each prior, then those from other recordings.

        A step without equilibrium is held in the last balanced state before it (`Predictor.lost`).  Its residuals are
        multiplied by a factor that grows with the part of the step that was not followed, and moved away from zero by
        `Settings.out_of_balance_sd`, so that chi-square draws a fit to where more of the step has an equilibrium.
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
        """(r, p) derivatives of the predicted readings by the parameters; 0 where a step has no equilibrium.

        What leaves the states alone (the frame, effects of the camera) is differenced in the reading of the states.
        """
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
        ends = [interval(*bounded) for bounded in zip(p, low, high, self.poles, strict=True)]
        acting, looking = np.flatnonzero(mechanical).tolist(), np.flatnonzero(np.logical_not(mechanical)).tolist()
        ways = [across(lambda value, k=k: problem(k, value), ends[k]) for k in acting]  # type: ignore[misc]
        out[:, acting] = response(self.predict, solved, ways)
        for k in looking:
            first, last = ends[k]
            out[:, k] = (seen(k, last) - seen(k, first)) / (last - first)
        return np.nan_to_num(out)

    def jacobian(self, p: np.ndarray, solved: Solution) -> np.ndarray:
        """(r + p + k, p) derivatives of the residuals by the parameters."""
        white = self.noise.whiten(self.moved(p, solved))
        return -np.vstack([white, np.diag(1 / self.deviations), self.believed.root])

    def fitted(self, p: np.ndarray, residual: np.ndarray, jacobian: np.ndarray, solved: Solution, done: bool) -> "Fit":
        """The finished fit with the parameters `p`; `done`: whether the minimiser has converged."""
        return Fit(self, p, residual, jacobian, solved, done)


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to a recording: its parameters at the minimum, with the residuals and derivatives there."""

    model: Model
    p: np.ndarray
    """(p,) parameters: the constants, then those of the effects in their own scale (`u` of `Free`)."""
    residual: np.ndarray
    """(r + p + k,) whitened misfits, rows of the priors, rows from other recordings; see `Model.residuals`."""
    jacobian: np.ndarray
    """(r + p + k, p) derivatives of the residuals by the parameters."""
    solved: Solution
    """States and predicted readings for `p`."""
    converged: bool = True
    """Whether the next step promises no fall of chi-square that counts, or a restart from here brought none."""

    @property
    def recording(self) -> Recording:
        """The recording that was fitted."""
        return self.model.recording

    @property
    def misfit(self) -> np.ndarray:
        """(r,) whitened misfits of the readings: `residual` without the rows of priors and of other recordings."""
        return self.residual[: self.recording.readings.count]

    @property
    def chi2(self) -> float:
        """Sum of squared residuals, including the rows of priors and those from other recordings."""
        return float(self.residual @ self.residual)

    @property
    def freedom(self) -> int:
        """Degrees of freedom: readings, priors that are not flat and rows from other recordings, less parameters."""
        known = np.isfinite(self.model.deviations).sum() + len(self.model.believed.target)
        return int(self.recording.readings.count + known - len(self.p))

    @property
    def costly(self) -> bool:
        """Whether a prediction is slow: with presliding friction the state of a step depends on those before it."""
        return self.solved.chain.presliding > 0

    @property
    def balanced(self) -> bool:
        """Whether every step has an equilibrium, so that no predicted reading is NaN."""
        return bool(np.isfinite(self.solved.readings).all())

    @property
    def reduced(self) -> float:
        """Chi-square per degree of freedom: about 1 where model and noise are right."""
        return self.chi2 / max(self.freedom, 1)

    @property
    def constants(self) -> Constants:
        return self.solved.constants

    @property
    def effects(self) -> tuple[Effect, ...]:
        return self.solved.effects

    @property
    def covariance(self) -> np.ndarray:
        """(p, p) linearised covariance of the parameters, effects in their own scale: the pseudo-inverse of the normal
        matrix."""
        return np.linalg.pinv(normal_matrix(self), hermitian=True)

    def apart(self, other: "Fit") -> np.ndarray:
        """(r + p + k,) residuals of this fit less those of another one of the same recording.

        Rows of effects' priors and from other recordings are 0, as the two fits need not have the same.
        """
        shared = self.recording.readings.count + len(self.model.varied)
        out = np.zeros(len(self.residual))
        out[:shared] = self.residual[:shared] - other.residual[:shared]
        return out

    @cached_property
    def idle(self) -> frozenset[Hypothesis]:
        """The fitted effects that move no reading, as a law of unloading where plates do not soften."""
        return idle_effects(self.model, self.jacobian[: len(self.misfit)])

    @cached_property
    def basis(self) -> np.ndarray:
        """(r + p + k, b) orthonormal basis of the columns of the Jacobian: what the parameters can explain."""
        return basis_of(self.jacobian)


def idle_effects(model: Any, moved: np.ndarray) -> frozenset:
    """The hypotheses of a model or joint model whose parameters move no reading, given the whitened derivatives (r, p)
    of the readings; none without parameters."""
    largest = np.abs(moved).max(0)
    pairs = zip(model.hypotheses, model.spans, strict=True)
    return frozenset(each for each, span in pairs if each.free and not (largest[span] > MOVES_NOTHING).any())


def normal_matrix(fitted: Any) -> np.ndarray:
    """(p, p) normal matrix of a fit or joint fit.

    A constant with a flat prior that hardly a reading feels is as uncertain as its bounds allow.
    """
    model, normal = fitted.model, fitted.jacobian.T @ fitted.jacobian
    flat = np.flatnonzero(np.isinf(model.deviations[: len(model.varied)]))
    normal[flat, flat] += 1 / model.settings.farthest**2
    return normal
