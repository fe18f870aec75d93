r"""How large the reading noise really is, and how much of it a photograph has in common: by marginal likelihood.

Nobody knows the noise of a camera to ten per cent, and no fit may decide it by what it happens to leave.  All that the
constants, the scatter of tensions, tolerances and the whole library could do is taken as Gaussian with its prior size;
the noise is what remains.  With these directions :math:`U`, whitened by a correlation :math:`P`, and their singular
values :math:`\sigma_i`, minus twice the logarithm of the likelihood is

.. math:: \sum_i \ln(s^2 + \sigma_i^2) + \frac{a_i^2}{s^2 + \sigma_i^2} + (r - k) \ln s^2 + \frac{R^2}{s^2} + \ln |P|

where :math:`a_i` is what the residual has along them and :math:`R` what it has beside them.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.fit.covariance import NoiseLevel, photograph_root, reading_sd
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording


class Around(NamedTuple):
    """What moves the readings beside noise."""

    fitted: np.ndarray
    """(r, p) derivatives by what is fitted freely."""
    possible: np.ndarray
    """(r, k) change by one prior standard deviation of each thing that may be there."""


SMALLEST = 1e-12
"""Share of the largest variance below which a direction repeats others."""


@dataclass(frozen=True)
class EstimatedLevel:
    """The noise level that is most likely, with an interval of its scale."""

    level: NoiseLevel
    low: float
    """Ends of the 95 % interval of `level.scale`."""
    high: float


def noise_level(
    recording: Recording, misfit: np.ndarray, around: Around, inflation: np.ndarray, settings: Settings
) -> EstimatedLevel:
    """The level of the noise in a `misfit` (r,).

    Parameters
    ----------
    around : what else moves the readings.
    inflation : (r,) factor on the standard deviation of each reading, as for doubted ones.
    """
    scales = np.exp(np.linspace(*settings.noise_scales))
    prior = (np.log(scales) / settings.noise_log_sd) ** 2
    sd = reading_sd(recording) * inflation

    def deviance(common: float, reach: float) -> np.ndarray:
        root = photograph_root(recording, sd, NoiseLevel(1.0, common, reach))
        volume = -2 * float(np.sum(np.log(root.diagonal() * sd)))  # of P alone: its root is triangular
        share = (common / settings.common_sd) ** 2
        return _deviance(root @ misfit, Around(*(root @ part for part in around)), scales) + volume + prior + share

    curves = {(0.0, np.inf): deviance(0.0, np.inf)}
    if recording.readings.count >= settings.fewest_in_photograph * len(np.unique(recording.readings.step)):
        for common in settings.common_shares:
            curves |= {(common, reach): deviance(common, reach) for reach in settings.common_reaches}
            if min(curves, key=lambda shape: float(curves[shape].min()))[0] < common:
                break  # a larger share is not likelier than a smaller one
    common, reach = min(curves, key=lambda shape: float(curves[shape].min()))
    curve = curves[common, reach]
    weight = np.exp(-(curve - curve.min()) / 2)
    share = np.cumsum(weight) / weight.sum()
    low, high = (float(np.interp(part, share, scales)) for part in (0.025, 0.975))
    best = float(np.exp(np.sum(weight * np.log(scales)) / weight.sum()))
    return EstimatedLevel(NoiseLevel(best, common, reach), min(low, best), max(high, best))


def _deviance(residual: np.ndarray, around: Around, scales: np.ndarray) -> np.ndarray:
    """Minus twice the log likelihood at every scale; what is fitted takes no part in it."""
    basis = np.linalg.qr(around.fitted / np.maximum(np.linalg.norm(around.fitted, axis=0), 1e-300))[0]
    residual = residual - basis @ (basis.T @ residual)
    directions = around.possible - basis @ (basis.T @ around.possible)
    variance, axes = np.linalg.eigh(directions.T @ directions)
    kept = variance > SMALLEST * max(variance[-1], 1e-300)
    along = (axes[:, kept].T @ (directions.T @ residual)) ** 2 / variance[kept]
    rest = max(float(residual @ residual - along.sum()), 0.0)
    spread = scales[:, None] ** 2 + variance[kept]
    inside = (np.log(spread) + along / spread).sum(1)
    return inside + (len(residual) - basis.shape[1] - kept.sum()) * 2 * np.log(scales) + rest / scales**2
