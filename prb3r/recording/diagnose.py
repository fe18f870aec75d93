"""From a recording to a verdict: locate the mismatch, name the physics that was left out, and say how sure that is."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from prb3r.errors import Problem, RecordingError
from prb3r.model.effect import Base
from prb3r.model.manipulator import Manipulator
from prb3r.recording.calibrate import Fit, fit
from prb3r.recording.closure import Closure, close
from prb3r.recording.clues import Clue, clues
from prb3r.recording.experiment import Experiment, best_experiments
from prb3r.recording.heldout import HeldOut, Unseen, set_aside, unseen
from prb3r.recording.hypothesis import FARTHEST, Hypothesis
from prb3r.recording.laws import Mechanism, MomentMap, mechanism, missing_moments
from prb3r.recording.locate import DETECTABLE, Scores
from prb3r.recording.outliers import Trust, Weight, far_off
from prb3r.recording.predict import Constants, predictor
from prb3r.recording.profile import Profile, profile
from prb3r.recording.recording import Recording
from prb3r.recording.repeats import Scatter, scatter
from prb3r.recording.rivals import Rival, rivals
from prb3r.recording.select import (
    MOST_EFFECTS,
    Choice,
    Each,
    Search,
    bic,
    chi2_threshold,
    choose,
    cost,
    examine,
    serially,
)
from prb3r.recording.statements import Estimate, sentence
from prb3r.recording.trust import renewed, start

VERDICTS = ("adequate", "explained", "ambiguous", "unexplained")
FAR_FROM_ONE = 1.5
"""With a larger reduced chi-square no interval is printed."""
MOST_RIVALS = 4
"""Rivals of an effect that experiments are sought for."""
REFUTED = 10.0
"""An explanation that predicts held-out readings worse than calibration by so much is not kept."""

Report = Callable[[str], None]
"""Hears which step is under way."""


@dataclass(frozen=True, eq=False)
class Named:
    """An effect that the diagnosis names."""

    hypothesis: Hypothesis
    effect: Base
    parameters: Mapping[str, Estimate]
    places: Mapping[str, tuple[Any, tuple[Any, ...]]]
    """Where: the best place, and all that cannot be told from it."""
    statement: str
    rivals: tuple[Rival, ...]
    """Effects of another kind that cannot be told apart."""
    delta_bic: float
    """Negative: better with the effect than without."""
    heldout_gain: float | None
    """Share of the excess squared error on held-out sequences that this effect removes."""
    partial: bool
    profiles: Mapping[str, Profile]


@dataclass(frozen=True, eq=False)
class Mismatch:
    """Where the calibrated model misses, and what that depends on."""

    plates: tuple[int, ...]
    sequences: tuple[str, ...]
    depends_on: tuple[str, ...]
    statement: str
    moments: MomentMap
    mechanics: Mechanism


@dataclass(frozen=True)
class Detectable:
    """The smallest effect of a kind that the recording would have shown."""

    hypothesis: Hypothesis
    size: float | None
    """Change of the first free parameter; None for an effect without degrees."""
    shown: bool
    """Whether an effect without degrees would have shown."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What a recording tells."""

    recording: Recording
    seed: int
    verdict: str
    why: str
    """Of `unexplained`: what no effect of the library accounts for."""
    training: Recording
    """The sequences that were fitted."""
    nominal_chi2: float | None
    """Reduced, of the nominal model; None where it has no equilibrium."""
    calibrated: Fit
    explained: Fit
    trust: Trust
    choice: Choice
    before: Scores
    """Score test of what calibration leaves."""
    named: tuple[Named, ...]
    mismatch: Mismatch
    closure: Closure | None
    """An empirical law of the unexplained."""
    closure_gain: float | None
    """Share of the excess squared error on held-out sequences that it removes."""
    heldout: HeldOut | None
    clues: tuple[Clue, ...]
    detectable: tuple[Detectable, ...]
    experiments: tuple[tuple[str, str, Experiment], ...]
    """Two rivals by name, and the load program that separates them."""
    remarks: tuple[str, ...]

    @property
    def outliers(self) -> list[int]:
        """Readings of the training part beyond 4 sd of the explained model."""
        return far_off(self.explained, self.trust)

    def manipulator(self, fitted: Fit) -> Manipulator:
        """The recorded manipulator with the constants and effects of a fitted model."""
        return adjusted(self.recording.manipulator, fitted.constants, fitted.effects)


def adjusted(nominal: Manipulator, constants: Constants, effects: Sequence[Base]) -> Manipulator:
    """A manipulator with calibrated constants and more effects, on the elastica plate model."""
    plain = nominal.model_dump(exclude_none=True)
    stiffer = float(np.exp(constants.log_stiffness))
    plain["model"] = "elastica"
    plain["youngs_modulus_pa"] *= stiffer
    for segment in plain["segment"]:
        if "bending_stiffness_n_m2" in segment:
            segment["bending_stiffness_n_m2"] *= stiffer
    plain["friction"]["coefficient"] *= float(np.exp(constants.log_friction))
    plain["effect"] = [*plain.get("effect", []), *(effect.model_dump(exclude_none=True) for effect in effects)]
    return Manipulator.model_validate(plain)


def diagnose(
    recording: Recording,
    *,
    seed: int = 0,
    without: frozenset[str] = frozenset(),
    report: Report = lambda step: None,
    hold_out: bool = True,
    each: Each = serially,
    trusting: bool = False,
    alone: bool = False,
) -> Diagnosis:
    """Diagnose a recording.

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
        _named(choice, k, search, fresh, partial=bool(why)) for k in range(len(choice.fitted.model.hypotheses))
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
    return Diagnosis(
        recording=recording,
        seed=seed,
        verdict=verdict,
        why=why,
        training=training,
        nominal_chi2=_nominal_chi2(calibrated),
        calibrated=calibrated,
        explained=choice.fitted,
        trust=trust,
        choice=choice,
        before=before,
        named=named,
        mismatch=_mismatch(calibrated, choice, before, named),
        closure=closure,
        closure_gain=closure_gain,
        heldout=held,
        clues=tuple(clues(calibrated)),
        detectable=_detectable(choice.scores),
        experiments=experiments,
        remarks=(
            *recording.remarks,
            *_scattered(repeated),
            *_wrong_weights(training, trust.doubted),
            *(_wrong_weights(fresh.predict.recording, fresh.doubted) if fresh else ()),
            *_weighed(trust),
            *_refusals(refuted),
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


def _nominal_chi2(calibrated: Fit) -> float | None:
    """Reduced chi-square of the nominal constants in the calibrated frame."""
    model, constants = calibrated.model, calibrated.constants
    predicted = model.predict(constants._replace(log_stiffness=0.0, log_friction=0.0))
    if not np.isfinite(predicted).all():
        return None
    misfit = model.noise.whiten(model.predict.misfit(predicted))
    return float(misfit @ misfit / len(misfit))


def _closure(fresh: Unseen | None, calibrated: Fit, explained: Fit, seed: int) -> tuple[Closure | None, float | None]:
    """The empirical law that describes what is left best, and its gain on held-out sequences, which must not fall."""
    laws = [close(base, seed) for base in ([calibrated, explained] if explained.model.hypotheses else [calibrated])]
    found = [law for law in laws if law is not None]
    if not found:
        return None, None
    best = min(found, key=lambda law: cost(law.fitted))
    held = fresh.judge(calibrated, best.fitted) if fresh else None
    if held is not None and held.chi2_explained > held.chi2_calibrated:
        return None, None
    return best, None if held is None else held.gain


def _named(choice: Choice, number: int, search: Search, fresh: Unseen | None, *, partial: bool) -> Named:
    """Everything that is said of one chosen effect."""
    fitted = choice.fitted
    hypothesis = fitted.model.hypotheses[number]
    friction = fitted.model.friction(fitted.p)
    found = rivals(choice, number, search)
    near = [rival for rival in found if rival.indistinguishable]
    places, others = {}, []
    same = [rival for rival in near if _same_but_place(rival.hypothesis, hypothesis)]
    for key, value in hypothesis.place:
        if key != "law":
            values = {value, *(dict(rival.hypothesis.place)[key] for rival in same)}
            places[key] = (value, tuple(sorted(values, key=str if isinstance(value, str) else None)))
    others = [rival for rival in near if rival not in same]
    first = len(fitted.model.varied) + sum(len(each.free) for each in fitted.model.hypotheses[:number])
    sure = fitted.reduced < FAR_FROM_ONE
    parameters, profiles = {}, {}
    for k, free in enumerate(hypothesis.free):
        u = fitted.p[first + k]
        if sure:
            profiles[free.name] = profile(fitted, first + k)
            ends = sorted(free.value(end, friction) for end in (profiles[free.name].low, profiles[free.name].high))
            parameters[free.name] = Estimate(free.value(u, friction), *ends)
        else:
            parameters[free.name] = Estimate(free.value(u, friction))
    simpler = _without(choice, number)
    gain = fresh.judge(simpler, fitted).gain if fresh and simpler else None
    statement = sentence(hypothesis, parameters, friction)
    for key, (value, among) in places.items():
        if len(among) > 1:
            listed = ", ".join(str(each) for each in among)
            statement += f" These recordings cannot tell {key} {value} from {key} {listed}."
    return Named(
        hypothesis,
        fitted.effects[number],
        parameters,
        places,
        statement,
        tuple(others),
        bic(fitted) - bic(simpler) if simpler is not None else float("nan"),
        gain,
        partial,
        profiles,
    )


def _same_but_place(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses are the same effect elsewhere."""
    a, b = dict(one.place), dict(other.place)
    return one.kind == other.kind and a.keys() == b.keys() and a.get("law") == b.get("law")


def _without(choice: Choice, number: int) -> Fit | None:
    """The chosen model refitted without one effect."""
    fitted = choice.fitted
    own, shares = fitted.model.hypotheses, fitted.model.shares(fitted.p)
    model = replace(fitted.model, hypotheses=own[:number] + own[number + 1 :])
    first = np.concatenate([fitted.p[: len(model.varied)], *shares[:number], *shares[number + 1 :]])
    return fit(model, first)


def _experiments(choice: Choice, named: Sequence[Named]) -> tuple[tuple[str, str, Experiment], ...]:
    out: list[tuple[str, str, Experiment]] = []
    for each in named:
        near = each.rivals[:MOST_RIVALS]
        best = best_experiments(choice.fitted, [rival.fitted for rival in near]) if near else []
        out += [(each.hypothesis.name, r.hypothesis.name, one) for r, one in zip(near, best, strict=True)]
    return tuple(out)


def _mismatch(calibrated: Fit, choice: Choice, before: Scores, named: Sequence[Named]) -> Mismatch:
    """Where and on what: of what calibration leaves, or of what the best model leaves where that is structured."""
    judged, fitted = (choice.scores, choice.fitted) if choice.structured else (before, calibrated)
    mechanics = mechanism(fitted)
    moments = missing_moments(fitted, mechanics)
    strong = [
        (float(z), d.subject)
        for z, d in zip(judged.z, judged.directions, strict=True)
        if not isinstance(d.subject, Hypothesis) and z > judged.threshold
    ]
    strong.sort(key=lambda pair: -pair[0])
    top = [law for z, law in strong if z > 0.7 * strong[0][0]]
    if top and top[0].plate is None:  # a law of the whole arm is felt on single plates too
        top = [law for law in top if law.plate is None]
    depends = tuple(dict.fromkeys({"bend_cubed": "bend", "constant": "position"}.get(law.of, law.of) for law in top))
    plates = [law.plate for law in top if law.plate]
    plates += [p for n in named for key, (_, among) in n.places.items() if key in ("plate",) for p in among]
    count = fitted.model.predict.recording.readings.count
    recording = fitted.model.predict.recording
    of_reading = recording.of_sequence[recording.readings.step]
    squared = np.array(
        [np.mean(fitted.residual[:count][of_reading == k] ** 2) for k in range(len(recording.sequences))]
    )
    rows = np.bincount(of_reading, minlength=len(squared))
    loud = squared > 1 + 3 * np.sqrt(2 / np.maximum(rows, 1))
    sequences = tuple(name for name, on in zip(recording.sequences, loud, strict=True) if on)
    if not strong and not named and not choice.structured:
        statement = "Nothing is left that chance does not explain."
    else:
        where = f"at {', '.join(dict.fromkeys(law.place for law in top[:4]))}" if top else "at no single place"
        on = " and ".join(depends[:3]) or "nothing that was tried"
        what = "What is left after the best explanation" if choice.structured and named else "What calibration leaves"
        statement = f"{what} sits {where} and goes with {on}."
        if sequences and len(sequences) < len(recording.sequences):
            statement += f" It is seen in {', '.join(sequences)}."
    return Mismatch(tuple(sorted(set(plates))), sequences, depends, statement, moments, mechanics)


def _detectable(judged: Scores) -> tuple[Detectable, ...]:
    best: dict[str, Detectable] = {}
    for each in judged.directions:
        hypothesis = each.subject
        if not isinstance(hypothesis, Hypothesis) or each.size == 0:
            continue
        if not hypothesis.by_degrees:
            found = Detectable(hypothesis, None, each.size > DETECTABLE)
            if hypothesis.kind not in best or (found.shown and not best[hypothesis.kind].shown):
                best[hypothesis.kind] = found
            continue
        free = hypothesis.free[0]
        size = abs(free.value(DETECTABLE / each.size) - free.null)
        if free.log:
            size = abs(free.null * np.expm1(min(DETECTABLE / each.size, FARTHEST)))
        old = best.get(hypothesis.kind)
        if old is None or old.size is None or size < old.size:
            best[hypothesis.kind] = Detectable(hypothesis, float(size), True)
    return tuple(best.values())


def _scattered(repeated: Scatter | None) -> list[str]:
    if repeated is None:
        return []
    taken = (
        "more than chance allows: the noise is taken to be so"
        if repeated.beyond_chance
        else "and what is stated is kept"
    )
    often = f"{repeated.factor:.2g} times as much as stated"
    return [f"what was pulled again ({repeated.steps} steps) scatters {often}, {taken}"]


def _refusals(refuted: Sequence[str]) -> list[str]:
    which = " and ".join(refuted)
    return [f"{which} fitted the training sequences but predicted those set aside worse: not kept"] if refuted else []


def _wrong_weights(recording: Recording, doubted: Sequence[Weight]) -> list[str]:
    remarks = []
    for step, cable in doubted:
        row, name = recording.steps.iloc[step], recording.manipulator.cable_names[cable]
        noted = recording.loads.tension[step, cable]
        remarks.append(
            f"sequence {row['sequence']}, step {row['step']}: the weight on cable {name}, noted as {noted:.4g} N, does "
            "not go with its readings; it was not believed"
        )
    return remarks


def _weighed(trust: Trust) -> list[str]:
    weighed = int((trust.distrust > 1).sum())
    far, down = ("reading is", "it was") if weighed == 1 else ("readings are", "they were")
    return [f"{weighed} {far} far from what the neighbours show; {down} weighed down"] if weighed else []
