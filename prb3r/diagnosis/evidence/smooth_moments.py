r"""Whether a fit leaves missing moments of any kind that change smoothly: an omnibus test.

A score test looks along one direction after another, and the size of the residuals says little while the scale of the
noise is known to ten per cent only.  But reading noise has no memory, while a field of moments that is alike on
neighbouring plates and under similar loads, or from step to step, leaves residuals that go together.  Let the moments
be Gaussian with the covariance :math:`\sigma^2 K`.  Then the whitened residuals `r`, freed of what is fitted, have the
variance :math:`1 + \sigma^2 \lambda_i` along some directions :math:`u_i`.  The most powerful test at one
:math:`\sigma` weighs these by :math:`w_i = \sigma^2 \lambda_i / (1 + \sigma^2 \lambda_i)`; the statistic

.. math:: \sum_i w_i (u_i \cdot r)^2 / |r|^2

does not depend on the scale of the noise, nor on the priors of the parameters, each of which counts as free
(Andrews and Ploberger, Econometrica 62 (1994) 1383, on tests that are best at one alternative; Lin, Biometrika 84
(1997) 309, on the score of a variance).  Of several fields and sizes :math:`\sigma` the rarest result counts, compared
with the rarest of residuals that are drawn.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.chance import exceeded
from prb3r.diagnosis.fit.basis import basis_of, left_singular
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Solution
from prb3r.diagnosis.fit.response import moment_response
from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.chain import Loads

FELT_SHARE = 1e-8
"""Variance along a direction, as a share of the largest, up to which the residuals do not feel a field there."""


class Field(NamedTuple):
    """The scatter that a random field of missing moments would add to the whitened residuals."""

    directions: np.ndarray
    """(r, k) orthonormal."""
    variance: np.ndarray
    """(k,) variance of the residuals along them for a field of unit size, descending."""

    def weights(self, known: int) -> np.ndarray:
        """(k,) weights of the directions, for a field so large that its variance equals that of the noise along the one
        numbered `known`, counted from 1."""
        return self.variance / (self.variance + self.variance[min(known, len(self.variance)) - 1])


def chance_of_smooth_moments(fitted: Fit, seed: int) -> float:
    """Chance that a right model leaves residuals as much like smooth moments as those of `fitted`, or more so.

    Parameters
    ----------
    seed : seed of the n = `Settings.draws` residuals that are drawn; the smallest p-value there is is 1 / (n + 1).
    """
    settings, count = fitted.model.settings, fitted.recording.readings.count
    explained = basis_of(fitted.jacobian[:count])
    left = fitted.misfit - explained @ (explained.T @ fitted.misfit)
    fields = [field for field in _fields(fitted, explained) if len(field.variance)]
    if not fields:
        return 1.0
    together = basis_of(np.hstack([field.directions for field in fields]))
    rng, rest = np.random.default_rng(seed), count - explained.shape[1] - together.shape[1]
    drawn = rng.standard_normal((together.shape[1], settings.draws))
    square = (drawn**2).sum(0) + (rng.chisquare(rest, settings.draws) if rest > 0 else 0.0)
    rarest, seen = np.ones(settings.draws), 1.0
    for field in fields:
        along, by_chance = (field.directions.T @ left) ** 2, ((field.directions.T @ together) @ drawn) ** 2
        for known in settings.field_directions:
            weights = field.weights(known)
            score, usual = weights @ along / (left @ left), weights @ by_chance / square
            ordered = np.sort(usual)
            rarest = np.minimum(rarest, exceeded(ordered, usual))
            seen = min(seen, float(exceeded(ordered, score)))
    return float(exceeded(np.sort(-rarest), -seen))


def _fields(fitted: Fit, explained: np.ndarray) -> Iterator[Field]:
    """The fields of :func:`moment_fields`, freed of what is fitted.

    Parameters
    ----------
    explained : (r, p) orthonormal basis of what the parameters can do to the whitened readings.
    """
    for white in moment_fields(fitted).values():
        axes, size = left_singular(white - explained @ (explained.T @ white))
        felt = size**2 > FELT_SHARE * size[0] ** 2
        yield Field(axes[:, felt], size[felt] ** 2)


def moment_fields(fitted: Fit) -> dict[str, np.ndarray]:
    """(r, k) whitened change of the readings by each mode of three fields of moments that are alike on neighbouring
    plates: under like loads, under like loads and slips, and from step to step; by what their moments go with.

    Of a field of unit size the moments have the largest one of the cables as their standard deviation.
    """
    predict, settings, moment = fitted.model.predict, fitted.model.settings, response_to_moments(fitted)
    plates = np.arange(moment.shape[1], dtype=float)
    on_arm = moment @ leading_modes(gaussian_correlation(plates[:, None], settings.alike_plates), settings)
    forces, slips = _relative(fitted.solved.loads)
    step = np.arange(len(slips), dtype=float)[:, None]
    of_sequence = predict.recording.of_sequence
    fields = {
        "loads": gaussian_correlation(forces, settings.alike_loads),
        "loads and slips": gaussian_correlation(np.hstack([forces, slips]), settings.alike_loads),
        "steps": gaussian_correlation(step, settings.alike_steps) * (of_sequence[:, None] == of_sequence),
    }
    return {name: modes_of_field(fitted, on_arm, together) for name, together in fields.items()}


def response_to_moments(fitted: Fit) -> np.ndarray:
    """(r, n) change of every reading by a moment on each plate at its own step, as large as the largest of the cables,
    m or rad."""
    largest = cable_moment(fitted.solved)
    return largest * moment_response(fitted.model.predict, fitted.solved, largest)


def cable_moment(solved: Solution) -> float:
    """Largest moment of a cable about the axis of its plates in any step, N m; 1 where nothing is pulled."""
    return float(np.abs(solved.loads.tension).max(initial=0.0) * np.abs(solved.chain.offset).max(initial=0.0)) or 1.0


def modes_of_field(fitted: Fit, on_arm: np.ndarray, over_steps: np.ndarray) -> np.ndarray:
    """(r, k) whitened change of the readings by each mode of a field of moments.

    Parameters
    ----------
    on_arm : (r, a) change of every reading by each mode along the arm.
    over_steps : (s, s) covariance of the size of each of them over the steps.
    """
    readings = fitted.recording.readings
    over = leading_modes(over_steps, fitted.model.settings)[readings.step]
    return fitted.model.noise.whiten((on_arm[:, :, None] * over[:, None, :]).reshape(readings.count, -1))


def _relative(loads: Loads) -> tuple[np.ndarray, np.ndarray]:
    """(s, k) tensions and dead forces as shares of the largest of each, and (s, m) slips, 1 apart for opposite ones."""
    force = np.hstack([loads.tip, loads.force.reshape(len(loads.tip), -1)])
    shares = [part / (np.abs(part).max(initial=0.0) or 1.0) for part in (loads.tension, force)]
    return np.hstack(shares), loads.slip / 2


def gaussian_correlation(places: np.ndarray, reach: float) -> np.ndarray:
    """(s, s) Gaussian correlation exp(-d^2 / (2 reach^2)) of points at the distance d, with the coordinates `places`
    (s, k)."""
    return np.exp(-((places[:, None] - places) ** 2).sum(-1) / (2 * reach**2))


def leading_modes(covariance: np.ndarray, settings: Settings) -> np.ndarray:
    """(n, k) root of a `covariance` (n, n) by its largest modes, in descending order: as many as make up
    `Settings.field_share` of its trace, and at most `Settings.most_field_modes`."""
    variance, axes = np.linalg.eigh(covariance)
    variance, axes = np.maximum(variance[::-1], 0.0), axes[:, ::-1]
    kept = int(np.searchsorted(np.cumsum(variance), settings.field_share * variance.sum())) + 1
    kept = min(kept, settings.most_field_modes)
    return axes[:, :kept] * np.sqrt(variance[:kept])
