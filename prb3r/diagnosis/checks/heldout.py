"""Errors of two models on readings that no fit has seen: sequences set aside, or other recordings."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts, outlier_inflation
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.diagnosis.settings import Settings

MUCH_BETTER = 0.8
"""Share of the error with parts as drawn up to which that with parts as they were made is told beside it.  Choice."""


class NoiseUnits(NamedTuple):
    """Root mean square errors of all held-out readings together, each in units of the noise of its kind."""

    calibrated: float
    explained: float
    made: float
    """As `explained`, with the parts of the rig as the fitted sequences tell them where that is known."""


class ErrorPair(NamedTuple):
    """Errors of two models in a unit for readers."""

    calibrated: float
    explained: float
    unit: str
    """Such as `mm`."""


@dataclass(frozen=True)
class HeldOut:
    """Errors of two models on held-out readings: `calibrated`, with constants alone, and `explained`, with effects."""

    sequences: tuple[str, ...]
    """Names of the sequences that were set aside."""
    rmse_calibrated_m: float | None
    """Root mean square error of positions, gross outliers left out; None where no position was read."""
    rmse_explained_m: float | None
    noise_m: float | None
    """Root mean square error of positions that a perfect model would leave."""
    rmse_calibrated_rad: float | None
    """Root mean square error of angles and bends, as that of positions."""
    rmse_explained_rad: float | None
    noise_rad: float | None
    chi2_calibrated: float
    """Sum of squared whitened errors."""
    chi2_explained: float
    readings: int
    """Number of readings that both models predict; where a model has no equilibrium it predicts none."""
    lost: int = 0
    """Number of readings that one of the models does not predict."""
    rmse_made_m: float | None = None
    """As `rmse_explained_m`, with the parts of the rig as the fitted sequences tell them; None where that is not
    known."""
    rmse_made_rad: float | None = None
    """As `rmse_made_m`, of angles and bends."""
    positions: int = 0
    """Number of positions among the `readings`."""
    felt: bool = True
    """Whether the effects move these readings by anything that their noise would show (:func:`is_shown`); if not, they
    say nothing of the effects."""

    @property
    def in_noise(self) -> NoiseUnits | None:
        """Errors of positions and angles together, in units of their noise; None where nothing was read."""
        kinds = (
            (self.positions, self.rmse_calibrated_m, self.rmse_explained_m, self.rmse_made_m, self.noise_m),
            (
                self.readings - self.positions,
                self.rmse_calibrated_rad,
                self.rmse_explained_rad,
                self.rmse_made_rad,
                self.noise_rad,
            ),
        )
        counted = [
            (number, np.array([before, after, after if made is None else made]) / noise)
            for number, before, after, made, noise in kinds
            if number and before is not None and after is not None and noise
        ]
        if not counted:
            return None
        total = sum(number * errors**2 for number, errors in counted)
        return NoiseUnits(*np.sqrt(total / sum(number for number, _ in counted)).tolist())

    @property
    def better_as_made(self) -> bool:
        """Whether positions or angles are predicted much better (:data:`MUCH_BETTER`) with parts as they were made."""
        pairs = (self.rmse_made_m, self.rmse_explained_m), (self.rmse_made_rad, self.rmse_explained_rad)
        return any(made is not None and drawn is not None and made < MUCH_BETTER * drawn for made, drawn in pairs)

    def is_worse(self, times: float) -> bool:
        """Whether the error of positions, or of angles, with effects is more than so many `times` that of constants
        alone, and as many times the noise."""
        errors = (
            (self.rmse_calibrated_m, self.rmse_explained_m, self.noise_m),
            (self.rmse_calibrated_rad, self.rmse_explained_rad, self.noise_rad),
        )
        return any(
            before is not None and after is not None and noise is not None and after > times * max(before, noise)
            for before, after, noise in errors
        )

    @property
    def shown(self) -> ErrorPair | None:
        """The errors of both models, of positions or else of angles; None where neither was read."""
        of_positions, of_angles = (
            (self.rmse_calibrated_m, self.rmse_explained_m, 1e3, "mm"),
            (self.rmse_calibrated_rad, self.rmse_explained_rad, 180 / np.pi, "degrees"),
        )
        for before, after, factor, unit in (of_positions, of_angles):
            if before is not None and after is not None:
                return ErrorPair(factor * before, factor * after, unit)
        return None

    @property
    def gain(self) -> float:
        """Share of the excess of `chi2_calibrated` over its expectation (the number of readings) that the explanation
        removes: at most 1, negative if it makes errors larger, and 0 without an excess."""
        excess = self.chi2_calibrated - self.readings
        return float(min((self.chi2_calibrated - self.chi2_explained) / excess, 1.0)) if excess > 0 else 0.0


def noise_under(predict: Predictor, solved: Solution, settings: Settings) -> Noise:
    """Covariance of readings about a solution at the stated noise level, with gross outliers down-weighted."""
    return Doubts.as_stated(predict.recording, outlier_inflation(predict, solved.readings, settings)).noise(
        predict, solved, settings
    )


def is_shown(moved: np.ndarray, noise: Noise, settings: Settings) -> bool:
    """Whether a change of readings `moved` (r,), m and rad, is seen through their noise.

    It is if its squared size in units of the reading noise reaches `Settings.alike`, or if there is an equilibrium on
    one side of it alone (NaN).
    """
    size = float(np.sum((moved / noise.sd) ** 2))
    return not size < settings.alike


def compared(predict: Predictor, noise: Noise, calibrated: np.ndarray, explained: np.ndarray) -> HeldOut:
    """Errors of two predictions (r,) of the readings of `predict`, m and rad; NaN where there is no equilibrium."""
    recording = predict.recording
    known = np.isfinite(calibrated) & np.isfinite(explained)
    clean = noise.believed & known
    before, after = (np.where(known, predict.misfit(values), 0.0) for values in (calibrated, explained))
    position = recording.readings.is_position

    def rms(values: np.ndarray, chosen: np.ndarray) -> float | None:
        chosen = chosen & clean
        return float(np.sqrt(np.mean(values[chosen] ** 2))) if chosen.any() else None

    scatter = noise.total_sd
    return HeldOut(
        recording.sequences,
        rms(before, position),
        rms(after, position),
        rms(scatter, position),
        rms(before, ~position),
        rms(after, ~position),
        rms(scatter, ~position),
        float(np.sum(noise.whiten(before) ** 2)),
        float(np.sum(noise.whiten(after) ** 2)),
        int(known.sum()),
        int((~known).sum()),
        positions=int((known & position).sum()),
    )
