"""The sequences set aside: what a fit predicts for them, and whether it fails to."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.chance import chi2_critical, f_tail, normal_critical
from prb3r.diagnosis.checks.doubt import likeliest
from prb3r.diagnosis.checks.heldout import HeldOut, compared, is_shown
from prb3r.diagnosis.evidence.outliers import Doubts, NotedWeight, lone_inflation, outlier_inflation
from prb3r.diagnosis.evidence.rig_as_made import rig_as_made
from prb3r.diagnosis.fit.covariance import Noise, noise_of, reading_sd
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Predictor, Solution, predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.fit.tolerance import MARKER, tolerances, without_unit
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording

UNFELT_WEIGHT = 1e-9
"""Lower bound of the norm of the change by a weight, in units of the noise: prevents division by zero."""

ALL_MARKERS = "the places of the markers on their disks"
"""Name of the one part that all markers count as."""


class JudgedSequence(NamedTuple):
    """How well a model predicts a sequence that was set aside."""

    name: str
    p: float
    """The p-value of its error under the model; for several models see :meth:`Unseen.by_sequence_averaged`."""
    error_sd: float
    """Root mean square of the whitened error, in units of that of the fitted readings (:func:`usual_square`)."""
    lost: bool
    """Whether the model has no equilibrium at some of its steps."""


class HeldOutPrediction(NamedTuple):
    """The prediction of a fit for the sequences set aside, for the rig as it was made."""

    readings: np.ndarray
    """(r,) expected readings, m and rad, with the posterior means of the tolerances given the fitted sequences."""
    noise: Noise
    """Covariance of the readings about these: reading noise, tension scatter, uncertainty of parameters and parts."""
    part: str
    """The part whose deviation from its drawing moves the readings most, of what all parts together do, such as
    `segment.1.length_m`; the markers count as one. Empty if none has a tolerance."""


@dataclass(frozen=True, eq=False)
class Unseen:
    """The sequences of a recording that were set aside before anything was fitted.

    Predictions are in the camera frame of the fitted sequences.  :meth:`errors` are those of parts as drawn, which is
    how manipulator files describe them.  Chances (p-values) and scores are those of the rig as it was made, as far as
    the fitted sequences tell how its parts deviate from the drawing.
    """

    predict: Predictor
    """Of the sequences set aside."""
    settings: Settings
    doubts: Doubts
    """Readings and weights of the fitted sequences that are not believed, and the noise level estimated from these
    sequences."""
    doubted: tuple[NotedWeight, ...] = ()
    """Weights of the sequences set aside that are not believed."""
    predictions: dict[Fit, HeldOutPrediction] = field(default_factory=dict, repr=False)
    """Results of :meth:`prediction` by fit."""

    @property
    def recording(self) -> Recording:
        """The sequences set aside, as a recording."""
        return self.predict.recording

    def solved(self, fitted: Fit) -> Solution:
        """States and readings that `fitted` predicts for these sequences, parts as drawn."""
        return self.predict.solve(fitted.constants, fitted.effects)

    def noise(self, fitted: Fit) -> Noise:
        """Covariance of the readings about the prediction of `fitted` for parts as drawn.

        It holds reading noise, tension scatter, the uncertainty of the fitted parameters, and the stated tolerances.
        """
        solved = self.solved(fitted)
        uncertain = replace(fitted.model, predict=self.predict).moved(fitted.p, solved) @ root_of(fitted.covariance)
        parts = tolerances(self.predict, solved).moved
        return self._covariance(solved, solved.readings, np.hstack([parts, uncertain]))

    def prediction(self, fitted: Fit) -> HeldOutPrediction:
        """The prediction of `fitted` for these sequences, parts as the fitted sequences tell them; cached by fit."""
        if fitted not in self.predictions:
            solved = self.solved(fitted)
            parts = tolerances(self.predict, solved)
            felt = np.flatnonzero(parts.sd > 0)
            mean, covariance = rig_as_made(fitted, self.doubts).among([parts.names[k] for k in felt])
            moved = replace(fitted.model, predict=self.predict).moved(fitted.p, solved)
            uncertain = np.hstack([moved, parts.moved[:, felt]]) @ root_of(covariance)
            expected = solved.readings + parts.moved[:, felt] @ mean
            noise = self._covariance(solved, expected, uncertain)
            far = np.nan_to_num(parts.moved[:, felt] * mean / noise.sd[:, None])
            part = part_that_does_most([parts.names[k] for k in felt], far)
            self.predictions[fitted] = HeldOutPrediction(expected, noise, part)
        return self.predictions[fitted]

    def _covariance(self, solved: Solution, expected: np.ndarray, uncertain: np.ndarray) -> Noise:
        """Covariance of the readings about the `expected` ones (r,).

        Single readings that are missed grossly are down-weighted, as among the fitted ones.

        Parameters
        ----------
        uncertain : (r, k) changes of the readings by one standard deviation of everything but noise and tensions.
        """
        recording, sensitivity = self.recording, tension_response(self.predict, solved)

        def under(inflation: np.ndarray) -> Noise:
            doubts = Doubts(inflation, self.doubted, self.doubts.level)
            inflated = doubts.inflated(recording, self.settings)
            return noise_of(recording, sensitivity, inflated, doubts.level, uncertain)

        inflation = outlier_inflation(self.predict, expected, self.settings, self.doubts.level.scale)
        noise = under(inflation)
        white = noise.whiten(np.nan_to_num(self.predict.misfit(expected)))
        lone = lone_inflation(recording, white, noise, inflation, self.settings)
        return noise if np.array_equal(lone > 1, inflation > 1) else under(lone)

    def errors(self, calibrated: Fit, explained: Fit) -> HeldOut:
        """Errors of two models on these sequences, whitened by the covariance about the `explained` one."""
        before, after = self.solved(calibrated), self.solved(explained)
        return compared(self.predict, self.noise(explained), before.readings, after.readings)

    def feels(self, fitted: Fit) -> bool:
        """Whether the effects of `fitted`, all together, move the readings of these sequences by anything that their
        noise would show."""
        moved = self.solved(fitted).readings - self.predict(fitted.constants, ())
        return is_shown(moved, self.noise(fitted), self.settings)

    def as_drawn_and_made(self, drawn: Fit, fitted: Fit) -> HeldOut:
        """Errors of the fit `drawn` with parts as drawn, in the fields of `calibrated`, and of `fitted` with parts as
        the fitted sequences tell them, in those of `explained`."""
        made = self.prediction(fitted)
        return compared(self.predict, made.noise, self.solved(drawn).readings, made.readings)

    def log_score(self, fitted: Fit) -> float | None:
        """Mean log predictive density per reading, in nats; None if a step has no equilibrium.

        It is relative to the density of readings that meet their prediction exactly, under the stated noise alone.
        """
        readings, noise, _ = self.prediction(fitted)
        misfit = self.predict.misfit(readings)
        if not np.isfinite(misfit).all():
            return None
        exact = -float(np.log(reading_sd(self.recording)).sum())
        return (noise.log_density(misfit) - exact) / len(misfit)

    def by_sequence(self, fitted: Fit) -> tuple[JudgedSequence, ...]:
        """Every sequence set aside, in the order of the recording, with the p-value of its error under `fitted`.

        The p-value is 0 where a step has no equilibrium.
        """
        recording, (readings, noise, _) = self.recording, self.prediction(fitted)
        white = noise.whiten(np.nan_to_num(self.predict.misfit(readings)))
        of_reading, judged = recording.of_sequence[recording.readings.step], []
        known, farthest = fitted.misfit, self.settings.farthest_sd
        usual = usual_square(known, fitted.freedom, farthest)
        for k, name in enumerate(recording.sequences):
            of_sequence = of_reading == k
            lost = not np.isfinite(readings[of_sequence]).all()
            p = 0.0 if lost else chance_of_size(white[of_sequence], known, fitted.freedom, farthest)
            judged.append(JudgedSequence(name, p, float(np.sqrt(np.mean(white[of_sequence] ** 2) / usual)), lost))
        return tuple(judged)

    def missed_steps(self, fitted: Fit) -> list[int]:
        """Rows of the steps whose readings `fitted` misses significantly: at the level `Settings.naming_rate`, divided
        among all steps with readings."""
        readings, noise, _ = self.prediction(fitted)
        step, misfit = self.recording.readings.step, self.predict.misfit(readings)
        squares, counts = np.bincount(step, noise.whiten(np.nan_to_num(misfit)) ** 2), np.bincount(step)
        return [
            k
            for k in np.flatnonzero(counts).tolist()
            if squares[k] > chi2_critical(self.settings.naming_rate / counts.astype(bool).sum(), int(counts[k]))
        ]

    @property
    def rate(self) -> float:
        """Significance level at which a sequence counts as not predicted: `Settings.naming_rate` divided among all."""
        return self.settings.naming_rate / len(self.recording.sequences)

    def refutes(self, fitted: Fit) -> bool:
        """Whether `fitted` fails to predict at least one sequence."""
        return any(sequence.p < self.rate for sequence in self.by_sequence(fitted))

    def by_sequence_averaged(self, fitted: Fit, others: Sequence[tuple[float, Fit]]) -> tuple[JudgedSequence, ...]:
        """As :meth:`by_sequence`; if `fitted` fails to predict a sequence, p-values are averaged over surviving models.

        Each sequence then has the mean p-value, weighted by the models' probabilities, if that is larger.

        Parameters
        ----------
        others : probability and fit of every surviving model, `fitted` among them.
        """
        first = self.by_sequence(fitted)
        if not self.refutes(fitted):
            return first
        shares = np.array([share for share, _ in others])
        p = shares / shares.sum() @ [[sequence.p for sequence in self.by_sequence(other)] for _, other in others]
        return tuple(sequence._replace(p=max(sequence.p, float(mean))) for sequence, mean in zip(first, p, strict=True))

    def doubting(self, fitted: Fit, others: Sequence[Fit] = ()) -> "Unseen":
        """These sequences with one more weight that is not believed, or the object itself if no weight is doubted.

        A weight is doubted if its score is significant and `fitted` predicts all readings with another value in its
        place, unless one of the `others` predicts them with the value that was noted.
        """
        without = self._doubting(fitted)
        if without is not self and any(self._doubting(other) is self and not self.refutes(other) for other in others):
            return self
        return without

    def _doubting(self, fitted: Fit) -> "Unseen":
        """As :meth:`doubting`, for `fitted` alone."""
        recording, solved = self.recording, self.solved(fitted)
        readings, noise, _ = self.prediction(fitted)
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
        return replace(self, doubted=(*self.doubted, other.weight), predictions={})


def unseen(recording: Recording, aside: Sequence[int], settings: Settings, doubts: Doubts) -> Unseen | None:
    """The sequences numbered `aside`, as they were set aside; None if there are none.

    `doubts` are those of the fitted sequences.
    """
    return Unseen(predictor(recording.only(aside), settings), settings, doubts) if aside else None


def chance_of_size(white: np.ndarray, known: np.ndarray, freedom: int, farthest: float) -> float:
    """The p-value of whitened errors `white` (k,) if they scatter like those of the fitted readings, `known` (r,).

    The noise level is known from the fitted readings alone, so that the ratio of the two mean squares follows Fisher's
    F.  Where squared errors scatter more than those of a Gaussian, whose relative variance is 2, the degrees of freedom
    of both are divided by that excess (Box, Biometrika 40 (1953) 318).

    Parameters
    ----------
    freedom : degrees of freedom of the fit.
    farthest : size, in standard deviations, to which larger errors are cut off.
    """
    squares, others = (np.minimum(errors**2, farthest**2) for errors in (white, known))
    scatter = max(float(others.var() / others.mean() ** 2) / 2, 1.0)
    ratio = squares.mean() / usual_square(known, freedom, farthest)
    return float(f_tail(ratio, len(squares) / scatter, max(freedom, 1) / scatter))


def usual_square(known: np.ndarray, freedom: int, farthest: float) -> float:
    """The mean squared whitened error of the fitted readings `known` (r,), each cut off at `farthest`, by degrees of
    freedom: at most 1, and less where some are cut off or where a noise is taken that is too large."""
    return min(float(np.minimum(known**2, farthest**2).sum()) / max(freedom, 1), 1.0)


def root_of(covariance: np.ndarray) -> np.ndarray:
    """(k, k) matrix `A` with ``A A^T`` equal to a covariance (k, k); each column is one standard deviation."""
    variance, axes = np.linalg.eigh(covariance)
    return axes * np.sqrt(np.maximum(variance, 0.0))


def part_that_does_most(names: Sequence[str], moved: np.ndarray) -> str:
    """The part that contributes most to what all together do to the readings; empty if there is none.

    Parameters
    ----------
    names : (k,) tolerances; those of the markers count as one part.
    moved : (r, k) changes of the readings by each, in standard deviations of their noise.
    """
    share, together = dict[str, float](), moved.sum(1)
    for name, change in zip(names, moved.T, strict=True):
        part = ALL_MARKERS if name.startswith(MARKER) else without_unit(name)
        share[part] = share.get(part, 0.0) + float(change @ together)
    return max(share, key=share.__getitem__, default="")
