"""The methods compared: the diagnosis, simpler methods that it must beat, and the diagnosis without one of its steps.

Each turns a recording into a verdict and knows neither label nor rig.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from prb3r.diagnosis.chance import chi2_tail
from prb3r.diagnosis.checks.unseen import unseen
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.effects import NamedEffect
from prb3r.diagnosis.result.numbers import FittedModel
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.search.exchange import added
from prb3r.diagnosis.search.linear_selection import LinearModel
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import calibrate, doubt
from prb3r.proof.judging.forecast import forecasts
from prb3r.proof.judging.verdict import Claim, ExperimentClaim, Verdict
from prb3r.recording.recording import Recording
from prb3r.runs.backends.shield import reason_of


@dataclass(frozen=True)
class MethodTask:
    """A recording and the method that is to judge it."""

    case: int
    recording: Recording
    without: frozenset[str]
    """Kinds of effect taken out of the library of the diagnosis."""
    method: str
    """Name of the method, one of `METHODS`."""
    seed: int
    settings: Settings = Settings()
    """Settings of the diagnosis."""
    targets: tuple[Mapping[str, Any], ...] = ()
    """Loads and designs for which predictions are asked after the verdict, which does not depend on them."""


def verdict_of(task: MethodTask) -> Verdict:
    """The verdict of a task's method on its recording; `failed`, with the reason, if the method raises anything."""
    begin = time.process_time()
    try:
        verdict = METHODS[task.method](task)
    except Exception as error:
        verdict = Verdict(task.case, task.method, "failed", reason=reason_of(error))
    return replace(verdict, seconds=round(time.process_time() - begin - verdict.forecasting, 3))


def diagnosed(task: MethodTask, **ablation: Any) -> Verdict:
    """The verdict of the diagnosis, some of its settings (`ablation`) changed, and its predictions at the targets."""
    settings = replace(task.settings, **ablation) if ablation else task.settings
    diagnosis = run_stages(Task(task.recording, task.seed, task.without, settings=settings))
    begin = time.process_time()
    elsewhere = forecasts(diagnosis, task.targets) if task.targets else ()
    spent = time.process_time() - begin
    return replace(_verdict(task, diagnosis), elsewhere=elsewhere, forecasting=spent)


def without_covariance(task: MethodTask) -> Verdict:
    """The verdict of the diagnosis if the recording states that tensions do not scatter."""
    return diagnosed(replace(task, recording=_exact_tensions(task.recording)))


def calibration_alone(task: MethodTask) -> Verdict:
    """The verdict of refitting E, mu and the frame alone: always `adequate`, with no effect named."""
    single = _single(task, task.recording, names=lambda best, calibrated: False)
    return replace(single, verdict="adequate")


def lowest_error(task: MethodTask) -> Verdict:
    """The verdict that always names the one effect with which chi-square is lowest."""
    return _single(task, task.recording, names=lambda best, calibrated: True)


def plain_bic(task: MethodTask) -> Verdict:
    """The verdict that names the one effect with which chi-square is lowest if its BIC is below that of calibration,
    every reading counted and tensions taken as exact."""

    def names(best: Fit, calibrated: Fit) -> bool:
        """Whether the BIC with the effect is below that of calibration."""
        count = calibrated.recording.readings.count
        return _misfit(calibrated) - _misfit(best) > (len(best.p) - len(calibrated.p)) * np.log(count)

    return _single(task, _exact_tensions(task.recording), names)


METHODS: dict[str, Callable[[MethodTask], Verdict]] = {
    "diagnose": diagnosed,
    "E and mu alone": calibration_alone,
    "lowest error": lowest_error,
    "BIC, no covariance": plain_bic,
    "no tension covariance": without_covariance,
    "each candidate alone": partial(diagnosed, tested_alone=True),
    "every reading believed": partial(diagnosed, believe_all=True),
}


def _exact_tensions(recording: Recording) -> Recording:
    """The recording with the stated scatter of tensions set to zero."""
    measurement = recording.measurement.model_copy(update={"tension_sd_relative": 0.0})
    return replace(recording, measurement=measurement)


def _single(task: MethodTask, recording: Recording, names: Callable[[Fit, Fit], bool]) -> Verdict:
    """The verdict of calibration and fits of single effects, the one with the lowest chi-square of the readings named
    if `names` says so.

    Weights of readings are those of the diagnosis; its evidence, which rests on how likely effects and their sizes are,
    has no say.  Fitted are the effects that lower chi-square most in the linear model.  `names` gets the best fit and
    that of calibration.
    """
    asked = Task(recording, task.seed, task.without, settings=task.settings)
    begun = doubt(calibrate(asked), serially)
    calibrated = explained = begun.fitted
    single = added(calibrated, begun.search, _falls) if task.method != "E and mu alone" else []
    best = min(single, key=_misfit, default=None)
    claims: tuple[Claim, ...] = ()
    if best is not None and names(best, calibrated):
        explained = best
        claims = (_claim(best.model.hypotheses[0], best),)
    fresh = unseen(task.recording, begun.aside, asked.settings, begun.doubts)
    held = fresh.errors(calibrated, explained) if fresh else None
    return Verdict(
        task.case,
        task.method,
        "explained" if claims else "adequate",
        named=claims,
        reduced=(calibrated.reduced, explained.reduced),
        heldout=(held.chi2_calibrated, held.chi2_explained, held.readings) if held else None,
        calibrated=_constants(calibrated),
        explained=_constants(explained),
    )


def _falls(linear: LinearModel, _present: frozenset[int]) -> np.ndarray:
    """(columns,) by how much each column alone lowers chi-square in a linear model without effects; 0 where that takes
    the wrong sign."""
    falls = np.zeros(len(linear.columns))
    for k, column in enumerate(linear.columns):
        sizes = np.linalg.lstsq(column.moved, linear.target)[0]
        if not (column.sign and sizes[0] < 0):
            left = linear.target - column.moved @ sizes
            falls[k] = linear.target @ linear.target - left @ left
    return falls


def _misfit(fitted: Fit) -> float:
    """Chi-square of the readings alone, without that of priors."""
    residual = fitted.misfit
    return float(residual @ residual)


def _claim(hypothesis: Hypothesis, fitted: Fit) -> Claim:
    """The claim of the last effect of a fit, without intervals."""
    effect = fitted.effects[-1]
    values = {free.name: (float(getattr(effect, free.name)), None, None) for free in hypothesis.free}
    return Claim(hypothesis.kind, dict(hypothesis.place), values)


def _constants(fitted: Fit | FittedModel) -> tuple[float, float]:
    """ln of the fitted factors on E and mu."""
    return float(fitted.constants.log_stiffness), float(fitted.constants.log_friction)


def _verdict(task: MethodTask, diagnosis: Diagnosis) -> Verdict:
    """The verdict of a diagnosis, without predictions at targets."""
    held = diagnosis.heldout
    return Verdict(
        task.case,
        task.method,
        diagnosis.verdict,
        named=tuple(map(_named, diagnosis.effects)),
        reduced=(diagnosis.chi2.calibrated, diagnosis.chi2.explained),
        largest=(*diagnosis.score_calibrated, *diagnosis.score_explained),
        chi2=(diagnosis.chi2.total, diagnosis.chi2.threshold),
        heldout=(held.chi2_calibrated, held.chi2_explained, held.readings) if held else None,
        calibrated=_constants(diagnosis.calibrated),
        explained=_constants(diagnosis.explained),
        loading=None if task.targets else _loading(task.recording),
        models=tuple(model.effects for model in diagnosis.models),
        setup=tuple((blunder.blunder, *blunder.alike) for blunder in diagnosis.setup),
        noise=diagnosis.noise.scale,
        proposals=tuple(
            ExperimentClaim((pair.first, pair.second), float(pair.experiment.separation), _rows(pair.experiment.steps))
            for pair in diagnosis.experiments
        ),
        remarks=diagnosis.remarks,
    )


def _named(effect: NamedEffect) -> Claim:
    return Claim(
        effect.kind,
        effect.place,
        {name: (e.value, e.low, e.high) for name, e in effect.parameters.items()},
        effect.among,
        tuple((rival.kind, rival.place, rival.distance, rival.behind) for rival in effect.rivals),
        effect.partial,
    )


def kind_of(name: str) -> str:
    """The kind in the name of an effect, such as `worn_hole` of `worn_hole (disk 2)`."""
    return name.split(" (")[0]


def name_of(kind: str, place: Mapping[str, Any]) -> str:
    """The name of an effect at a place, such as `worn_hole (disk 2)`."""
    return Hypothesis(kind, tuple(place.items())).name


def _rows(steps: Any) -> tuple[Mapping[str, float], ...]:
    """The load columns of each row of a table of steps."""
    rows = steps.drop(columns=["sequence", "step"]).to_dict("records")
    return tuple({str(key): float(value) for key, value in row.items()} for row in rows)


def _loading(recording: Recording) -> tuple[float, float, float] | None:
    """Calibration on the loading-only sequences: ln of the factors on E and mu, and the p-value of chi-square.

    None with fewer than two sequences in which no tension falls, or if there are no others.
    """
    tension, of_sequence = recording.loads.tension, recording.of_sequence
    rising = [k for k in range(len(recording.sequences)) if (np.diff(tension[of_sequence == k], axis=0) >= 0).all()]
    if len(rising) < 2 or len(rising) == len(recording.sequences):
        return None
    predict = predictor(recording.only(rising))
    fitted = fit_constants(predict)
    return *_constants(fitted), float(chi2_tail(fitted.chi2, fitted.freedom))
