"""Judgement on held-out data: how well models predict sequences, or recordings, that no fit has seen."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.chance import chi2_critical, f_tail, normal_critical
from prb3r.diagnosis.checks.doubt import likeliest
from prb3r.diagnosis.evidence.outliers import Doubts, NotedWeight, lone_inflation, outlier_inflation
from prb3r.diagnosis.evidence.rig_as_made import rig_as_made
from prb3r.diagnosis.fit.covariance import Noise, noise_of, reading_sd
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Predictor, Solution, predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.fit.tolerance import tolerances
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording

UNFELT_WEIGHT = 1e-9
"""Size, in units of the noise, that the change by a weight counts as having at least: against division by zero."""


@dataclass(frozen=True)
class HeldOut:
    """Errors of two models on readings that were set aside: `calibrated`, the constants alone, and `explained`, with
    effects."""

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
    """Number of the other readings."""

    @property
    def gain(self) -> float:
        """Share of the excess of `chi2_calibrated` over its expectation, the number of readings, that the explanation
        removes: at most 1, negative where it makes errors larger, 0 where there is no excess."""
        excess = self.chi2_calibrated - self.readings
        return float(min((self.chi2_calibrated - self.chi2_explained) / excess, 1.0)) if excess > 0 else 0.0


class JudgedSequence(NamedTuple):
    """How well a model predicts a sequence that no fit has seen."""

    name: str
    p: float
    """Chance of an error this large if the model is right (see :meth:`Unseen.judged_by` for several models)."""
    error_sd: float
    """Root mean square of the whitened error."""
    lost: bool
    """Whether the model has no equilibrium at some of its steps."""


class Foreseen(NamedTuple):
    """What a fit predicts for the sequences set aside, on the rig as it was made."""

    readings: np.ndarray
    """(r,) expected readings, with the tolerances of the parts as the fitted sequences tell them, m and rad."""
    noise: Noise
    """Covariance of the readings about these: reading noise, tension scatter, uncertainty of parameters and parts."""
    part: str
    """The part off its drawing that moves the readings most, such as `segment.1.length_m`; empty without any."""


@dataclass(frozen=True, eq=False)
class Unseen:
    """The sequences of a recording that no fit has seen, in the camera frame of those that were fitted.

    Errors (`judge`) are those of the manipulator files, whose parts are as drawn.  Chances and scores are those of the
    rig as it was made, as far as the fitted sequences tell how its parts came out.
    """

    predict: Predictor
    """Of the sequences set aside."""
    settings: Settings
    known: Doubts
    """What of the fitted sequences is not believed, and the level of the noise as they tell it."""
    doubted: tuple[NotedWeight, ...] = ()
    """Weights of the sequences set aside that are not believed."""
    foreseen: dict[Fit, Foreseen] = field(default_factory=dict, repr=False)
    """Results of :meth:`foresee` by fit."""

    @property
    def recording(self) -> Recording:
        """The sequences set aside, as a recording."""
        return self.predict.recording

    def solved(self, fitted: Fit) -> Solution:
        """States (s, n) and readings (r,) that `fitted` predicts for the sequences set aside."""
        return self.predict.solve(fitted.constants, fitted.effects)

    def noise(self, fitted: Fit) -> Noise:
        """Covariance of the readings about the prediction of `fitted`, parts as drawn: reading noise, tension scatter,
        uncertainty of the fitted parameters, and tolerances of their stated size."""
        solved = self.solved(fitted)
        uncertain = replace(fitted.model, predict=self.predict).moved(fitted.p, solved) @ root_of(fitted.covariance)
        parts = tolerances(self.predict, solved).moved
        return self._covariance(solved, solved.readings, np.hstack([parts, uncertain]))

    def foresee(self, fitted: Fit) -> Foreseen:
        """The prediction of `fitted` for these sequences, with the parts of the rig as the fitted ones tell them."""
        if fitted not in self.foreseen:
            solved = self.solved(fitted)
            parts = tolerances(self.predict, solved)
            felt = np.flatnonzero(parts.sd > 0)
            mean, covariance = rig_as_made(fitted, self.known).among([parts.names[k] for k in felt])
            moved = replace(fitted.model, predict=self.predict).moved(fitted.p, solved)
            uncertain = np.hstack([moved, parts.moved[:, felt]]) @ root_of(covariance)
            expected = solved.readings + parts.moved[:, felt] @ mean
            noise = self._covariance(solved, expected, uncertain)
            far = np.linalg.norm(np.nan_to_num(parts.moved[:, felt] * mean / noise.sd[:, None]), axis=0)
            part = parts.names[felt[int(np.argmax(far))]] if len(far) else ""
            self.foreseen[fitted] = Foreseen(expected, noise, part)
        return self.foreseen[fitted]

    def _covariance(self, solved: Solution, expected: np.ndarray, uncertain: np.ndarray) -> Noise:
        """Covariance of the readings about what is `expected` (r,); those missed grossly and alone are weighed down, as
        among the fitted ones.

        Parameters
        ----------
        uncertain : (r, k) changes by one standard deviation of all else that is uncertain.
        """
        recording, sensitivity = self.recording, tension_response(self.predict, solved)

        def under(inflation: np.ndarray) -> Noise:
            doubts = Doubts(inflation, self.doubted, self.known.level)
            inflated = doubts.inflated(recording, self.settings)
            return noise_of(recording, sensitivity, inflated, doubts.level, uncertain)

        inflation = outlier_inflation(self.predict, expected, self.settings, self.known.level.scale)
        noise = under(inflation)
        white = noise.whiten(np.nan_to_num(self.predict.misfit(expected)))
        lone = lone_inflation(recording, white, noise, inflation, self.settings)
        return noise if np.array_equal(lone > 1, inflation > 1) else under(lone)

    def judge(self, calibrated: Fit, explained: Fit) -> HeldOut:
        """Errors of two models on these sequences, whitened by the covariance about the `explained` one."""
        before, after = self.solved(calibrated), self.solved(explained)
        return compared(self.predict, self.noise(explained), before.readings, after.readings)

    def as_drawn_and_made(self, fitted: Fit) -> HeldOut:
        """Errors of `fitted` with the parts of the rig as drawn (those of `calibrated`) and as the fitted sequences
        tell them (those of `explained`)."""
        made = self.foresee(fitted)
        return compared(self.predict, made.noise, self.solved(fitted).readings, made.readings)

    def log_score(self, fitted: Fit) -> float | None:
        """ln density of the readings as `fitted` predicts them, a reading, beside that of readings which hit exactly
        with the stated noise alone; None where a step has no equilibrium."""
        readings, noise, _ = self.foresee(fitted)
        misfit = self.predict.misfit(readings)
        if not np.isfinite(misfit).all():
            return None
        exact = -float(np.log(reading_sd(self.recording)).sum())
        return (noise.log_density(misfit) - exact) / len(misfit)

    def judged(self, fitted: Fit) -> tuple[JudgedSequence, ...]:
        """Every sequence set aside, in the order of the recording, with the chance of an error this large if `fitted`
        is right; the chance is 0 where a step has no equilibrium."""
        recording, (readings, noise, _) = self.recording, self.foresee(fitted)
        white = noise.whiten(np.nan_to_num(self.predict.misfit(readings)))
        of_reading, judged = recording.of_sequence[recording.readings.step], []
        known = fitted.misfit
        for k, name in enumerate(recording.sequences):
            of_sequence = of_reading == k
            lost = not np.isfinite(readings[of_sequence]).all()
            farthest = self.settings.farthest_sd
            p = 0.0 if lost else chance_of_size(white[of_sequence], known, fitted.freedom, farthest)
            judged.append(JudgedSequence(name, p, float(np.sqrt(np.mean(white[of_sequence] ** 2))), lost))
        return tuple(judged)

    def missed_steps(self, fitted: Fit) -> list[int]:
        """Rows of the steps whose readings `fitted` misses by more than chance allows, of all steps at once."""
        readings, noise, _ = self.foresee(fitted)
        step, misfit = self.recording.readings.step, self.predict.misfit(readings)
        squares, counts = np.bincount(step, noise.whiten(np.nan_to_num(misfit)) ** 2), np.bincount(step)
        return [
            k
            for k in np.flatnonzero(counts).tolist()
            if squares[k] > chi2_critical(self.settings.naming_rate / counts.astype(bool).sum(), int(counts[k]))
        ]

    @property
    def rate(self) -> float:
        """Chance below which a sequence counts as not predicted: `Settings.naming_rate` divided among the sequences."""
        return self.settings.naming_rate / len(self.recording.sequences)

    def refutes(self, fitted: Fit) -> bool:
        """Whether `fitted` fails to predict any sequence."""
        return any(sequence.p < self.rate for sequence in self.judged(fitted))

    def judged_by(self, fitted: Fit, others: Sequence[tuple[float, Fit]]) -> tuple[JudgedSequence, ...]:
        """Every sequence as `fitted` predicts it; where it fails to predict any, each with the mean chance of all
        surviving models if that is larger.

        Parameters
        ----------
        others : probability and fit of every surviving model, `fitted` among them.
        """
        first = self.judged(fitted)
        if not self.refutes(fitted):
            return first
        shares = np.array([share for share, _ in others])
        p = shares / shares.sum() @ [[sequence.p for sequence in self.judged(other)] for _, other in others]
        return tuple(sequence._replace(p=max(sequence.p, float(mean))) for sequence, mean in zip(first, p, strict=True))

    def doubting(self, fitted: Fit, others: Sequence[Fit] = ()) -> "Unseen":
        """These sequences without the weight that seems wrong beyond chance, if `fitted` predicts all readings with
        another in its place; unchanged if there is none, or if one of the `others` predicts all as it was noted."""
        without = self._doubting(fitted)
        if without is not self and any(self._doubting(other) is self and not self.refutes(other) for other in others):
            return self
        return without

    def _doubting(self, fitted: Fit) -> "Unseen":
        """As :meth:`doubting`, for `fitted` alone; the object itself where no weight is doubted."""
        recording, solved = self.recording, self.solved(fitted)
        readings, noise, _ = self.foresee(fitted)
        misfit = self.predict.misfit(readings)
        steps, cables = np.nonzero(recording.loads.tension > 0)
        if not np.isfinite(misfit).all() or not len(steps):
            return self
        response = tension_response(self.predict, solved)
        white = noise.whiten(response[:, steps, cables])
        size = np.maximum(np.linalg.norm(white, axis=0), UNFELT_WEIGHT)
        z = np.abs(white.T @ noise.whiten(misfit)) / size
        worst = int(np.argmax(z))
        if z[worst] <= normal_critical(self.settings.naming_rate / 2 / len(z)):
            return self
        other = likeliest(self.predict, noise, solved, int(steps[worst]), self.settings)
        left = noise.whiten(self.predict.misfit(readings + other.readings - solved.readings))
        along = noise.whiten(response[:, other.weight.step, other.weight.cable])  # to the best between tried values
        left = left - along * (along @ left) / max(float(along @ along), UNFELT_WEIGHT)
        if not left @ left <= chi2_critical(self.settings.naming_rate, len(left)):
            return self
        return replace(self, doubted=(*self.doubted, other.weight), foreseen={})


def chance_of_size(white: np.ndarray, known: np.ndarray, freedom: int, farthest: float) -> float:
    """Chance of whitened errors as large as `white` (k,) if they scatter like those of fitted readings, `known` (r,).

    The noise level is known from the fitted readings alone, so that the ratio of the two mean squares follows Fisher's
    F.  Where squared errors scatter more than those of a Gaussian, whose relative variance is 2, the degrees of freedom
    of both are divided by that excess (Box, Biometrika 40 (1953) 318).

    Parameters
    ----------
    freedom : degrees of freedom of the fit.
    farthest : largest size as which an error counts, in standard deviations.
    """
    squares, usual = (np.minimum(errors**2, farthest**2) for errors in (white, known))
    scatter = max(float(usual.var() / usual.mean() ** 2) / 2, 1.0)
    told = max(freedom, 1)
    mean = min(float(usual.sum()) / told, 1.0)  # less than 1 where the farthest are cut off
    return float(f_tail(squares.mean() / mean, len(squares) / scatter, told / scatter))


def root_of(covariance: np.ndarray) -> np.ndarray:
    """(k, k) root of a covariance: columns `a` with `a a^T` the covariance, each one standard deviation."""
    variance, axes = np.linalg.eigh(covariance)
    return axes * np.sqrt(np.maximum(variance, 0.0))


def unseen(recording: Recording, aside: Sequence[int], settings: Settings, known: Doubts) -> Unseen | None:
    """The sequences that were set aside, with what is `known` of the noise of the others; None without any."""
    return Unseen(predictor(recording.only(aside), settings), settings, known) if aside else None


def noise_under(
    predict: Predictor, solved: Solution, settings: Settings, doubted: tuple[NotedWeight, ...] = ()
) -> Noise:
    """Covariance of readings about a solution at the stated noise level, without belief in gross outliers and `doubted`
    weights."""
    doubts = Doubts(outlier_inflation(predict, solved.readings, settings), doubted)
    return doubts.noise(predict, solved, settings)


def compared(predict: Predictor, noise: Noise, calibrated: np.ndarray, explained: np.ndarray) -> HeldOut:
    """Errors of two predictions (r,) of readings that were set aside, m and rad; NaN where there is no equilibrium."""
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
    )
