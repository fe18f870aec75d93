"""Before and after on sequences, or recordings, that no fit has seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.mechanics.chain import Loads
from prb3r.model.effect import Base
from prb3r.recording.calibrate import Fit
from prb3r.recording.covariance import Noise, noise_of, tension_sensitivity
from prb3r.recording.outliers import distrust_of
from prb3r.recording.predict import Constants, Predictor

HARD = 0.8
"""Share of a cable's highest tension from which on it is pulled hard."""


@dataclass(frozen=True)
class HeldOut:
    """Errors of models on readings that were set aside."""

    sequences: tuple[str, ...]
    rmse_calibrated_m: float | None
    """Root mean square error of positions, gross outliers left out; None where no position was read."""
    rmse_explained_m: float | None
    noise_m: float | None
    """What a perfect model would leave."""
    rmse_calibrated_rad: float | None
    """Of angles and bends."""
    rmse_explained_rad: float | None
    noise_rad: float | None
    chi2_calibrated: float
    """Squared whitened error."""
    chi2_explained: float
    readings: int
    """How many could be compared: where a model has no equilibrium there is no prediction."""

    @property
    def gain(self) -> float:
        """Share of the excess squared error that the explanation removes; at most 1, 0 where there is no excess."""
        excess = self.chi2_calibrated - self.readings
        return float(min((self.chi2_calibrated - self.chi2_explained) / excess, 1.0)) if excess > 0 else 0.0


def set_aside(of_sequence: np.ndarray, loads: Loads, seed: int) -> tuple[int, ...]:
    """A quarter of the sequences, at least one where there are three or more, so that nothing goes unseen.

    What the others must show at least once, and twice if they can: every cable pulled in, let out and pulled hard, and
    every pair of cables pulled together.
    """
    count = int(of_sequence.max()) + 1
    if count < 3:
        return ()
    pulled = loads.tension > 0
    hard = pulled & (loads.tension >= HARD * loads.tension.max(0))
    way = np.concatenate([pulled & (loads.slip < 0), pulled & (loads.slip > 0), hard], 1)
    pairs = (pulled[:, :, None] & pulled[:, None, :]).reshape(len(pulled), -1)
    used = np.stack([np.concatenate([way, pairs], 1)[of_sequence == k].any(0) for k in range(count)])
    order, most = np.random.default_rng(seed).permutation(count), max(count // 4, 1)
    for least in (2, 1, 0):
        chosen: list[int] = []
        for k in order:
            rest = np.delete(used, [*chosen, k], axis=0)
            if len(chosen) < most and (rest.sum(0) >= np.minimum(used.sum(0), least)).all():
                chosen.append(int(k))
        if chosen:
            break
    return tuple(sorted(chosen))


def noise_on(predict: Predictor, fitted: Fit) -> Noise:
    """Covariance of other readings of the same manipulator, gross outliers weighed down."""
    return noise_under(predict, fitted.constants, fitted.effects)


def noise_under(predict: Predictor, constants: Constants, effects: Sequence[Base]) -> Noise:
    """Covariance of the readings that `predict` predicts, gross outliers weighed down."""
    sensitivity = tension_sensitivity(predict, constants, effects)
    doubt = distrust_of(predict, predict(constants, effects))
    return noise_of(predict.recording, sensitivity, doubt)


def judge(predict: Predictor, noise: Noise, calibrated: np.ndarray, explained: np.ndarray) -> HeldOut:
    """Compare two predictions (r,) of readings that were set aside."""
    recording = predict.recording
    known = np.isfinite(calibrated) & np.isfinite(explained)
    clean = noise.believed & known
    before, after = (np.where(known, predict.misfit(each), 0.0) for each in (calibrated, explained))
    position = recording.readings.kind <= 1

    def rms(values: np.ndarray, own: np.ndarray) -> float | None:
        own = own & clean
        return float(np.sqrt(np.mean(values[own] ** 2))) if own.any() else None

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
    )


def predictions(predict: Predictor, fits: Sequence[Fit]) -> list[np.ndarray]:
    """(r,) what each fitted model predicts for other readings of the same manipulator in the same frame."""
    return [predict(each.constants, each.effects) for each in fits]
