"""From a recording to a verdict: locate the mismatch, name the physics that was left out, and say how sure that is."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from prb3r.diagnosis.checks.doubt import renewed, start
from prb3r.diagnosis.checks.heldout import Unseen, set_aside, unseen
from prb3r.diagnosis.checks.repeats import scatter
from prb3r.diagnosis.fit.calibrate import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.result.diagnosis import Diagnosis, Separation
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.named import Named, named_effect
from prb3r.diagnosis.result.remarks import refusals, scattered, weighed, wrong_weights
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search.empirical_law import Closure, close
from prb3r.diagnosis.search.experiment import best_experiments
from prb3r.diagnosis.search.selection import (
    MOST_EFFECTS,
    Choice,
    Each,
    chi2_threshold,
    choose,
    cost,
    examine,
    serially,
)
from prb3r.errors import Problem, RecordingError
from prb3r.recording.recording import Recording

VERDICTS = ("adequate", "explained", "ambiguous", "unexplained")
MOST_RIVALS = 4
"""Rivals of an effect that experiments are sought for."""
REFUTED = 10.0
"""An explanation that predicts held-out readings worse than calibration by so much is not kept."""

Report = Callable[[str], None]
"""Hears which step is under way."""


def diagnose(recording: Recording, **options: Any) -> Diagnosis:
    """What a recording tells, as plain data; `options` and errors are those of `investigate`."""
    return tell(investigate(recording, **options))


def investigate(
    recording: Recording,
    *,
    seed: int = 0,
    without: frozenset[str] = frozenset(),
    report: Report = lambda step: None,
    hold_out: bool = True,
    each: Each = serially,
    trusting: bool = False,
    alone: bool = False,
) -> Investigation:
    """Find what a recording tells.

    Parameters
    ----------
    seed : of thresholds and of the choice of held-out sequences; the same seed, the same diagnosis.
    without : kinds of effects that are not considered.
    report : hears the name of every step as it begins.
    hold_out : set a quarter of the sequences aside; False where another recording is held out instead.
    each : applies a function to many tasks, in worker processes for instance.
    trusting, alone : leave a step out, for benchmarks: believe every reading; judge every hypothesis as if it were the
        only one.

    Raises
    ------
    RecordingError
        If nothing near the nominal manipulator is in balance under the recorded loads.
    """
    report("calibrate")
    aside = set_aside(recording.of_sequence, recording.loads, seed) if hold_out else ()
    training = recording.only(set(range(len(recording.sequences))) - set(aside))
    try:
        repeated = scatter(training)
        if repeated and repeated.beyond_chance:
            recording, training = (one.noisier(repeated.factor) for one in (recording, training))
        begun = start(predictor(training), without, seed, each, trusting=trusting, alone=alone)
    except ValueError as error:
        raise RecordingError(Problem(recording.name, str(error))) from None
    calibrated, trust, search = begun.calibrated, begun.trust, begun.search
    report("locate")
    before = examine(calibrated, search)
    report("explain")
    choice = choose(calibrated, search, before)
    if choice.fitted.model.hypotheses:  # covariance and outliers as the explanation has them
        trust = replace(trust, distrust=begun.trust.distrust)
        explained = renewed(choice.fitted, trust)
        left = examine(explained, search)
        choice = replace(choice, fitted=explained, scores=left, chi2_threshold=chi2_threshold(explained))
    report("rivals")
    fresh = unseen(recording, aside)
    fresh = fresh.doubting(choice.fitted) if fresh else None
    held = fresh.judge(calibrated, choice.fitted) if fresh else None
    refuted: tuple[str, ...] = ()
    if held is not None and held.chi2_explained > held.chi2_calibrated + REFUTED:
        refuted = tuple(each.name for each in choice.fitted.model.hypotheses)
        choice = replace(choice, fitted=calibrated, scores=before, chi2_threshold=chi2_threshold(calibrated))
        held = fresh.judge(calibrated, calibrated) if fresh else None
    doubted = (*trust.doubted, *(fresh.doubted if fresh else ()))
    why = _unexplained(choice, [recording.manipulator.cable_names[weight.cable] for weight in doubted])
    named = tuple(
        named_effect(choice, k, search, fresh, partial=bool(why)) for k in range(len(choice.fitted.model.hypotheses))
    )
    if why or not named:
        verdict = "unexplained" if why else "adequate"
    else:
        verdict = "ambiguous" if any(each.rivals for each in named) else "explained"
    closure, closure_gain = None, None
    if verdict == "unexplained":
        report("closure")
        closure, closure_gain = _closure(fresh, calibrated, choice.fitted, seed)
    report("next experiment")
    experiments = _experiments(choice, named) if verdict == "ambiguous" else ()
    return Investigation(
        recording=recording,
        seed=seed,
        verdict=verdict,
        why=why,
        training=training,
        fresh=fresh,
        calibrated=calibrated,
        before=before,
        choice=choice,
        trust=trust,
        named=named,
        closure=closure,
        closure_gain=closure_gain,
        heldout=held,
        experiments=experiments,
        remarks=(
            *recording.remarks,
            *scattered(repeated),
            *wrong_weights(training, trust.doubted),
            *(wrong_weights(fresh.predict.recording, fresh.doubted) if fresh else ()),
            *weighed(trust),
            *refusals(refuted),
        ),
    )


def _unexplained(choice: Choice, doubted: Sequence[str]) -> str:
    """Why the verdict is `unexplained`; empty if it is not.  `doubted`: the cable of every weight not believed."""
    effects = len(choice.fitted.model.hypotheses)
    if choice.structured:
        return "a real mismatch remains that no effect of the library accounts for"
    if effects >= MOST_EFFECTS:
        return f"it takes {effects} effects at once, which is less likely than one that is not in the library"
    again = sorted({name for name in doubted if doubted.count(name) > 1})
    if again:
        which = f"cable{'s' * (len(again) > 1)} {' and '.join(again)}"
        return f"weights on {which} do not go with the readings at several steps, which is more than a slip of a label"
    return ""


def _closure(fresh: Unseen | None, calibrated: Fit, explained: Fit, seed: int) -> tuple[Closure | None, float | None]:
    """The empirical law that describes the recording best, if better than what is named, and its gain on held-out
    sequences, which must not fall."""
    laws = [close(base, seed) for base in ([calibrated, explained] if explained.model.hypotheses else [calibrated])]
    found = [law for law in laws if law is not None and cost(law.fitted) < cost(explained)]
    if not found:
        return None, None
    best = min(found, key=lambda law: cost(law.fitted))
    held = fresh.judge(calibrated, best.fitted) if fresh else None
    if held is not None and held.chi2_explained > held.chi2_calibrated:
        return None, None
    return best, None if held is None else held.gain


def _experiments(choice: Choice, named: Sequence[Named]) -> tuple[Separation, ...]:
    out: list[Separation] = []
    for each in named:
        near = each.rivals[:MOST_RIVALS]
        best = best_experiments(choice.fitted, [rival.fitted for rival in near]) if near else []
        out += [Separation(each.hypothesis.name, r.hypothesis.name, one) for r, one in zip(near, best, strict=True)]
    return tuple(out)
