"""Before and after on sequences, or recordings, that no fit has seen."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2 as chi2_law
from scipy.stats import norm as normal

from prb3r.diagnosis.checks.doubt import likeliest
from prb3r.diagnosis.checks.outliers import Trust, Weight, distrust_of
from prb3r.diagnosis.evidence.score_test import LEVEL, NAMING_LEVEL
from prb3r.diagnosis.fit.calibrate import Fit
from prb3r.diagnosis.fit.covariance import Noise, tension_sensitivity
from prb3r.diagnosis.fit.prediction import Constants, Predictor, predictor
from prb3r.mechanics.chain import Loads
from prb3r.model.effects.base import Effect
from prb3r.recording.recording import Recording

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


@dataclass(frozen=True, eq=False)
class Unseen:
    """Sequences of a manipulator that no fit has seen, in the frame of those that were fitted."""

    predict: Predictor
    doubted: tuple[Weight, ...] = ()
    """Weights that are not believed."""

    def noise(self, fitted: Fit) -> Noise:
        """Covariance of the readings that `fitted` predicts."""
        return noise_under(self.predict, fitted.constants, fitted.effects, self.doubted)

    def misfit(self, fitted: Fit) -> np.ndarray:
        """(r,) readings less those that `fitted` predicts."""
        return self.predict.misfit(self.predict(fitted.constants, fitted.effects))

    def judge(self, calibrated: Fit, explained: Fit) -> HeldOut:
        """Compare two models."""
        found = (self.predict(each.constants, each.effects) for each in (calibrated, explained))
        return judge(self.predict, self.noise(explained), *found)

    def doubting(self, fitted: Fit) -> "Unseen":
        """The same without belief in the weight that is wrong beyond chance, if all else is as `fitted` predicts."""
        noise, misfit, recording = self.noise(fitted), self.misfit(fitted), self.predict.recording
        steps, cables = np.nonzero(recording.loads.tension > 0)
        if not np.isfinite(misfit).all() or not len(steps):
            return self
        moved = tension_sensitivity(self.predict, fitted.constants, fitted.effects)[:, steps, cables]
        white = noise.whiten(moved)
        z = np.abs(white.T @ noise.whiten(misfit)) / np.maximum(np.linalg.norm(white, axis=0), 1e-9)
        worst = int(np.argmax(z))
        if z[worst] <= normal.isf(LEVEL / 2 / len(z)):
            return self
        weight = likeliest(self.predict, noise, fitted, int(steps[worst]))
        doubting = replace(self, doubted=(*self.doubted, weight))
        rest = doubting.noise(fitted).whiten(misfit)
        others = int((recording.readings.step != weight.step).sum())
        return doubting if rest @ rest <= chi2_law.isf(NAMING_LEVEL, others) else self


def unseen(recording: Recording, aside: Sequence[int]) -> Unseen | None:
    """The sequences that were set aside, if any were."""
    return Unseen(predictor(recording.only(aside))) if aside else None


def noise_under(
    predict: Predictor, constants: Constants, effects: Sequence[Effect], doubted: tuple[Weight, ...] = ()
) -> Noise:
    """Covariance of the readings that `predict` predicts, without belief in gross outliers and `doubted` weights."""
    trust = Trust(distrust_of(predict, predict(constants, effects)), doubted)
    return trust.noise(predict.recording, tension_sensitivity(predict, constants, effects))


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
