"""Nonlinear least squares: Levenberg-Marquardt within bounds, the one minimiser of the diagnosis.

`scipy.optimize.least_squares` minimises the same (a test holds both against each other), but does not serve here: its
bounds cannot move with a parameter, as those of a worn hole do with the friction of the others; its iterates stay off
the bounds, where an absent effect must be able to end; and it takes no secants between exact derivatives, which
save a third of all load paths.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from prb3r.diagnosis.settings import Settings

S = TypeVar("S")
F_co = TypeVar("F_co", covariant=True)


class Fittable(Protocol[S, F_co]):
    """A model that can be fitted: of one recording, or of several together.

    `solve` returns what `residuals` and `jacobian` are computed from; `fitted` makes the finished fit.
    """

    @property
    def settings(self) -> Settings: ...

    def bounds(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...

    def solve(self, p: np.ndarray) -> S: ...

    def residuals(self, p: np.ndarray, solved: S) -> np.ndarray: ...

    def jacobian(self, p: np.ndarray, solved: S) -> np.ndarray: ...

    def fitted(self, p: np.ndarray, residual: np.ndarray, jacobian: np.ndarray, solved: S, done: bool) -> F_co: ...


FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e8
"""Damping of the normal equations, relative to their diagonal: of the first step, nearly undamped as starts are near
the minimum, and the limits at which a step is as good as undamped or as good as none."""
RIDGE = 1e-12
"""Added to the diagonal of the normal equations, so that a parameter that no reading feels stays where it is."""
HARDER, EASIER = 4.0, 10.0
"""Factors by which the damping grows after a step uphill and shrinks after a step downhill.

It shrinks by ten as Marquardt's (J. SIAM 11 (1963) 431).  The factor of growth doubles with every further step uphill,
as Nielsen's (IMM-REP-1999-05)."""


@dataclass(frozen=True, eq=False)
class Point(Generic[S]):
    """Parameters `p` (p,) of a model, with its solution and its residuals there."""

    p: np.ndarray
    solved: S
    residual: np.ndarray

    @property
    def chi2(self) -> float:
        """Sum of squared residuals; infinite where they are not finite."""
        squares = float(self.residual @ self.residual)
        return squares if np.isfinite(squares) else np.inf


def fit(
    model: Fittable[S, F_co],
    start: np.ndarray,
    fixed: Sequence[int] = (),
    give_up_above: float = np.inf,
    most_steps: int | None = None,
    least_promise: float | None = None,
) -> F_co | None:
    """The fit of least chi-square reached from `start`; None if chi-square or its derivatives are not finite.

    A step uphill is taken back and shortened.  Derivatives are exact at the start and at the end.  In between secant
    updates stand for them until these lead no further.  Where exact derivatives lead no further either, though they
    promise a fall of chi-square, the fit is at a kink (:func:`_past_a_kink`).

    Parameters
    ----------
    fixed : indices of parameters that keep their value.
    give_up_above : None is returned too if chi-square is above this after `Settings.patience` steps.
    most_steps : largest number of steps; absent: `Settings.most_steps`.
    least_promise : the fit has converged if a linear step promises no larger fall of chi-square; absent:
        `Settings.idle_gain`.
    """
    settings = model.settings
    least_promise = settings.idle_gain if least_promise is None else least_promise

    def at(p: np.ndarray) -> Point[S]:
        solved = model.solve(p)
        return Point(p, solved, model.residuals(p, solved))

    here = at(np.clip(start, *model.bounds(start)))
    if not np.isfinite(here.chi2):
        return None
    damping, jacobian, exact, converged = FIRST_DAMPING, model.jacobian(here.p, here.solved), True, False
    promise, before, idle = np.inf, here.chi2, 0
    for done in range(settings.most_steps if most_steps is None else most_steps):
        if done == settings.patience and here.chi2 > give_up_above:
            return None
        if not _is_finite(jacobian):
            return None
        downhill = Downhill.at(here, jacobian, model.bounds(here.p), fixed)
        if exact:
            promise = downhill.promise
            if promise < least_promise + settings.small_share * here.chi2:
                converged = True
                break
            if idle == settings.idle_rounds:
                past = _past_a_kink(model, at, here, jacobian, fixed)
                if past is None:
                    break
                here, jacobian = past, model.jacobian(past.p, past.solved)
                before, idle, damping = here.chi2, 0, FIRST_DAMPING
                continue
        there = at(downhill.step(damping))
        harder = HARDER
        while exact and there.chi2 > here.chi2 and damping < MOST_DAMPING:
            damping, harder = damping * harder, harder * 2
            there = at(downhill.step(damping))
        gain, tried = here.chi2 - there.chi2, exact
        if gain > 0:
            jacobian, here = _secant(jacobian, here, there), there
            damping = max(damping / EASIER, LEAST_DAMPING)
        exact = gain < settings.idle_gain
        if exact:
            if gain > 0 or not tried:
                jacobian = model.jacobian(here.p, here.solved)
            idle = idle + 1 if before - here.chi2 < settings.idle_gain else 0
            idle = settings.idle_rounds if tried and gain <= 0 else idle
            before = here.chi2
    if not exact:
        jacobian = model.jacobian(here.p, here.solved)
    return model.fitted(here.p, here.residual, jacobian, here.solved, converged) if _is_finite(jacobian) else None


def _is_finite(jacobian: np.ndarray) -> bool:
    """Whether the squares of all derivatives are finite.

    They are not where a cable is paid out over holes of an absurd friction coefficient: the tension beyond the holes
    grows as e to the power of hundreds.
    """
    with np.errstate(over="ignore"):
        return bool(np.isfinite((jacobian**2).sum()))


class Fitted(Protocol):
    """A finished fit, as `Fittable.fitted` makes it."""

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
    """The fit restarted from where it ended, until it converges to `Settings.small_gain` or a restart brings no fall of
    chi-square that counts.

    A restart that brings less than `Settings.idle_gain` counts as convergence: at a kink, as where disks just touch,
    derivatives may promise for ever a fall that no step brings.
    """
    settings = fitted.model.settings
    for _ in range(settings.most_restarts):
        again = fit(fitted.model, fitted.p, least_promise=settings.small_gain)
        if again is None or again.chi2 > fitted.chi2:
            break
        idle = fitted.chi2 - again.chi2 < settings.idle_gain
        fitted = replace(again, converged=again.converged or idle)  # type: ignore[type-var]
        if fitted.converged:
            break
    return fitted


class Downhill(NamedTuple):
    """The normal equations of a point, and the steps that they lead to within bounds."""

    here: Point
    normal: np.ndarray
    """(p, p) normal matrix: the Jacobian's transpose times the Jacobian."""
    gradient: np.ndarray
    """(p,) half the gradient of chi-square."""
    held: np.ndarray
    """(p,) which parameters stay: those that are fixed, or on a bound beyond which chi-square would fall further."""
    bounds: tuple[np.ndarray, np.ndarray]

    @classmethod
    def at(
        cls, here: Point, jacobian: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], fixed: Sequence[int]
    ) -> "Downhill":
        """The normal equations at `here`, where the residuals have the derivatives `jacobian` (r, p)."""
        gradient, (low, high) = jacobian.T @ here.residual, bounds
        held = ((here.p <= low) & (gradient > 0)) | ((here.p >= high) & (gradient < 0))
        held[list(fixed)] = True
        return cls(here, jacobian.T @ jacobian, gradient, held, bounds)

    def change(self, damping: float) -> np.ndarray:
        """(p,) step of the damped normal equations (Marquardt); 0 for parameters that are held."""
        system = self.normal + np.diag(damping * np.diag(self.normal) + RIDGE)
        system[self.held], system[:, self.held] = 0.0, 0.0
        system[self.held, self.held] = 1.0
        return -np.linalg.solve(system, np.where(self.held, 0.0, self.gradient))

    def step(self, damping: float) -> np.ndarray:
        """(p,) parameters after the step :meth:`change`, cut off at their bounds."""
        return np.clip(self.here.p + self.change(damping), *self.bounds)

    @property
    def promise(self) -> float:
        """Fall of chi-square by the undamped step if the residuals were linear."""
        return float(-self.gradient @ self.change(LEAST_DAMPING))


def _past_a_kink(
    model: Fittable[S, F_co],
    at: Callable[[np.ndarray], Point[S]],
    here: Point,
    jacobian: np.ndarray,
    fixed: Sequence[int],
) -> Point[S] | None:
    """A point whose chi-square is lower by `Settings.idle_gain` or more; None where none is found.

    Where plates begin to yield or disks touch, the derivatives of one side promise a fall that the other side does not
    bring.  Secant updates of the Jacobian from these failed steps turn the next one along the kink.
    """
    for _ in range(model.settings.kink_trials):
        there = at(Downhill.at(here, jacobian, model.bounds(here.p), fixed).step(FIRST_DAMPING))
        if here.chi2 - there.chi2 >= model.settings.idle_gain:
            return there
        learnt = _secant(jacobian, here, there)
        if not np.isfinite(there.chi2) or learnt is jacobian:
            break
        jacobian = learnt
    return None


def _secant(jacobian: np.ndarray, here: Point, there: Point) -> np.ndarray:
    """The Jacobian after Broyden's update by the step from `here` to `there`, each parameter in its own scale.

    The same array comes back where the foreseen change of the residuals is below the noise (a norm of 1).
    """
    moved = there.p - here.p
    foreseen = jacobian @ moved
    if foreseen @ foreseen < 1:
        return jacobian
    weighted = (jacobian**2).sum(0) * moved
    return jacobian + np.outer(there.residual - here.residual - foreseen, weighted / (weighted @ moved))
