r"""Weighted nonlinear least squares: constants, frame and the parameters of effects that fit a recording best.

Residuals are whitened with the full covariance and followed by one row for each prior, so that the sum of their
squares is minus twice the logarithm of the posterior density, up to a constant.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.prediction import Constants, Predictor
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.effects.base import Effect

MAX_STEPS, PATIENCE = 40, 6
SMALL_GAIN, SMALL_SHARE = 1e-8, 1e-6
"""Falls of chi-square that are not worth a step: this much, and this share of it."""
DECLARED_CHANGE, HISTORY_CHANGE = 1e-5, 3e-3
"""Changes of a parameter that derivatives are taken with; the second drowns what sub-stepping leaves of error."""
FARTHEST = np.log(50.0)
"""Largest ln of a factor on stiffness or friction."""


@dataclass(frozen=True, eq=False)
class Model:
    """A recording, its noise, and which effects are fitted beside the constants."""

    predict: Predictor
    noise: Noise
    hypotheses: tuple[Hypothesis, ...] = ()

    def adding(self, *more: Hypothesis) -> "Model":
        """The model with more effects."""
        return replace(self, hypotheses=(*self.hypotheses, *more))

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """Names of the calibrated constants that are not fixed."""
        measurement = self.predict.recording.measurement
        friction = self.predict.recording.manipulator.friction.coefficient > 0
        turned, moved = measurement.frame_rotation_sd_rad > 0, measurement.frame_position_sd_m > 0
        positions = bool((self.predict.recording.readings.kind <= 1).any())
        angles = bool((self.predict.recording.readings.kind == 2).any())
        return (
            "log_stiffness",
            *(("log_friction",) if friction else ()),
            *(("rotation",) if turned and (positions or angles) else ()),
            *(("x", "y") if moved and positions else ()),
        )

    @cached_property
    def priors(self) -> np.ndarray:
        """(c,) standard deviations of the varied constants; infinite: flat."""
        measurement, prior = self.predict.recording.measurement, self.predict.recording.prior
        sd = {
            "log_stiffness": prior.youngs_modulus or np.inf,
            "log_friction": prior.friction_coefficient or np.inf,
            "rotation": measurement.frame_rotation_sd_rad,
            "x": measurement.frame_position_sd_m,
            "y": measurement.frame_position_sd_m,
        }
        return np.array([sd[name] for name in self.varied])

    @property
    def count(self) -> int:
        """Number of parameters."""
        return len(self.varied) + sum(len(each.free) for each in self.hypotheses)

    def constants(self, p: np.ndarray) -> Constants:
        return Constants(**dict(zip(self.varied, p, strict=False)))

    def friction(self, p: np.ndarray) -> float:
        """Calibrated friction coefficient."""
        nominal = self.predict.recording.manipulator.friction.coefficient
        return nominal * float(np.exp(self.constants(p).log_friction))

    def shares(self, p: np.ndarray) -> list[np.ndarray]:
        """The part of `p` that belongs to each hypothesis."""
        ends = len(self.varied) + np.cumsum([0] + [len(each.free) for each in self.hypotheses])
        return [p[a:b] for a, b in pairwise(ends)]

    def effects(self, p: np.ndarray) -> list[Effect]:
        friction = self.friction(p)
        return [each.effect(u, friction) for each, u in zip(self.hypotheses, self.shares(p), strict=True)]

    def bounds(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest value of every parameter."""
        friction = self.friction(p)
        far = [FARTHEST if name.startswith("log") else np.inf for name in self.varied]
        of_effects = [free.bounds(friction) for each in self.hypotheses for free in each.free]
        low = np.array([-f for f in far] + [a for a, _ in of_effects])
        return low, np.array(far + [b for _, b in of_effects])

    def states(self, p: np.ndarray) -> Equilibria:
        return self.predict.equilibria(self.constants(p), self.effects(p))

    def predicted(self, p: np.ndarray, states: Equilibria | None = None) -> np.ndarray:
        """(r,) readings the model predicts."""
        states = self.states(p) if states is None else states
        return self.predict.read(states, self.constants(p), self.effects(p))

    def residuals(self, p: np.ndarray, predicted: np.ndarray) -> np.ndarray:
        """(r + c,) whitened misfit, then the priors."""
        c = len(self.varied)
        return np.concatenate([self.noise.whiten(self.predict.misfit(predicted)), -p[:c] / self.priors])

    def jacobian(self, p: np.ndarray, predicted: np.ndarray, states: Equilibria) -> np.ndarray:
        """(r + c, p) derivatives of the residuals, by differences; 0 where a change leads out of equilibrium."""
        c, (_, high) = len(self.varied), self.bounds(p)
        effects = self.effects(p)
        chain = self.predict.chain_of(self.constants(p), effects)
        change = HISTORY_CHANGE if chain.presliding > 0 else DECLARED_CHANGE
        seen_only = [name in ("rotation", "x", "y") for name in self.varied]
        seen_only += [not each.mechanical for each in self.hypotheses for _ in each.free]
        out = np.empty((len(predicted), len(p)))
        for k in range(len(p)):
            step = (DECLARED_CHANGE if seen_only[k] else change) * (1 if p[k] + change <= high[k] else -1)
            moved = p.copy()
            moved[k] += step
            there = self.predicted(moved, states if seen_only[k] else None)
            out[:, k] = (there - predicted) / step
        prior = np.zeros((c, len(p)))
        prior[:, :c] = np.diag(1 / self.priors)
        return -np.vstack([self.noise.whiten(np.nan_to_num(out)), prior])


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to a recording."""

    model: Model
    p: np.ndarray
    """(p,) parameters; those of effects in their own scale."""
    residual: np.ndarray
    """(r + c,) whitened, with prior rows."""
    jacobian: np.ndarray
    """(r + c, p) of the residuals."""
    states: Equilibria

    @property
    def chi2(self) -> float:
        """Sum of squared residuals, priors included."""
        return float(self.residual @ self.residual)

    @property
    def freedom(self) -> int:
        """Degrees of freedom that are left: readings and priors less parameters."""
        finite = np.isfinite(self.model.priors).sum()
        return int(len(self.residual) - len(self.model.varied) + finite - len(self.p))

    @property
    def reduced(self) -> float:
        """Chi-square per degree of freedom."""
        return self.chi2 / max(self.freedom, 1)

    @property
    def constants(self) -> Constants:
        return self.model.constants(self.p)

    @property
    def effects(self) -> list[Effect]:
        return self.model.effects(self.p)

    @property
    def covariance(self) -> np.ndarray:
        """(p, p) of the parameters, linearised."""
        return np.linalg.pinv(self.jacobian.T @ self.jacobian, hermitian=True)

    @property
    def basis(self) -> np.ndarray:
        """(r + c, k) orthonormal basis of what the parameters can explain."""
        return basis_of(self.jacobian)

    def predicted(self) -> np.ndarray:
        return self.model.predicted(self.p, self.states)


def basis_of(jacobian: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the columns, without those that are nothing or repeat others."""
    size = np.linalg.norm(jacobian, axis=0)
    columns = jacobian[:, size > 0] / size[size > 0]
    if not columns.size:
        return np.zeros((len(jacobian), 0))
    basis, length, _ = np.linalg.svd(columns, full_matrices=False)
    return basis[:, length > 1e-8]


class Point(NamedTuple):
    """A model at some parameters."""

    p: np.ndarray
    states: Equilibria
    predicted: np.ndarray
    residual: np.ndarray

    @property
    def chi2(self) -> float:
        """Infinite where a step has no equilibrium."""
        found = float(self.residual @ self.residual)
        return found if np.isfinite(found) else np.inf


def fit(model: Model, start: np.ndarray, fixed: Sequence[int] = (), useful: float = np.inf) -> Fit | None:
    """Levenberg-Marquardt within bounds, from `start`; None where the start has no equilibrium.

    None too where chi-square is not below `useful` after `PATIENCE` steps.

    A step uphill, or into loads without equilibrium, is taken back and shortened.  Derivatives are exact at the start,
    at the end and wherever secants in their stead lead no further.  `fixed` numbers parameters that stay.
    """

    def at(p: np.ndarray) -> Point:
        states = model.states(p)
        predicted = model.predicted(p, states)
        return Point(p, states, predicted, model.residuals(p, predicted))

    def derivatives(here: Point) -> np.ndarray:
        return model.jacobian(here.p, here.predicted, here.states)

    here = at(np.clip(start, *model.bounds(start)))
    if not np.isfinite(here.chi2):
        return None
    damping, jacobian, exact = 1e-3, derivatives(here), True
    for done in range(MAX_STEPS):
        if done == PATIENCE and here.chi2 > useful:
            return None
        low, high = model.bounds(here.p)
        gradient = jacobian.T @ here.residual
        held = np.isin(np.arange(len(here.p)), fixed)
        held |= ((here.p <= low) & (gradient > 0)) | ((here.p >= high) & (gradient < 0))
        small = SMALL_GAIN + SMALL_SHARE * here.chi2
        if exact and -gradient @ _step(jacobian, gradient, held, 1e-9) < small:
            break
        shorter = 4.0
        there = at(np.clip(here.p + _step(jacobian, gradient, held, damping), low, high))
        while exact and there.chi2 > here.chi2 and damping < 1e8:
            damping, shorter = damping * shorter, shorter * 2
            there = at(np.clip(here.p + _step(jacobian, gradient, held, damping), low, high))
        gain = here.chi2 - there.chi2
        if gain > 0:
            jacobian, here = _secant(jacobian, here, there), there
            damping = max(damping / 10, 1e-9)
        elif exact:
            break
        exact = gain < small
        if exact:
            jacobian = derivatives(here)
    return Fit(model, here.p, here.residual, jacobian if exact else derivatives(here), here.states)


def _step(jacobian: np.ndarray, gradient: np.ndarray, held: np.ndarray, damping: float) -> np.ndarray:
    """The damped step of the parameters that are not `held`."""
    normal = jacobian.T @ jacobian
    system = normal + np.diag(damping * np.diag(normal) + 1e-12)
    system[held], system[:, held] = 0.0, 0.0
    system[held, held] = 1.0
    return -np.linalg.solve(system, np.where(held, 0.0, gradient))


def _secant(jacobian: np.ndarray, here: Point, there: Point) -> np.ndarray:
    """Broyden's update, each parameter in its own scale; not from steps whose effect drowns in noise."""
    moved = there.p - here.p
    foreseen = jacobian @ moved
    if foreseen @ foreseen < 1:
        return jacobian
    weighted = (jacobian**2).sum(0) * moved
    return jacobian + np.outer(there.residual - here.residual - foreseen, weighted / (weighted @ moved))


def calibrate(predict: Predictor, noise: Noise, factors: Sequence[float] = (1, 0.7, 1.4, 0.5, 2, 3, 5, 8, 12)) -> Fit:
    """Fit the constants alone, from the nominal ones, or the nearest stiffness at which all steps are in balance.

    Raises
    ------
    ValueError
        If no stiffness within a factor of twelve puts all steps in balance.
    """
    model = Model(predict, noise)
    best = None
    for factor in factors:
        start = np.zeros(model.count)
        start[0] = np.log(factor)
        found = fit(model, start)
        if found is not None and (best is None or found.chi2 < best.chi2):
            best = found
        if best is not None and factor == 1:
            break
    if best is None:
        raise ValueError("no stiffness near the nominal one puts all recorded steps in balance")
    return best
