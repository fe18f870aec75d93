"""Nonlinear least squares: Levenberg-Marquardt within bounds, the one minimiser of the diagnosis.

`scipy.optimize.least_squares` minimises the same (a test holds both against each other), but does not serve here: its
bounds cannot move with a parameter, as those of a worn hole do with the friction of the others; its iterates stay off
the bounds, where an effect that is none must be able to end; and it takes no secants between exact derivatives, which
save a third of all load paths.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from prb3r.diagnosis.settings import Settings

S = TypeVar("S")
F_co = TypeVar("F_co", covariant=True)


class Fittable(Protocol[S, F_co]):
    """What is fitted: a model of one recording, or of several together."""

    @property
    def settings(self) -> Settings: ...

    def bounds(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...

    def solve(self, p: np.ndarray) -> S: ...

    def residuals(self, p: np.ndarray, solved: S) -> np.ndarray: ...

    def jacobian(self, p: np.ndarray, solved: S) -> np.ndarray: ...

    def fitted(self, p: np.ndarray, residual: np.ndarray, jacobian: np.ndarray, solved: S, done: bool) -> F_co: ...


FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e8
"""Of the normal equations, relative to their diagonal: at first, and where a step is as good as undamped or nothing."""


@dataclass(frozen=True, eq=False)
class Point(Generic[S]):
    """A model at some parameters."""

    p: np.ndarray
    solved: S
    residual: np.ndarray

    @property
    def chi2(self) -> float:
        """Sum of squared residuals; infinite where they are not finite."""
        squares = float(self.residual @ self.residual)
        return squares if np.isfinite(squares) else np.inf


def fit(model: Fittable[S, F_co], start: np.ndarray, fixed: Sequence[int] = (), useful: float = np.inf) -> F_co | None:
    """The model with the parameters of least chi-square, from `start`; None where that is not finite.

    A step uphill is taken back and shortened.  Derivatives are exact at the start,
    at the end and wherever secants in their stead lead no further.

    Parameters
    ----------
    fixed : numbers of parameters that stay.
    useful : None is returned too where chi-square is not below it after `Settings.patience` steps.
    """
    settings = model.settings

    def at(p: np.ndarray) -> Point[S]:
        solved = model.solve(p)
        return Point(p, solved, model.residuals(p, solved))

    here = at(np.clip(start, *model.bounds(start)))
    if not np.isfinite(here.chi2):
        return None
    damping, jacobian, exact, converged = FIRST_DAMPING, model.jacobian(here.p, here.solved), True, False
    before, idle = here.chi2, 0
    for done in range(settings.most_steps):
        if done == settings.patience and here.chi2 > useful:
            return None
        low, high = model.bounds(here.p)
        gradient = jacobian.T @ here.residual
        held = ((here.p <= low) & (gradient > 0)) | ((here.p >= high) & (gradient < 0))
        held[list(fixed)] = True
        small = settings.small_gain + settings.small_share * here.chi2
        if exact and -gradient @ _step(jacobian, gradient, held, LEAST_DAMPING) < small:
            converged = True
            break
        if idle == settings.idle_rounds:
            break
        harder = 4.0
        there = at(np.clip(here.p + _step(jacobian, gradient, held, damping), low, high))
        while exact and there.chi2 > here.chi2 and damping < MOST_DAMPING:
            damping, harder = damping * harder, harder * 2
            there = at(np.clip(here.p + _step(jacobian, gradient, held, damping), low, high))
        gain = here.chi2 - there.chi2
        if gain > 0:
            jacobian, here = _secant(jacobian, here, there), there
            damping = max(damping / 10, LEAST_DAMPING)
        elif exact:
            break
        exact = gain < settings.idle_gain
        if exact:
            jacobian = model.jacobian(here.p, here.solved)
            before, idle = here.chi2, idle + 1 if before - here.chi2 < settings.idle_gain else 0
    if not exact:
        jacobian = model.jacobian(here.p, here.solved)
    return model.fitted(here.p, here.residual, jacobian, here.solved, converged)


class Fitted(Protocol):
    """Where a fit ended."""

    @property
    def model(self) -> Any: ...

    @property
    def p(self) -> np.ndarray: ...

    @property
    def chi2(self) -> float: ...

    @property
    def converged(self) -> bool: ...


F = TypeVar("F", bound=Fitted)


def polished(fitted: F) -> F:
    """The fit begun again where it ended, until it converges or beginning again brings nothing that counts.

    At a kink, as where disks just touch, steps may promise for ever what they do not bring.
    """
    settings = fitted.model.settings
    for _ in range(settings.most_restarts):
        if fitted.converged:
            break
        again = fit(fitted.model, fitted.p)
        if again is None or again.chi2 > fitted.chi2:
            break
        idle = fitted.chi2 - again.chi2 < settings.idle_gain
        fitted = replace(again, converged=again.converged or idle)  # type: ignore[type-var]
    return fitted


def _step(jacobian: np.ndarray, gradient: np.ndarray, held: np.ndarray, damping: float) -> np.ndarray:
    """(p,) the damped step of the parameters that are not `held`."""
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
