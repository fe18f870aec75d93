r"""The robust misfit between a recording and its manipulator, by which remedies of blunders are compared.

Readings are taken to follow a Cauchy distribution with the stated standard deviation as its scale: the misfit of a
reading that is `r` standard deviations off is :math:`\ln(1 + r^2)`.  So it counts by how many powers of ten
readings miss, and neither gross outliers nor missing physics nor a wrongly stated noise decide.  All readings of a
photograph count as one number, since what is wrong with one of them is mostly wrong with all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np
import scipy

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.covariance import independent, reading_sd
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit, Model
from prb3r.diagnosis.fit.prediction import Predictor, Solution, predictor
from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.recording.recording import Kind, Recording

FIXED_FRAME_SD = 1e-12
"""Prior standard deviation, m or rad, of a coordinate of the camera frame that the recording states as known."""
NORMAL_QUARTILE = 0.6745
"""Upper quartile of the standard normal distribution: half of all draws lie within it, either way."""


def expected_loss(scale: float) -> float:
    """Mean robust misfit of a reading whose noise is Gaussian and `scale` times the stated one."""

    def weighed(z: float) -> float:
        return np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) * np.log1p((scale * z) ** 2)

    return float(scipy.integrate.quad(weighed, -np.inf, np.inf)[0])


@dataclass(frozen=True, eq=False)
class Standing:
    """How well a recording agrees with its manipulator at given constants."""

    recording: Recording
    constants: Constants
    loss: np.ndarray
    """(r,) robust misfit of every reading; one without prediction counts as off by the whole length or half a turn."""
    improbable: float
    """Minus the logarithm of the prior density of the constants, up to a constant (:meth:`Trier.improbable`)."""

    @property
    def total(self) -> float:
        """Sum over photographs of the mean robust misfit of their readings, and improbability of the constants."""
        step = self.recording.readings.step
        return float((self.loss / np.bincount(step)[step]).sum() + self.improbable)


@dataclass(frozen=True, eq=False)
class Trier:
    """Computes standings, with what is the same for a recording and all its remedies."""

    sd: np.ndarray
    """(r,) standard deviation of every reading of the recording as it is, m or rad."""
    settings: Settings

    def standings(
        self, predict: Predictor, rows: np.ndarray, grid: Sequence[Constants], predicted: np.ndarray
    ) -> list[Standing]:
        """The standing of the recording of `predict` with each of the constants of a grid.

        Parameters
        ----------
        rows : (k,) index that each of its readings has in the recording as it is.
        predicted : (c, k) predicted readings, m and rad; NaN without equilibrium.
        """
        recording, away = predict.recording, predict.misfit(predicted)
        lost = np.where(recording.readings.is_position, predict.chain.length, np.pi)
        losses = np.log1p((np.where(np.isfinite(away), away, lost) / self.sd[rows]) ** 2)
        return [
            Standing(recording, *known, self.improbable(recording, known[0]))
            for known in zip(grid, losses, strict=True)
        ]

    def improbable(self, recording: Recording, constants: Constants) -> float:
        """Minus the ln of the prior density of the constants, up to a constant.

        That of stiffness and friction is Gaussian with the spread of handbook values; what is stated of them and of the
        camera frame is robust, as that of readings.
        """
        handbook = 0.5 * (constants.log_stiffness / self.settings.modulus_sd) ** 2
        handbook += 0.5 * (constants.log_friction / self.settings.friction_sd) ** 2
        stiff = constants.log_stiffness / (recording.prior.youngs_modulus or np.inf)
        rubbing = constants.log_friction / (recording.prior.friction_coefficient or np.inf)
        measurement = recording.measurement
        turned = constants.rotation / (measurement.frame_rotation_sd_rad or np.inf)
        moved = np.array([constants.x, constants.y]) / (measurement.frame_position_sd_m or np.inf)
        stated = np.log1p(stiff**2) + np.log1p(rubbing**2) + np.log1p(turned**2) + np.log1p(moved @ moved)
        return float(handbook + stated)

    def framed(self, predict: Predictor, rows: np.ndarray, grid: Sequence[Constants], seen: "Sight") -> list[Standing]:
        """The standing of the recording of `predict` with each of the constants of a grid, the camera frame fitted.

        The frame comes from least squares, reweighted `Settings.robust_rounds` times; readings are linear in its
        change.

        Parameters
        ----------
        rows : (r,) index that each of its readings has in the recording as it is.
        seen : what the camera reads of all disks with each of the constants, before the frame is fitted.
        """
        readings, measurement = predict.recording.readings, predict.recording.measurement
        of_readings = slice(None), readings.step, readings.disk, readings.kind
        away, columns = predict.misfit(seen.readings[of_readings]), seen.columns[of_readings]
        known = np.isfinite(away)
        turned, moved = measurement.frame_rotation_sd_rad, measurement.frame_position_sd_m
        prior = np.array([turned or FIXED_FRAME_SD, moved or FIXED_FRAME_SD, moved or FIXED_FRAME_SD]) ** -2.0
        already = np.array([(constants.rotation, constants.x, constants.y) for constants in grid])
        change, among, missed, variance = 0 * already, columns.swapaxes(1, 2), np.nan_to_num(away), self.sd[rows] ** 2
        for _ in range(self.settings.robust_rounds):
            weight = known / (variance + (missed - (columns @ change[..., None])[..., 0]) ** 2)
            normal = (among * weight[:, None]) @ columns + np.diag(prior)
            pull = (among @ (weight * missed)[..., None])[..., 0] - prior * already
            change = np.linalg.solve(normal, pull[..., None])[..., 0]
        change[~known.any(1)] = 0.0  # nothing is seen
        left = away - (columns @ change[..., None])[..., 0]
        frames = (already + change).tolist()
        framed = [c._replace(rotation=frame[0], x=frame[1], y=frame[2]) for c, frame in zip(grid, frames, strict=True)]
        return self.standings(predict, rows, framed, readings.value - left)

    def fitted(self, recording: Recording, rows: np.ndarray, start: Constants) -> Standing | None:
        """The standing of a recording with the constants of least robust misfit near `start`; None where the fit fails,
        as it does without readings.

        `rows`: as of :meth:`standings`.
        """
        if not len(rows):
            return None
        predict, settings = predictor(recording, self.settings), self.settings
        model = Model(predict, independent(self.sd[rows]), settings=settings)
        p = np.array([getattr(start, name) for name in model.varied])
        missed = model.residuals(p, model.solve(p))[: len(rows)]
        half, widened = float(np.median(np.abs(missed))) / NORMAL_QUARTILE, settings.widened_from
        fits, standings = [(model, settings.robust_steps)], []
        if half > widened:  # with a wider noise readings far off count at first
            wide = replace(model, noise=independent(half * self.sd[rows]))
            fits.insert(0, (wide, settings.widened_steps))
        for near, most in fits:
            better = fit(RobustModel(near), p, most_steps=most)
            if better is None:
                return None
            p = better.p
            standings += self.standings(predict, rows, [better.constants], better.solved.readings[None])
        return min(standings, key=attrgetter("total"))


@dataclass(frozen=True, eq=False)
class RobustModel:
    """A model whose readings follow a Cauchy distribution: their squared residuals are their robust misfits."""

    plain: Model
    """The same model with Gaussian readings."""

    @property
    def settings(self) -> Settings:
        return self.plain.settings

    def bounds(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the parameters, as in the plain model."""
        return self.plain.bounds(p)

    def solve(self, p: np.ndarray) -> Solution:
        """States and readings for the parameters `p` (p,), as in the plain model."""
        return self.plain.solve(p)

    def residuals(self, p: np.ndarray, solved: Solution) -> np.ndarray:
        """(r + p + k,) as in the plain model, but the square of the residual of a reading is its robust misfit."""
        out, count = self.plain.residuals(p, solved), len(solved.readings)
        out[:count] = np.sign(out[:count]) * np.sqrt(np.log1p(out[:count] ** 2))
        return out

    def jacobian(self, p: np.ndarray, solved: Solution) -> np.ndarray:
        """(r + p + k, p) derivatives of the residuals."""
        out, count = self.plain.jacobian(p, solved), len(solved.readings)
        plain = np.abs(self.plain.residuals(p, solved)[:count])
        out[:count] *= np.divide(
            plain, (1 + plain**2) * np.sqrt(np.log1p(plain**2)), out=np.ones(count), where=plain > 1e-8
        )[:, None]
        return out

    def fitted(self, p: np.ndarray, residual: np.ndarray, jacobian: np.ndarray, solved: Solution, done: bool) -> Fit:
        """The fit that ended at `p`; `done`: whether it has converged."""
        return self.plain.fitted(p, residual, jacobian, solved, done)


class Sight(NamedTuple):
    """What the camera reads of every disk at every step with each of the constants of a grid."""

    readings: np.ndarray
    """(c, s, n + 1, 4) by constants, step, disk and kind, m and rad."""
    columns: np.ndarray
    """(c, s, n + 1, 4, 3) derivatives with respect to rotation and shift in x and y of the camera frame."""


def sight(predict: Predictor, grid: Sequence[Constants], states: Sequence[Equilibria]) -> Sight:
    """What the camera reads of the `states` that belong to each of the constants of a grid."""
    here = states[0]
    step = np.broadcast_to(np.arange(len(here.x))[:, None], here.x.shape)
    readings = np.zeros((len(grid), *here.x.shape, len(Kind)))
    columns = np.zeros((*readings.shape, 3))
    for constants, state, reads, column in zip(grid, states, readings, columns, strict=True):
        seen = predict.seen(np.stack([state.x, state.y], -1), step, constants)
        reads[..., : Kind.ANGLE] = seen
        reads[..., Kind.ANGLE] = state.angle + predict.turned(step, constants)
        reads[..., Kind.BEND] = np.diff(state.angle, axis=1, prepend=state.angle[:, :1])
        column[..., Kind.X, 0], column[..., Kind.Y, 0] = -seen[..., 1], seen[..., 0]
        column[..., Kind.X, 1] = column[..., Kind.Y, 2] = column[..., Kind.ANGLE, 0] = 1.0
    return Sight(readings, np.nan_to_num(columns))


def trier(recording: Recording, settings: Settings) -> Trier:
    """The trier of a recording and its remedies, with the stated standard deviations of its readings."""
    return Trier(reading_sd(recording), settings)
