r"""Score tests: how well each alternative would explain what a fit leaves, and how well the best does by chance.

The direction `v` in which an alternative would move the whitened residuals is freed of all that the fitted parameters
could do as well; :math:`z = v \cdot r / |v|` is then standard normal if nothing was left out.  The largest z of many
alternatives is large by chance; its distribution is found by drawing residuals.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from prb3r.diagnosis.chance import chi2_tail, normal_critical, normal_tail
from prb3r.diagnosis.evidence.linearised import moved_readings
from prb3r.diagnosis.fit.basis import all_at_once, left_singular, projected_out
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings

REPEATED_SHARE = 1e-10
"""Variance of a combination of alternatives, as a share of the largest, up to which it is nothing but rounding."""
NOTHING, REPEATED = 1e-6, 1e-6
"""Share of a change that is left once freed, up to which it is not felt; and singular value, of columns of length 1, up
to which a combination of them is nothing but rounding."""
LEAST_CHANGE = 1e-3
"""Least norm, in units of the noise, of which `NOTHING` is taken, so that rounding of a change of 0 is not felt."""
ROWS_DRAWN = 256
"""Random numbers are drawn for a multiple of so many directions, so that one cached draw serves many tests."""


@dataclass(frozen=True, eq=False)
class Alternative:
    """Directions in which something not fitted would move the whitened residuals, freed of what is fitted."""

    subject: Any
    """A hypothesis, a pattern of missing moments (`MomentPattern`) or a weight (`NotedWeight`)."""
    basis: np.ndarray
    """(r + c, k) orthonormal, rows of priors included; no columns where the recording does not feel the subject."""
    size: float
    """Norm of the freed change per unit of the first free parameter that is felt, or by the whole effect; 0 where the
    recording does not feel the subject."""
    parameter: int = 0
    """Number of that free parameter, from 0."""
    start: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Free parameters `u` of the probe at which a hypothesis is tried."""
    one_sided: bool = False
    """Whether only a positive coefficient makes sense."""

    @property
    def freedom(self) -> int:
        """Number of directions of the alternative that the fitted parameters cannot imitate."""
        return self.basis.shape[1]

    def gain(self, residual: np.ndarray) -> np.ndarray:
        """Fall of chi-square if the subject were fitted, linearised; for a `residual` (r + c,) or (r + c, draws)."""
        return self._gain(self.basis.T @ residual)

    def z(self, residual: np.ndarray) -> np.ndarray:
        """The standard normal deviate, not negative, whose size is as rare by chance as the gain of `residual`."""
        return self.z_along(self.basis.T @ residual)

    def z_along(self, along: np.ndarray) -> np.ndarray:
        """That deviate for components `along` the basis, (k,) or (k, draws)."""
        gain = self._gain(along)
        if self.freedom <= 1:
            return np.sqrt(gain)
        return normal_critical(np.maximum(chi2_tail(gain, self.freedom), 1e-300) / 2)

    def _gain(self, along: np.ndarray) -> np.ndarray:
        return ((np.maximum(along, 0.0) if self.one_sided else along) ** 2).sum(0)


def alternatives(fitted: Fit, hypotheses: Sequence[Hypothesis]) -> list[Alternative]:
    """The alternative of every hypothesis at each of its probes, around `fitted`."""
    friction = fitted.model.friction(fitted.p)
    probes = [(hypothesis, start) for hypothesis in hypotheses for start in hypothesis.starts(friction)]
    felt = alternatives_of(fitted, [hypothesis for hypothesis, _ in probes], moved_readings(fitted, probes))
    return [
        replace(
            alternative,
            start=start,
            one_sided=hypothesis.sided(friction) or hypothesis.kinked or not hypothesis.continuous,
        )
        for (hypothesis, start), alternative in zip(probes, felt, strict=True)
    ]


def alternatives_of(fitted: Fit, subjects: Sequence[Any], moved: Sequence[np.ndarray]) -> list[Alternative]:
    """The alternative of each subject, around `fitted`, where `moved` (r, k each) are its changes of the readings."""
    white = all_at_once(fitted.model.noise.whiten, moved)
    free = all_at_once(lambda changes: projected_out(changes, fitted.basis), white)
    return [_alternative(*each) for each in zip(subjects, white, free, strict=True)]


def _alternative(subject: Any, white: np.ndarray, free: np.ndarray) -> Alternative:
    """The alternative whose change of the whitened readings is `white` (r, k), and `free` (r + c, k) once freed."""
    size = np.linalg.norm(free, axis=0)
    felt = size > NOTHING * np.maximum(np.linalg.norm(white, axis=0), LEAST_CHANGE)
    if not felt.any():
        return Alternative(subject, np.zeros((len(free), 0)), 0.0)
    first, basis = int(np.argmax(felt)), free[:, felt] / size[felt]
    if felt.sum() > 1:
        axes, length = left_singular(basis)
        basis = axes[:, length > REPEATED]
    return Alternative(subject, basis, float(size[first]), first)


@dataclass(frozen=True, eq=False)
class Scores:
    """The score tests of all alternatives, and what the largest of them is by chance."""

    alternatives: tuple[Alternative, ...]
    z: np.ndarray
    """(d,) score of each alternative, not negative."""
    threshold: float
    """What the largest z exceeds by chance at the rate `Settings.alarm_rate`."""
    naming: float
    """What it exceeds at the rate `Settings.naming_rate`."""
    drawn: np.ndarray
    """(draws,) largest z of drawn residuals, ascending; empty where none were drawn."""

    @property
    def chance(self) -> float:
        """Chance that a right model has as large a largest z, or a larger one."""
        if not len(self.drawn):
            return float(2 * normal_tail(self.largest))
        return float((len(self.drawn) - np.searchsorted(self.drawn, self.largest) + 1) / (len(self.drawn) + 1))

    @property
    def largest(self) -> float:
        """The largest z of all alternatives; 0 without any."""
        return float(self.z.max(initial=0.0))

    def best(self) -> list[int]:
        """Numbers of the alternatives in order of falling z, each subject once, without those that are not felt."""
        seen, order = set(), []
        for k in np.argsort(-self.z):
            if self.alternatives[k].subject not in seen and self.alternatives[k].freedom:
                seen.add(self.alternatives[k].subject)
                order.append(int(k))
        return order


def scores(fitted: Fit, tested: Sequence[Alternative], seed: int) -> Scores:
    """The score tests of the alternatives `tested` on the residuals of `fitted`; `seed`: of the residuals drawn."""
    settings = fitted.model.settings
    z = np.array([candidate.z(fitted.residual) for candidate in tested])
    judged = tested[:0] if settings.tested_alone else tested
    drawn = largest_by_chance(judged, seed, settings)
    rates = np.array([settings.alarm_rate, settings.naming_rate])
    high, higher = np.quantile(drawn, 1 - rates) if len(drawn) else normal_critical(rates / 2)
    return Scores(tuple(tested), z, float(high), float(higher), drawn)


@lru_cache(maxsize=1)
def _standard_normal(seed: int, rows: int, draws: int) -> np.ndarray:
    """(rows, draws) standard normal numbers; more rows begin with the same rows."""
    return np.random.default_rng(seed).standard_normal((rows, draws))


def largest_by_chance(tested: Sequence[Alternative], seed: int, settings: Settings) -> np.ndarray:
    """(draws,) largest z of all alternatives on residuals as a right model leaves them, ascending; empty without any.

    Such residuals are standard normal.  Drawn are their components along the bases of all alternatives, which are
    normal with the inner products of the bases as covariance.
    """
    felt = [candidate for candidate in tested if candidate.freedom]
    if not felt:
        return np.zeros(0)
    bases = np.hstack([candidate.basis for candidate in felt])
    variance, axes = np.linalg.eigh(bases.T @ bases)
    root = (axes * np.sqrt(np.where(variance > REPEATED_SHARE * variance[-1], variance, 0.0))) @ axes.T
    along = root @ _standard_normal(seed, -(-len(root) // ROWS_DRAWN) * ROWS_DRAWN, settings.draws)[: len(root)]
    parts = np.split(along, np.cumsum([candidate.freedom for candidate in felt])[:-1])
    return np.sort(np.max([candidate.z_along(part) for candidate, part in zip(felt, parts, strict=True)], axis=0))
