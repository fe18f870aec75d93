"""From a recording to a verdict in six stages, each a function from what is known to what is known then.

calibrate -> doubt -> test -> search -> check -> tell
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from prb3r.diagnosis.checks.doubt import renewed, without_outliers, without_wrong_weights
from prb3r.diagnosis.checks.heldout import HeldOut, Unseen, set_aside, unseen
from prb3r.diagnosis.checks.outliers import Doubts
from prb3r.diagnosis.checks.repeats import Scatter, scatter
from prb3r.diagnosis.evidence.constants_by_part import clues
from prb3r.diagnosis.evidence.detectable import detectable
from prb3r.diagnosis.evidence.model_evidence import chi2_threshold, cost
from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.fit.calibrate import calibrate as fit_constants
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.mismatch import mismatch
from prb3r.diagnosis.result.named import Named, named_effect
from prb3r.diagnosis.result.remarks import refusals, scattered, weighed, wrong_weights
from prb3r.diagnosis.search.empirical_law import Closure, close
from prb3r.diagnosis.search.experiment import Experiment, best_experiments
from prb3r.diagnosis.search.full_fits import Apply, serially
from prb3r.diagnosis.search.selection import Choice, Search, choose, examine
from prb3r.diagnosis.settings import Settings
from prb3r.errors import Problem, RecordingError
from prb3r.recording.recording import Recording

Report = Callable[[str], None]
"""Hears which stage is under way."""


@dataclass(frozen=True)
class Task:
    """What is asked: a recording, and how it is to be judged."""

    recording: Recording
    seed: int = 0
    """Of thresholds and of the choice of held-out sequences; the same seed, the same diagnosis."""
    without: frozenset[str] = frozenset()
    """Kinds of effects that are not considered."""
    hold_out: bool = True
    """Whether sequences are set aside; not where another recording is held out instead."""
    settings: Settings = Settings()


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A recording without the sequences that are set aside, and the constants that fit it."""

    task: Task
    recording: Recording
    """The whole, its noise as it was found."""
    aside: tuple[int, ...]
    repeated: Scatter | None
    fitted: Fit


@dataclass(frozen=True, eq=False)
class Doubted:
    """The constants under the readings and weights that are believed."""

    task: Task
    recording: Recording
    aside: tuple[int, ...]
    repeated: Scatter | None
    fitted: Fit
    doubts: Doubts
    search: Search
    """What may explain what is left."""


@dataclass(frozen=True, eq=False)
class Searched:
    """The effects that were chosen."""

    begun: Doubted
    before: Scores
    """Score test of what calibration leaves."""
    choice: Choice
    doubts: Doubts
    """As the explanation has them."""


@dataclass(frozen=True, eq=False)
class Checked:
    """The verdict, with all that it rests on."""

    searched: Searched
    choice: Choice
    """Without what the sequences set aside refute."""
    refuted: tuple[str, ...]
    fresh: Unseen | None
    heldout: HeldOut | None
    named: tuple[Named, ...]
    verdict: str
    why: str
    closure: Closure | None
    closure_gain: float | None
    experiments: tuple[tuple[str, str, Experiment], ...]


def diagnose(task: Task, report: Report = lambda stage: None, apply: Apply = serially) -> Diagnosis:
    """Diagnose a recording.

    Parameters
    ----------
    report : hears the name of every stage as it begins.
    apply : applies a function to many tasks, in worker processes for instance.

    Raises
    ------
    RecordingError
        If nothing near the nominal manipulator is in balance under the recorded loads.
    """
    report("calibrate")
    try:
        calibrated = calibrate(task)
        report("doubt")
        doubted = doubt(calibrated, apply)
    except ValueError as error:
        raise RecordingError(Problem(task.recording.name, str(error))) from None
    report("test")
    before = examine(doubted.fitted, doubted.search)
    report("search")
    searched = search(doubted, before)
    report("check")
    checked = check(searched)
    report("tell")
    return tell(checked)


def calibrate(task: Task) -> Calibrated:
    """Set sequences aside, hold the noise against what was pulled again, and fit the constants to the rest."""
    recording, settings = task.recording, task.settings
    aside = set_aside(recording.of_sequence, recording.loads, task.seed, settings) if task.hold_out else ()
    training = recording.only(set(range(len(recording.sequences))) - set(aside))
    repeated = scatter(training, settings)
    if repeated and repeated.beyond_chance:
        recording, training = (known.noisier(repeated.factor) for known in (recording, training))
    return Calibrated(task, recording, aside, repeated, fit_constants(predictor(training), settings=settings))


def doubt(calibrated: Calibrated, apply: Apply) -> Doubted:
    """Weigh gross outliers down and set wrong weights aside."""
    task = calibrated.task
    fitted, doubts = without_outliers(calibrated.fitted)
    predict = fitted.model.predict
    library = hypotheses(Scope.of(predict.recording, predict.chain, fitted.solved.states), task.without)
    searched = Search(tuple(library), task.seed, apply)
    fitted, doubts = without_wrong_weights(fitted, doubts, searched)
    return Doubted(task, calibrated.recording, calibrated.aside, calibrated.repeated, fitted, doubts, searched)


def search(begun: Doubted, before: Scores) -> Searched:
    """Choose effects, and renew covariance and outliers as the explanation has them."""
    choice, doubts = choose(begun.fitted, begun.search, before), begun.doubts
    if choice.fitted.model.hypotheses:
        explained = renewed(choice.fitted, doubts)
        left = examine(explained, begun.search)
        choice = replace(choice, fitted=explained, scores=left, chi2_threshold=chi2_threshold(explained))
    return Searched(begun, before, choice, doubts)


def check(searched: Searched) -> Checked:
    """Hold the choice against sequences that no fit has seen, and say how sure what is."""
    begun, choice = searched.begun, searched.choice
    calibrated, settings = begun.fitted, begun.task.settings
    fresh = unseen(begun.recording, begun.aside, settings)
    fresh = fresh.doubting(choice.fitted) if fresh else None
    heldout = fresh.judge(calibrated, choice.fitted) if fresh else None
    refuted: tuple[str, ...] = ()
    if fresh and heldout and heldout.chi2_explained > heldout.chi2_calibrated + settings.refuted_rise:
        refuted = tuple(hypothesis.name for hypothesis in choice.fitted.model.hypotheses)
        threshold = chi2_threshold(calibrated)
        choice = replace(choice, fitted=calibrated, scores=searched.before, chi2_threshold=threshold)
        heldout = fresh.judge(calibrated, calibrated)
    doubted = (*searched.doubts.weights, *(fresh.doubted if fresh else ()))
    why = unexplained(choice, [begun.recording.manipulator.cable_names[weight.cable] for weight in doubted])
    effects = range(len(choice.fitted.model.hypotheses))
    named = tuple(named_effect(choice, k, begun.search, fresh, partial=bool(why)) for k in effects)
    if why or not named:
        verdict = "unexplained" if why else "adequate"
    else:
        verdict = "ambiguous" if any(effect.rivals for effect in named) else "explained"
    law, gain = empirical_law(fresh, calibrated, choice.fitted, begun.task.seed) if why else (None, None)
    programs = experiments(choice, named) if verdict == "ambiguous" else ()
    return Checked(searched, choice, refuted, fresh, heldout, named, verdict, why, law, gain, programs)


def tell(checked: Checked) -> Diagnosis:
    """All that is to be said."""
    searched, fresh = checked.searched, checked.fresh
    begun, calibrated = searched.begun, searched.begun.fitted
    training = calibrated.model.predict.recording
    return Diagnosis(
        recording=begun.recording,
        seed=begun.task.seed,
        verdict=checked.verdict,
        why=checked.why,
        training=training,
        nominal_chi2=nominal_chi2(calibrated),
        calibrated=calibrated,
        explained=checked.choice.fitted,
        doubts=searched.doubts,
        choice=checked.choice,
        before=searched.before,
        named=checked.named,
        mismatch=mismatch(calibrated, checked.choice, searched.before, checked.named),
        closure=checked.closure,
        closure_gain=checked.closure_gain,
        heldout=checked.heldout,
        clues=tuple(clues(calibrated)),
        detectable=detectable(checked.choice.scores, begun.task.settings),
        experiments=checked.experiments,
        remarks=(
            *begun.recording.remarks,
            *scattered(begun.repeated),
            *wrong_weights(training, searched.doubts.weights),
            *(wrong_weights(fresh.predict.recording, fresh.doubted) if fresh else ()),
            *weighed(searched.doubts),
            *refusals(checked.refuted),
        ),
    )


def unexplained(choice: Choice, doubted: Sequence[str]) -> str:
    """Why the verdict is `unexplained`; empty if it is not.  `doubted`: the cable of every weight not believed."""
    effects = len(choice.fitted.model.hypotheses)
    if choice.structured:
        return "a real mismatch remains that no effect of the library accounts for"
    if effects >= choice.fitted.model.settings.most_effects:
        return f"it takes {effects} effects at once, which is less likely than one that is not in the library"
    again = sorted({name for name in doubted if doubted.count(name) > 1})
    if again:
        which = f"cable{'s' * (len(again) > 1)} {' and '.join(again)}"
        return f"weights on {which} do not go with the readings at several steps, which is more than a slip of a label"
    return ""


def nominal_chi2(calibrated: Fit) -> float | None:
    """Reduced chi-square of the nominal constants in the calibrated frame; None where these have no equilibrium."""
    model, constants = calibrated.model, calibrated.constants
    predicted = model.predict(constants._replace(log_stiffness=0.0, log_friction=0.0))
    if not np.isfinite(predicted).all():
        return None
    misfit = model.noise.whiten(model.predict.misfit(predicted))
    return float(misfit @ misfit / len(misfit))


def empirical_law(
    fresh: Unseen | None, calibrated: Fit, explained: Fit, seed: int
) -> tuple[Closure | None, float | None]:
    """The empirical law that describes the recording best, if better than what is named, and its gain on held-out
    sequences, which must not fall."""
    bases = [calibrated, explained] if explained.model.hypotheses else [calibrated]
    laws = [law for base in bases if (law := close(base, seed)) is not None and cost(law.fitted) < cost(explained)]
    if not laws:
        return None, None
    best = min(laws, key=lambda law: cost(law.fitted))
    heldout = fresh.judge(calibrated, best.fitted) if fresh else None
    if heldout is not None and heldout.chi2_explained > heldout.chi2_calibrated:
        return None, None
    return best, None if heldout is None else heldout.gain


def experiments(choice: Choice, named: Sequence[Named]) -> tuple[tuple[str, str, Experiment], ...]:
    """Of every named effect and its nearest rivals: both names, and the load program that separates them."""
    out: list[tuple[str, str, Experiment]] = []
    for effect in named:
        near = effect.rivals[: choice.fitted.model.settings.most_rivals]
        best = best_experiments(choice.fitted, [rival.fitted for rival in near]) if near else []
        pairs = zip(near, best, strict=True)
        out += [(effect.hypothesis.name, rival.hypothesis.name, program) for rival, program in pairs]
    return tuple(out)
