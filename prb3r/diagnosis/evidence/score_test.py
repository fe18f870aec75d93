r"""Where the mismatch sits: a score test of every hypothesis on what a fit leaves.

The direction `v` in which an alternative would move the whitened residuals is freed of all that the fitted parameters
could do as well; :math:`z = v \cdot r / |v|` is then standard normal if nothing was left out.  Of many alternatives
some are large by chance; how large the largest is by chance is found by drawing residuals.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from prb3r.diagnosis.chance import chi2_tail, normal_critical, normal_tail
from prb3r.diagnosis.evidence.linearised import moved_readings
from prb3r.diagnosis.fit.basis import all_at_once, freed
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings

REPEATED_SHARE = 1e-10
"""Share of the largest variance below which a combination of alternatives repeats others but for rounding."""
NOTHING, REPEATED = 1e-6, 1e-6
"""A change that is freed of all but this share of it is not felt; columns are repetitions of others up to this."""
LEAST_CHANGE = 1e-3
"""Size, in units of the noise, that a change is judged against at least: what rounding leaves of none is not felt."""

ROWS_DRAWN = 256
"""Numbers are drawn for a multiple of so many directions, so that the same serve many tests."""


@dataclass(frozen=True, eq=False)
class Alternative:
    """How something, at one probe, moves the whitened residuals, freed of what is fitted already."""

    subject: Any
    """A hypothesis, a law of missing moments or a weight."""
    basis: np.ndarray
    """(r + c, k) orthonormal; no columns where the recording does not feel the subject."""
    size: float
    """Norm per unit of the free parameter, or of the whole effect where it does not come by degrees."""
    start: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Free parameters `u` of the probe."""
    one_sided: bool = False
    """Whether only one sign makes sense."""

    @property
    def freedom(self) -> int:
        """Number of directions in which the alternative is free: those that the constants cannot imitate."""
        return self.basis.shape[1]

    def gain(self, residual: np.ndarray) -> np.ndarray:
        """Fall of chi-square if the subject were fitted by the linearised model; residuals in columns or alone."""
        return self._gain(self.basis.T @ residual)

    def z(self, residual: np.ndarray) -> np.ndarray:
        """The gain as the standard normal deviate that is as rare."""
        return self.z_along(self.basis.T @ residual)

    def z_along(self, along: np.ndarray) -> np.ndarray:
        """The same for what residuals have `along` the basis, (k,) or (k, draws)."""
        gain = self._gain(along)
        if self.freedom <= 1:
            return np.sqrt(gain)
        return normal_critical(np.maximum(chi2_tail(gain, self.freedom), 1e-300) / 2)

    def _gain(self, along: np.ndarray) -> np.ndarray:
        return ((np.maximum(along, 0.0) if self.one_sided else along) ** 2).sum(0)


def alternatives(fitted: Fit, hypotheses: Sequence[Hypothesis]) -> list[Alternative]:
    """The alternative of every hypothesis at every probe, around `fitted`."""
    friction = fitted.model.friction(fitted.p)
    probes = [(hypothesis, start) for hypothesis in hypotheses for start in hypothesis.starts(friction)]
    felt = alternatives_of(fitted, [hypothesis for hypothesis, _ in probes], moved_readings(fitted, probes))
    return [
        replace(
            alternative,
            start=start,
            one_sided=hypothesis.sided(friction) or hypothesis.kinked or not hypothesis.by_degrees,
        )
        for (hypothesis, start), alternative in zip(probes, felt, strict=True)
    ]


def alternatives_of(fitted: Fit, subjects: Sequence[Any], moved: Sequence[np.ndarray]) -> list[Alternative]:
    """The alternative of each subject, around `fitted`, of what moves the readings by `moved` (r, k each)."""
    white = all_at_once(fitted.model.noise.whiten, moved)
    free = all_at_once(lambda changes: freed(changes, fitted.basis), white)
    return [_alternative(*each) for each in zip(subjects, white, free, strict=True)]


def _alternative(subject: Any, white: np.ndarray, free: np.ndarray) -> Alternative:
    """The alternative of what moves the whitened readings by `white` (r, k), of which `free` (r + c, k) is left."""
    size = np.linalg.norm(free, axis=0)
    felt = size > NOTHING * np.maximum(np.linalg.norm(white, axis=0), LEAST_CHANGE)
    if not felt.any():
        return Alternative(subject, np.zeros((len(free), 0)), 0.0)
    if felt.sum() == 1:
        return Alternative(subject, free[:, felt] / size[felt], float(size[felt][0]))
    axes, length, _ = np.linalg.svd(free[:, felt] / size[felt], full_matrices=False)
    return Alternative(subject, axes[:, length > REPEATED], float(size[felt].min()))


@dataclass(frozen=True, eq=False)
class Scores:
    """The score test of all alternatives."""

    alternatives: tuple[Alternative, ...]
    z: np.ndarray
    """(d,) not negative."""
    threshold: float
    """The largest z by chance is below it but for a share of `Settings.alarm_rate`."""
    naming: float
    """The same for `Settings.naming_rate`."""
    drawn: np.ndarray
    """(k,) largest z of drawn residuals, ascending; empty where none were drawn."""

    @property
    def chance(self) -> float:
        """How often the largest z of a right model is as large or larger."""
        if not len(self.drawn):
            return float(2 * normal_tail(self.largest))
        return float((len(self.drawn) - np.searchsorted(self.drawn, self.largest) + 1) / (len(self.drawn) + 1))

    @property
    def largest(self) -> float:
        """The largest z of all alternatives; 0 without any."""
        return float(self.z.max(initial=0.0))

    def best(self) -> list[int]:
        """Numbers of the alternatives, best first, each subject once."""
        seen, order = set(), []
        for k in np.argsort(-self.z):
            if self.alternatives[k].subject not in seen and self.alternatives[k].freedom:
                seen.add(self.alternatives[k].subject)
                order.append(int(k))
        return order


def scores(fitted: Fit, tested: Sequence[Alternative], seed: int) -> Scores:
    """Test all alternatives on the residuals of `fitted`; `seed` of the draws that tell what chance does."""
    settings = fitted.model.settings
    z = np.array([candidate.z(fitted.residual) for candidate in tested])
    judged = tested[:0] if settings.tested_alone else tested
    drawn = largest_by_chance(judged, seed, settings)
    rates = np.array([settings.alarm_rate, settings.naming_rate])
    high, higher = np.quantile(drawn, 1 - rates) if len(drawn) else normal_critical(rates / 2)
    return Scores(tuple(tested), z, float(high), float(higher), drawn)


@lru_cache(maxsize=1)
def _standard_normal(seed: int, rows: int, draws: int) -> np.ndarray:
    """(rows, draws) standard normal numbers: the first rows are the same whatever their number."""
    return np.random.default_rng(seed).standard_normal((rows, draws))


def largest_by_chance(tested: Sequence[Alternative], seed: int, settings: Settings) -> np.ndarray:
    """(k,) ascending: the largest z of all alternatives on residuals drawn as a right model leaves them.

    These are standard normal, so what they have along the bases of all alternatives is normal with the bases' products
    as covariance; that is drawn.  Empty without alternatives.
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
