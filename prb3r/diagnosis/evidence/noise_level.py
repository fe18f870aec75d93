r"""How large the noise of readings and tensions really is, and how much of it a photograph has in common.

Nobody knows the noise of a camera or of a spring balance to ten per cent, and what one fit happens to leave may not
decide it.  So the factors `s` on the noise of the readings and `t` on the scatter of the tensions are estimated by
marginal likelihood: what is fitted counts as free, and the scatter of tensions, tolerances and the whole library as
Gaussian with their prior sizes.  Let the changes of the readings by these, the tensions' `t` times as large as stated,
whitened by a correlation :math:`P` and freed of what is fitted, have the `k` singular values :math:`\sigma_i`.  Minus
twice the logarithm of the likelihood is

.. math:: \sum_i \ln(s^2 + \sigma_i^2) + \frac{a_i^2}{s^2 + \sigma_i^2} + (r - k) \ln s^2 + \frac{R^2}{s^2} + \ln |P|

where :math:`a_i` is the residual along their directions, :math:`R` its norm beside them, and `r` the number of readings
less that of fitted parameters.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from scipy.special import logsumexp

from prb3r.diagnosis.confidence import TAIL
from prb3r.diagnosis.fit.covariance import AS_STATED, NoiseLevel, correlation_root, reading_sd
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording


class Around(NamedTuple):
    """Changes of the readings by everything but their noise, m or rad."""

    fitted: np.ndarray
    """(r, p) derivatives by the fitted parameters, which count as free."""
    tensions: np.ndarray
    """(r, q) change by one stated standard deviation of each independent part of the scatter of the tensions."""
    possible: np.ndarray
    """(r, k) change by one prior standard deviation of each tolerance and each effect that may be there."""


ROUNDED_SHARE = 1e-12
"""Variance along a direction, as a share of the largest, up to which it is nothing but rounding."""


class EstimatedScale(NamedTuple):
    """A factor on a stated standard deviation: e to the posterior mean of its ln, and the ends of its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class EstimatedLevel:
    """An estimated noise level, with the intervals of its two factors."""

    level: NoiseLevel
    reading: EstimatedScale
    """Factor on the noise of the readings."""
    tension: EstimatedScale
    """Factor on the scatter of the tensions; 1 with an interval of no width where none is stated."""


def noise_level(
    recording: Recording,
    misfit: np.ndarray,
    around: Around,
    inflation: np.ndarray,
    settings: Settings,
    lasts: NoiseLevel = AS_STATED,
) -> EstimatedLevel:
    """The level of the noise in a `misfit` (r,) of readings less predicted ones, m or rad.

    The share that a photograph has in common is the likeliest of a few, tried in ascending order until a larger one is
    not likelier; the factors are averaged over their posterior.

    Parameters
    ----------
    around : what else moves the readings.
    inflation : (r,) factor on the standard deviation of each reading, above 1 where it is weighed down.
    lasts : level with the shares that last through a sequence, which are kept; that of the tensions has to be in
        `around` already.
    """
    logs = np.linspace(*settings.noise_scales)
    scattered = bool(around.tensions.any())
    log_scatter = np.linspace(*settings.tension_scales) if scattered else np.zeros(1)
    sd = reading_sd(recording) * inflation

    def seen(common: float, reach: float) -> "_Seen":
        """Misfit and changes whitened by the correlation of a photograph, with what its share adds to the deviance."""
        root = correlation_root(recording, sd, lasts._replace(common=common, reach=reach))
        volume = -2 * float(np.sum(np.log(root.diagonal() * sd)))  # of P alone: its root is triangular
        return _seen(
            root @ misfit, Around(*(root @ part for part in around)), volume + (common / settings.common_sd) ** 2
        )

    def along_scales(through: "_Seen", log_factor: float) -> np.ndarray:
        """Deviance with the priors at all factors on the readings, for one on the tensions."""
        prior = (logs / settings.noise_log_sd) ** 2 + (log_factor / settings.tension_log_sd) ** 2
        return _deviance(through, np.exp(logs), np.exp(log_factor)) + prior

    def surface(through: "_Seen") -> np.ndarray:
        """Deviance with the priors, (factors on the tensions, factors on the readings)."""
        return np.stack([along_scales(through, log_factor) for log_factor in log_scatter])

    shape, through = (0.0, np.inf), seen(0.0, np.inf)
    deviance = surface(through)
    if recording.readings.count >= settings.fewest_in_photograph * len(np.unique(recording.readings.step)):
        likely = log_scatter[int(deviance.min(1).argmin())]
        curves = {shape: float(deviance.min())}
        for common in settings.common_shares:
            more = {(common, reach): seen(common, reach) for reach in settings.common_reaches}
            curves |= {key: float(along_scales(level, likely).min()) for key, level in more.items()}
            best = min(curves, key=lambda key: curves[key])
            if best[0] < common:
                break  # a larger share is not likelier than a smaller one
            shape, through = best, more[best]
        if shape[0]:
            deviance = surface(through)
    density = -(deviance - deviance.min()) / 2
    reading = _scale(logs, logsumexp(density, axis=0))
    tension = EstimatedScale(1.0, 1.0, 1.0)
    if scattered:
        tension = _scale(*_finer(log_scatter, logsumexp(density, axis=1), settings.spline_points))
    common, reach = shape
    level = lasts._replace(scale=reading.value, common=common, reach=reach, tension=tension.value)
    return EstimatedLevel(level, reading, tension)


def _finer(logs: np.ndarray, log_density: np.ndarray, times: int) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms over the range of `logs`, `times` as many, and the log density there by a cubic spline."""
    fine = np.linspace(logs[0], logs[-1], times * len(logs))
    return fine, scipy.interpolate.CubicSpline(logs, log_density)(fine)


def _scale(logs: np.ndarray, log_density: np.ndarray) -> EstimatedScale:
    """The estimate of a factor from the log density of its ln on an even grid."""
    weight = np.exp(log_density - log_density.max())
    share = np.cumsum(weight) / weight.sum()
    low, high = (float(np.exp(np.interp(part, share, logs))) for part in (TAIL, 1 - TAIL))
    best = float(np.exp(np.sum(weight * logs) / weight.sum()))
    return EstimatedScale(best, min(low, best), max(high, best))


class _Seen(NamedTuple):
    """Inner products of a residual and of all that may be in it, whitened and freed of what is fitted."""

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
    price: float
    """Added to the deviance: ln of the determinant of the correlation, and the prior of its share."""


def _seen(residual: np.ndarray, around: Around, price: float) -> _Seen:
    """The inner products of a whitened `residual` (r,) and of what is `around` it, whitened too."""
    basis = np.linalg.qr(around.fitted / np.maximum(np.linalg.norm(around.fitted, axis=0), 1e-300))[0]
    residual = residual - basis @ (basis.T @ residual)
    directions = np.hstack([around.tensions, around.possible])
    directions = directions - basis @ (basis.T @ directions)
    freedom, tensions = len(residual) - basis.shape[1], around.tensions.shape[1]
    gram, along = directions.T @ directions, directions.T @ residual
    return _Seen(float(residual @ residual), freedom, gram, along, tensions, price)


def _deviance(through: _Seen, scales: np.ndarray, factor: float) -> np.ndarray:
    """Minus twice the ln of the likelihood at all factors `scales` on the readings, one `factor` on the tensions."""
    size = np.where(np.arange(len(through.gram)) < through.tensions, factor, 1.0)
    variance, axes = np.linalg.eigh(size[:, None] * through.gram * size)
    kept = variance > ROUNDED_SHARE * max(variance[-1], 1e-300)
    along = (axes[:, kept].T @ (size * through.along)) ** 2 / variance[kept]
    rest = max(through.square - float(along.sum()), 0.0)
    spread = scales[:, None] ** 2 + variance[kept]
    inside = (np.log(spread) + along / spread).sum(1)
    return inside + (through.freedom - kept.sum()) * 2 * np.log(scales) + rest / scales**2 + through.price
