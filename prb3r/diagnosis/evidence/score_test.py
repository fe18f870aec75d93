r"""Score tests: how well each alternative would explain the residuals of a fit, and how well the best does by chance.

Let `v` be the direction in which an alternative would move the whitened residuals `r`, projected orthogonally to what
the fitted parameters can do ("freed").  If the model is complete, :math:`z = v \cdot r / |v|` is standard normal.  The
largest z of many alternatives is large by chance; its distribution is simulated by drawing residuals.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from prb3r.diagnosis.chance import chi2_tail, exceeded, normal_critical, normal_tail
from prb3r.diagnosis.evidence.linearised import moved_readings, probes_of
from prb3r.diagnosis.fit.basis import all_at_once, basis_of, left_singular, projected_out
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings

ROUNDED_VARIANCE = 1e-10
"""Variance of a combination of alternatives, relative to the largest, at or below which it is rounding error."""
LEAST_FREED_SHARE = 1e-6
"""A change counts as felt only if more than this share of its norm is orthogonal to what the parameters can do."""
ROUNDED_SINGULAR_VALUE = 1e-6
"""Singular value, for columns of unit length, at or below which a combination of the columns is rounding error."""
LEAST_CHANGE = 1e-3
"""Lower bound of the norm that `LEAST_FREED_SHARE` refers to, in units of the noise: a change that is 0 but for
rounding is then not felt."""
ROWS_DRAWN = 256
"""Random numbers are drawn in blocks of this many rows, so that one cached draw serves tests of different sizes."""


@dataclass(frozen=True, eq=False)
class Alternative:
    """Directions in which something that is not fitted would move the whitened residuals, freed of the parameters."""

    subject: Any
    """A hypothesis, a pattern of missing moments (`MomentPattern`) or a weight (`NotedWeight`)."""
    basis: np.ndarray
    """(r + c, k) orthonormal columns over readings and priors; k = 0 if the subject moves no reading."""
    size: float
    """Norm of the freed change per unit of the first free parameter that moves any reading, or by the whole effect;
    0 if the subject moves none."""
    parameter: int = 0
    """Index of that free parameter."""
    start: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Free parameters `u` of the probe at which a hypothesis is tried."""
    one_sided: bool = False
    """Whether negative coefficients are impossible."""

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the test: directions of the alternative that the fitted parameters cannot imitate."""
        return self.basis.shape[1]

    def gain(self, residual: np.ndarray) -> np.ndarray:
        """Linearised fall of chi-square if the subject were fitted, for a `residual` (r + c,) or (r + c, draws)."""
        return self._gain(self.basis.T @ residual)

    def z(self, residual: np.ndarray) -> np.ndarray:
        """Score of a `residual`: the non-negative normal deviate whose two-sided p-value is that of the gain."""
        return self.z_along(self.basis.T @ residual)

    def z_along(self, along: np.ndarray) -> np.ndarray:
        """As :meth:`z`, given the components `along` the basis, (k,) or (k, draws)."""
        gain = self._gain(along)
        if self.freedom <= 1:
            return np.sqrt(gain)
        return normal_critical(np.maximum(chi2_tail(gain, self.freedom), 1e-300) / 2)

    def _gain(self, along: np.ndarray) -> np.ndarray:
        """As :meth:`gain`, given the components `along` the basis, (k,) or (k, draws)."""
        return ((np.maximum(along, 0.0) if self.one_sided else along) ** 2).sum(0)


def alternatives(fitted: Fit, hypotheses: Sequence[Hypothesis]) -> list[Alternative]:
    """The alternative of every hypothesis at each of its probes, around `fitted`."""
    friction = fitted.model.friction(fitted.p)
    probes = probes_of(fitted, hypotheses)
    felt = alternatives_of(fitted, [hypothesis for hypothesis, _ in probes], moved_readings(fitted, probes))
    return [
        replace(alternative, start=start, one_sided=hypothesis.one_sided(friction))
        for (hypothesis, start), alternative in zip(probes, felt, strict=True)
    ]


def alternatives_of(fitted: Fit, subjects: Sequence[Any], moved: Sequence[np.ndarray]) -> list[Alternative]:
    """The alternative of each subject around `fitted`; `moved` holds its changes (r, k) of the readings, m or rad."""
    white = all_at_once(fitted.model.noise.whiten, moved)
    basis = basis_of(_without(fitted.jacobian, rows)) if len(rows := _contradicted(fitted)) else fitted.basis
    free = all_at_once(lambda changes: projected_out(changes, basis), white)
    return [_alternative(*each) for each in zip(subjects, white, free, strict=True)]


def _contradicted(fitted: Fit) -> np.ndarray:
    """(k,) rows of the residual with the priors of effects' parameters that end more than `Settings.contradicted_sd`
    from nothing.

    Such a prior pulls at what the readings tell, and the misfit that it leaves there is none of missing physics.
    """
    far = np.abs(fitted.p / fitted.model.deviations) > fitted.model.settings.contradicted_sd
    far[: len(fitted.model.varied)] = False
    return fitted.recording.readings.count + np.flatnonzero(far)


def _without(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The residual (r + c,) or its derivatives (r + c, p) with some `rows` 0."""
    out = values.copy()
    out[rows] = 0.0
    return out


def _alternative(subject: Any, white: np.ndarray, free: np.ndarray) -> Alternative:
    """The alternative of a subject, from its whitened changes `white` (r, k) and these freed, `free` (r + c, k)."""
    size = np.linalg.norm(free, axis=0)
    felt = size > LEAST_FREED_SHARE * np.maximum(np.linalg.norm(white, axis=0), LEAST_CHANGE)
    if not felt.any():
        return Alternative(subject, np.zeros((len(free), 0)), 0.0)
    first, basis = int(np.argmax(felt)), free[:, felt] / size[felt]
    if felt.sum() > 1:
        axes, length = left_singular(basis)
        basis = axes[:, length > ROUNDED_SINGULAR_VALUE]
    return Alternative(subject, basis, float(size[first]), first)


@dataclass(frozen=True, eq=False)
class Scores:
    """The score tests of all alternatives, and the distribution of the largest score under a right model."""

    alternatives: tuple[Alternative, ...]
    z: np.ndarray
    """(d,) score of each alternative, not negative."""
    threshold: float
    """Critical value of the largest z at the significance level `Settings.alarm_rate`."""
    naming: float
    """Critical value at the stricter level `Settings.naming_rate`."""
    drawn: np.ndarray
    """(draws,) largest z of each draw of residuals, ascending; empty if none were drawn."""

    @property
    def chance(self) -> float:
        """The p-value of the largest z: the chance that a right model has one as large or larger."""
        if not len(self.drawn):
            return float(2 * normal_tail(self.largest))
        return float(exceeded(self.drawn, self.largest))

    @property
    def largest(self) -> float:
        """The largest z of all alternatives; 0 if there are none."""
        return float(self.z.max(initial=0.0))

    def best(self) -> list[int]:
        """Indices of the alternatives in order of falling z: each subject once, those that move no reading left out."""
        seen, order = set(), []
        for k in np.argsort(-self.z):
            if self.alternatives[k].subject not in seen and self.alternatives[k].freedom:
                seen.add(self.alternatives[k].subject)
                order.append(int(k))
        return order


def scores(fitted: Fit, tested: Sequence[Alternative], seed: int) -> Scores:
    """The score tests of the alternatives `tested` on the residuals of `fitted`.

    `seed` is that of the residuals drawn for the critical values.  With `Settings.tested_alone` none are drawn, and the
    critical values are those of a single test.
    """
    settings = fitted.model.settings
    residual = _without(fitted.residual, _contradicted(fitted))
    z = np.array([candidate.z(residual) for candidate in tested])
    judged = tested[:0] if settings.tested_alone else tested
    drawn = largest_by_chance(judged, seed, settings)
    rates = np.array([settings.alarm_rate, settings.naming_rate])
    high, higher = np.quantile(drawn, 1 - rates) if len(drawn) else normal_critical(rates / 2)
    return Scores(tuple(tested), z, float(high), float(higher), drawn)


@lru_cache(maxsize=1)
def _standard_normal(seed: int, rows: int, draws: int) -> np.ndarray:
    """(rows, draws) standard normal numbers; the first rows do not depend on the number of rows."""
    return np.random.default_rng(seed).standard_normal((rows, draws))


def largest_by_chance(tested: Sequence[Alternative], seed: int, settings: Settings) -> np.ndarray:
    """(draws,) largest z of all alternatives on residuals of a right model, ascending; empty without alternatives.

    Residuals of a right model are standard normal.  Only their components along the bases of the alternatives are
    drawn: these are normal, and the inner products of the bases are their covariance.
    """
    felt = [candidate for candidate in tested if candidate.freedom]
    if not felt:
        return np.zeros(0)
    bases = np.hstack([candidate.basis for candidate in felt])
    variance, axes = np.linalg.eigh(bases.T @ bases)
    root = (axes * np.sqrt(np.where(variance > ROUNDED_VARIANCE * variance[-1], variance, 0.0))) @ axes.T
    along = root @ _standard_normal(seed, -(-len(root) // ROWS_DRAWN) * ROWS_DRAWN, settings.draws)[: len(root)]
    parts = np.split(along, np.cumsum([candidate.freedom for candidate in felt])[:-1])
    return np.sort(np.max([candidate.z_along(part) for candidate, part in zip(felt, parts, strict=True)], axis=0))
