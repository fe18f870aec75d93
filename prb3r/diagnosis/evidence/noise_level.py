r"""The actual noise level of readings and tensions, and the share of it that a photograph has in common.

The noise of a camera or a spring balance is not known to ten per cent, and the residuals of a single fit cannot settle
it, as missing effects would count as noise.  So the factors `s` on the noise of the readings and `t` on the scatter of
the tensions are estimated by marginal likelihood: fitted parameters are free; the tensions, the tolerances and all
effects of the library are Gaussian with their prior standard deviations.  Take the changes of the readings by these,
with those of the tensions multiplied by `t`, whiten them by a correlation :math:`P`, and project them orthogonally to
the changes by the fitted parameters.  With their `k` singular values :math:`\sigma_i`, minus twice the ln likelihood is

.. math:: \sum_i \ln(s^2 + \sigma_i^2) + \frac{a_i^2}{s^2 + \sigma_i^2} + (r - k) \ln s^2 + \frac{R^2}{s^2} + \ln |P|

where :math:`a_i` are the components of the residual along their directions, :math:`R` is the norm of the rest of the
residual, and `r` is the number of readings less the number of fitted parameters.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy
from scipy.special import logsumexp

from prb3r.diagnosis.confidence import INTERVAL_RISE, TAIL
from prb3r.diagnosis.fit.covariance import AS_STATED, NoiseLevel, correlation_root, reading_sd
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording


class ReadingChanges(NamedTuple):
    """Changes of the readings by everything but their noise, m or rad."""

    fitted: np.ndarray
    """(r, p) derivatives by the fitted parameters, which count as free."""
    tensions: np.ndarray
    """(r, q) change by one stated standard deviation of each independent part of the scatter of the tensions."""
    possible: np.ndarray
    """(r, k) change by one prior standard deviation of each tolerance and each effect that may be there."""


ROUNDED_SHARE = 1e-12
"""Variance along a direction, relative to the largest, at or below which it is rounding error."""


class EstimatedScale(NamedTuple):
    """Factor on a stated standard deviation: exp of the posterior mean of its ln, and the ends of the 95 % interval."""

    value: float
    low: float
    high: float
    open: tuple[bool, bool] = (False, False)
    """Whether the ends are those of the factors that are considered, beyond which the interval would go on."""

    @property
    def text(self) -> str:
        """The factor in words; of an interval that goes on beyond what is considered only its other end is told."""
        if self.open[1]:
            return f"at least {self.low:.2g}"
        return f"at most {self.high:.2g}" if self.open[0] else f"{self.value:.2g}"


@dataclass(frozen=True)
class EstimatedLevel:
    """An estimated noise level, with the intervals of its two factors."""

    level: NoiseLevel
    reading: EstimatedScale
    """Factor on the noise of the readings."""
    tension: EstimatedScale
    """Factor on the scatter of the tensions; 1, with an interval of zero width, where none is stated."""


def noise_level(
    recording: Recording,
    misfit: np.ndarray,
    changes: ReadingChanges,
    inflation: np.ndarray,
    settings: Settings,
    lasts: NoiseLevel = AS_STATED,
) -> EstimatedLevel:
    """The noise level estimated from a `misfit` (r,), the readings less the predicted ones, m or rad.

    The share of the noise that a photograph has in common is the likeliest one; the factors on the noise of readings
    and tensions are averaged over their posterior for that share.

    Parameters
    ----------
    changes : changes of the readings by everything but their noise.
    inflation : (r,) factor on the standard deviation of each reading, above 1 where it is down-weighted.
    lasts : level with the shares that last through a sequence, which are kept; `changes.tensions` must account for the
        share of the tensions already.  Over how many steps the noise of a log lasts is estimated around its `span`, as
        short stretches tell it by themselves hardly better than to a factor of two.
    """
    likelihood = _Likelihood(recording, misfit, changes, reading_sd(recording) * inflation, settings, lasts)
    if recording.serial_noise.share and lasts.serial:
        likelihood = min(likelihood.of_other_spans(), key=_Likelihood.least)
    common, reach, deviance = likelihood.of_likeliest_share()
    log_density = -(deviance - deviance.min()) / 2
    reading = _scale(likelihood.log_scales, logsumexp(log_density, axis=0))
    tension = EstimatedScale(1.0, 1.0, 1.0)
    if likelihood.tensions_scatter:
        along_factors = logsumexp(log_density, axis=1)
        tension = _scale(*_finer(likelihood.log_factors, along_factors, settings.spline_points))
    level = likelihood.lasts._replace(scale=reading.value, common=common, reach=reach, tension=tension.value)
    return EstimatedLevel(level, reading, tension)


@dataclass(frozen=True, eq=False)
class _Likelihood:
    """The deviance of a misfit, priors included, as a function of the noise level."""

    recording: Recording
    misfit: np.ndarray
    changes: ReadingChanges
    sd: np.ndarray
    """(r,) stated standard deviations of the readings, times their inflation."""
    settings: Settings
    lasts: NoiseLevel

    @cached_property
    def log_scales(self) -> np.ndarray:
        """The grid of the ln of the factor on the noise of the readings."""
        return np.linspace(*self.settings.noise_scales)

    @property
    def tensions_scatter(self) -> bool:
        """Whether a scatter of the tensions is stated that moves any reading."""
        return bool(self.changes.tensions.any())

    @cached_property
    def log_factors(self) -> np.ndarray:
        """The grid of the ln of the factor on the scatter of the tensions; 0 alone where there is none."""
        return np.linspace(*self.settings.tension_scales) if self.tensions_scatter else np.zeros(1)

    def products(self, common: float, reach: float) -> "_Products":
        """Inner products under the correlation with these shares, and what the share adds to the deviance."""
        root = correlation_root(self.recording, self.sd, self.lasts._replace(common=common, reach=reach))
        volume = -2 * float(np.sum(np.log(root.diagonal() * self.sd)))  # of P alone: its root is triangular
        changes = ReadingChanges(*(root @ part for part in self.changes))
        return _products(root @ self.misfit, changes, volume + (common / self.settings.common_sd) ** 2)

    def along_scales(self, products: "_Products", log_factor: float) -> np.ndarray:
        """Deviance at all `log_scales`, for one ln of the factor on the tensions."""
        prior = (self.log_scales / self.settings.noise_log_sd) ** 2 + (log_factor / self.settings.tension_log_sd) ** 2
        return _deviance(products, np.exp(self.log_scales), np.exp(log_factor)) + prior

    def surface(self, products: "_Products") -> np.ndarray:
        """Deviance at all pairs of factors: (`log_factors`, `log_scales`)."""
        return np.stack([self.along_scales(products, log_factor) for log_factor in self.log_factors])

    def of_other_spans(self) -> list["_Likelihood"]:
        """The likelihoods with the serial noise over other numbers of steps, this one among them."""
        span = self.recording.serial_noise.span
        return [replace(self, lasts=self.lasts._replace(span=factor * span)) for factor in self.settings.serial_factors]

    def least(self) -> float:
        """The least deviance without a common share, that of the prior of the span included."""
        far = np.log(self.lasts.span / self.recording.serial_noise.span) / self.settings.serial_log_sd
        return float(self.surface(self.products(0.0, np.inf)).min() + far**2)

    def of_likeliest_share(self) -> tuple[float, float, np.ndarray]:
        """The likeliest share that a photograph has in common, its correlation length, and the :meth:`surface` there.

        Shares are tried in ascending order, at the likeliest factor on the tensions, until a larger one is not
        likelier; none is tried if photographs hold fewer readings than `Settings.fewest_in_photograph` on average.
        """
        settings, shape = self.settings, (0.0, np.inf)
        products = self.products(*shape)
        deviance = self.surface(products)
        photographs = len(np.unique(self.recording.readings.step))
        if self.recording.readings.count < settings.fewest_in_photograph * photographs:
            return *shape, deviance
        log_factor = self.log_factors[int(deviance.min(1).argmin())]
        least = {shape: float(deviance.min())}  # deviance by share and correlation length
        for common in settings.common_shares:
            tried = {(common, reach): self.products(common, reach) for reach in settings.common_reaches}
            least |= {key: float(self.along_scales(known, log_factor).min()) for key, known in tried.items()}
            best = min(least, key=least.__getitem__)
            if best[0] < common:
                break  # a larger share is not likelier than a smaller one
            shape, products = best, tried[best]
        return *shape, self.surface(products) if shape[0] else deviance


def _finer(logs: np.ndarray, log_density: np.ndarray, times: int) -> tuple[np.ndarray, np.ndarray]:
    """A grid `times` as fine over the range of `logs`, and the log density there by a cubic spline."""
    fine = np.linspace(logs[0], logs[-1], times * len(logs))
    return fine, scipy.interpolate.CubicSpline(logs, log_density)(fine)


def _scale(logs: np.ndarray, log_density: np.ndarray) -> EstimatedScale:
    """The estimate of a factor from the log density of its ln on an even grid.

    An end is open where the density has not fallen to that at the end of a 95 % interval of a normal distribution.
    """
    weight = np.exp(log_density - log_density.max())
    below, above = (bool(2 * np.log(end) > -INTERVAL_RISE) for end in np.maximum(weight[[0, -1]], np.finfo(float).tiny))
    share = np.cumsum(weight) / weight.sum()
    low, high = (float(np.exp(np.interp(part, share, logs))) for part in (TAIL, 1 - TAIL))
    best = float(np.exp(np.sum(weight * logs) / weight.sum()))
    return EstimatedScale(best, min(low, best), max(high, best), (below, above))


class _Products(NamedTuple):
    """Inner products of a residual and of the changes that may be in it, all whitened and freed of what is fitted."""

    square: float
    """Squared length of the residual."""
    freedom: int
    """Number of readings less that of fitted parameters."""
    gram: np.ndarray
    """(k, k) products of all directions, those of the tensions first."""
    along: np.ndarray
    """(k,) products of the directions with the residual."""
    tensions: int
    """Number of directions of the tensions."""
    penalty: float
    """Added to the deviance: ln of the determinant of the correlation, and the prior of its share."""


def _products(residual: np.ndarray, changes: ReadingChanges, penalty: float) -> _Products:
    """The inner products of a whitened `residual` (r,) and of the whitened `changes`."""
    basis = np.linalg.qr(changes.fitted / np.maximum(np.linalg.norm(changes.fitted, axis=0), 1e-300))[0]
    residual = residual - basis @ (basis.T @ residual)
    directions = np.hstack([changes.tensions, changes.possible])
    directions = directions - basis @ (basis.T @ directions)
    freedom, tensions = len(residual) - basis.shape[1], changes.tensions.shape[1]
    gram, along = directions.T @ directions, directions.T @ residual
    return _Products(float(residual @ residual), freedom, gram, along, tensions, penalty)


def _deviance(products: _Products, scales: np.ndarray, factor: float) -> np.ndarray:
    """Minus twice the ln of the likelihood at all factors `scales` on the readings, one `factor` on the tensions."""
    size = np.where(np.arange(len(products.gram)) < products.tensions, factor, 1.0)
    variance, axes = np.linalg.eigh(size[:, None] * products.gram * size)
    kept = variance > ROUNDED_SHARE * max(variance[-1], 1e-300)
    along = (axes[:, kept].T @ (size * products.along)) ** 2 / variance[kept]
    rest = max(products.square - float(along.sum()), 0.0)
    spread = scales[:, None] ** 2 + variance[kept]
    inside = (np.log(spread) + along / spread).sum(1)
    return inside + (products.freedom - kept.sum()) * 2 * np.log(scales) + rest / scales**2 + products.penalty
