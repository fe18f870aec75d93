r"""Where the mismatch sits: a score test of every hypothesis on what calibration leaves.

The direction `v` in which a hypothesis would move the whitened residuals is freed of all that the calibrated
parameters could do as well; :math:`z = v \cdot r / |v|` is then standard normal if nothing was left out.  Of many
hypotheses some are large by chance; how large the largest is by chance is found by drawing residuals.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.stats import chi2 as chi2_law
from scipy.stats import norm

from prb3r.diagnosis.fit.calibrate import DECLARED_CHANGE, HISTORY_CHANGE, Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis

DRAWS, AT_ONCE = 4000, 500
LEVEL, NAMING_LEVEL = 0.01, 0.003
"""Rates of false alarms that thresholds are drawn for: of saying that something is left, and of naming it."""
DETECTABLE = 5.2
"""Norm of a sensitivity from which on an effect is found nearly always."""


@dataclass(frozen=True, eq=False)
class Direction:
    """How something, at one probe, moves the whitened residuals, freed of what is fitted already."""

    subject: Any
    """A hypothesis, a law of missing moments or a weight."""
    basis: np.ndarray
    """(r + c, k) orthonormal; no columns where the recording does not feel the hypothesis."""
    size: float
    """Norm per unit of the free parameter, or of the whole effect where it does not come by degrees."""
    start: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Free parameters `u` of the probe."""
    one_sided: bool = False
    """Whether only one sign makes sense."""

    @property
    def freedom(self) -> int:
        return self.basis.shape[1]

    def gain(self, residual: np.ndarray) -> np.ndarray:
        """Fall of chi-square if the hypothesis were fitted by the linearised model; residuals in columns or one."""
        along = self.basis.T @ residual
        if self.one_sided:
            along = np.maximum(along, 0.0)
        return (along**2).sum(0)

    def z(self, residual: np.ndarray) -> np.ndarray:
        """The gain as the standard normal deviate that is as rare."""
        gain = self.gain(residual)
        if self.freedom <= 1:
            return np.sqrt(gain)
        return norm.isf(np.maximum(chi2_law.sf(gain, self.freedom), 1e-300) / 2)


def directions(fitted: Fit, hypotheses: Sequence[Hypothesis]) -> list[Direction]:
    """The direction of every hypothesis at every probe, around `fitted`."""
    model = fitted.model
    friction, basis, middle = model.friction(fitted.p), fitted.basis, fitted.predicted()
    history = model.predict.chain_of(fitted.constants, fitted.effects).presliding > 0
    change = HISTORY_CHANGE if history else DECLARED_CHANGE
    found = []
    for hypothesis in hypotheses:
        for start in hypothesis.starts(friction):
            trials, steps = [start], [1.0]
            if hypothesis.kinked:
                steps = [float(np.abs(start[0]))]
            elif hypothesis.by_degrees:
                size = change if hypothesis.mechanical else DECLARED_CHANGE
                highest = [free.bounds(friction)[1] for free in hypothesis.free]
                steps = [size if u + size <= high else -size for u, high in zip(start, highest, strict=True)]
                trials = [start + step * unit for step, unit in zip(steps, np.eye(len(start)), strict=True)]
            columns = []
            for trial, step in zip(trials, steps, strict=True):
                effects = [*fitted.effects, hypothesis.effect(trial, friction)]
                if hypothesis.mechanical:
                    moved = model.predict(fitted.constants, effects)
                else:
                    moved = model.predict.read(fitted.states, fitted.constants, effects)
                columns.append((moved - middle) / abs(step))
            whole = np.stack(columns, 1)
            whole = np.nan_to_num(whole) if np.isfinite(whole).all() else np.zeros_like(whole)
            one = direction(fitted, hypothesis, whole, basis)
            found.append(
                replace(one, start=start, one_sided=hypothesis.sided or hypothesis.kinked or not hypothesis.by_degrees)
            )
    return found


def direction(fitted: Fit, subject: Any, moved: np.ndarray, basis: np.ndarray) -> Direction:
    """The direction of what moves the readings by `moved` (r, k); `basis` of what is fitted already."""
    white = fitted.model.noise.whiten(moved)
    whole = np.vstack([white, np.zeros((len(fitted.residual) - len(white), white.shape[1]))])
    free = whole - basis @ (basis.T @ whole)
    free -= basis @ (basis.T @ free)
    size = np.linalg.norm(free, axis=0)
    felt = size > 1e-6 * np.maximum(np.linalg.norm(whole, axis=0), 1e-3)
    if not felt.any():
        return Direction(subject, np.zeros((len(whole), 0)), 0.0)
    if felt.sum() == 1:
        return Direction(subject, free[:, felt] / size[felt], float(size[felt][0]))
    own, length, _ = np.linalg.svd(free[:, felt] / size[felt], full_matrices=False)
    return Direction(subject, own[:, length > 1e-6], float(size[felt].min()))


@dataclass(frozen=True, eq=False)
class Scores:
    """The score test of all directions."""

    directions: tuple[Direction, ...]
    z: np.ndarray
    """(d,) not negative."""
    threshold: float
    """The largest z by chance is below it but for a share of `LEVEL`."""
    naming: float
    """The same for `NAMING_LEVEL`."""

    @property
    def largest(self) -> float:
        return float(self.z.max(initial=0.0))

    def best(self) -> list[int]:
        """Numbers of the directions, best first, each subject once."""
        seen, order = set(), []
        for k in np.argsort(-self.z):
            if self.directions[k].subject not in seen and self.directions[k].freedom:
                seen.add(self.directions[k].subject)
                order.append(int(k))
        return order


def scores(fitted: Fit, found: Sequence[Direction], seed: int, alone: bool = False) -> Scores:
    """Test all directions on the residuals of `fitted`; `alone`: as if each were the only one."""
    count = len(fitted.residual)
    z = np.array([each.z(fitted.residual) for each in found])
    return Scores(tuple(found), z, *chance_of_largest(found[:0] if alone else found, count, seed))


def chance_of_largest(found: Sequence[Direction], count: int, seed: int, draws: int = DRAWS) -> tuple[float, float]:
    """The z that the largest of all directions exceeds by chance in shares of `LEVEL` and `NAMING_LEVEL` of `draws`."""
    felt = [each for each in found if each.freedom]
    if not felt:
        return float(norm.isf(LEVEL / 2)), float(norm.isf(NAMING_LEVEL / 2))
    random, largest = np.random.default_rng(seed), np.zeros(draws)
    for first in range(0, draws, AT_ONCE):
        drawn = random.standard_normal((count, min(AT_ONCE, draws - first)))
        for each in felt:
            part = largest[first : first + AT_ONCE]
            np.maximum(part, each.z(drawn), out=part)
    high, higher = np.quantile(largest, [1 - LEVEL, 1 - NAMING_LEVEL])
    return float(high), float(higher)
