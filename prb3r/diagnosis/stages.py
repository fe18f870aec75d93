"""From a recording to a verdict in seven stages, each a function from what is known to what is known then.

set-up -> calibrate -> doubt -> test -> search -> check -> tell
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.checks.doubt import without_outliers, without_wrong_weights
from prb3r.diagnosis.checks.heldout import Unseen, unseen
from prb3r.diagnosis.checks.repeats import scatter
from prb3r.diagnosis.checks.residuals import model_checks
from prb3r.diagnosis.checks.set_aside import set_aside
from prb3r.diagnosis.checks.setup.find import Blunder, blunders_of, find_blunder
from prb3r.diagnosis.checks.setup.weigh import moves_nothing, speaks_for, stands_beside
from prb3r.diagnosis.checks.tolerated import tolerances_told
from prb3r.diagnosis.checks.verdict import empirical_law, why_unexplained
from prb3r.diagnosis.evidence.stated_accuracy import share_of_stated
from prb3r.diagnosis.fit.calibrate import OutOfBalance, fit_constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.known import Calibrated, Doubted, Searched, Task, Tested
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.named import named_effect, separations, surviving
from prb3r.diagnosis.result.remarks import (
    against_the_best,
    as_many_as_sought,
    below_stated,
    beyond_tolerance,
    chosen_by,
    found_before,
    likely_too,
    misplaced_marker,
    never_unloaded,
    noisy,
    not_predicted,
    or_a_blunder,
    refuted_sets,
    scattered,
    strained,
    weighed,
    what_it_takes,
    without_mass,
    wrong_weights,
)
from prb3r.diagnosis.result.tell import adjusted, tell
from prb3r.diagnosis.search.apply import Apply, serially
from prb3r.diagnosis.search.assumed import Assumed, assumed_of, known_states
from prb3r.diagnosis.search.coarser import coarsened
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.starts import search_effects, search_from_known
from prb3r.errors import Problem, RecordingError
from prb3r.recording.plausibility import slips_the_other_way
from prb3r.recording.recording import Recording

STAGES = ("set-up", "calibrate", "doubt", "test", "search", "check", "tell")
Report = Callable[[str], None]
"""Hears which stage is under way."""


def run_stages(task: Task, report: Report = lambda stage: None, apply: Apply = serially) -> Diagnosis:
    """The diagnosis of the recording of a task, all stages done; parameters and errors as of :func:`investigate`."""
    investigation = investigate(task, report, apply)
    report("tell")
    return tell(investigation)


def investigate(task: Task, report: Report = lambda stage: None, apply: Apply = serially) -> Investigation:
    """All stages but the last: what there is to tell, with the fits behind it.

    Parameters
    ----------
    report : hears the name of every stage as it begins.
    apply : applies a function to many tasks, in worker processes for instance.

    Raises
    ------
    RecordingError
        If nothing near the nominal manipulator is in balance under the recorded loads.
    """
    report("set-up")
    try:
        searched, blunders, rival, mended = without_blunders(task, report, apply)
    except OutOfBalance as error:
        raise RecordingError(Problem(task.recording.name, str(error))) from None
    report("check")
    investigation = check(standing(searched), rival)
    if investigation.verdict == "unexplained" and rival and mended:
        other = check(standing(mended))
        if other.verdict != "unexplained":
            investigation, blunders = other, (*blunders, rival)
    if investigation.verdict == "unexplained" and len(blunders) < task.settings.most_blunders:
        investigation, blunders = beside_effects(task, investigation, blunders, apply)
    if investigation.failed and not investigation.choice.structured:
        remark = fitted_too(_mended(task, blunders), investigation, apply)
        investigation = replace(investigation, remarks=(*investigation.remarks, remark))
    return replace(investigation, verdict="set-up", blunders=blunders) if blunders else investigation


def fitted_too(task: Task, investigation: Investigation, apply: Apply) -> str:
    """What it would take to predict the sequences that are not, in a sentence: what explains all of them together."""
    fitted = investigation.choice.fitted
    found = adjusted(investigation.recording.manipulator, fitted.constants, fitted.effects)
    try:
        doubted = doubt(calibrate(replace(task, hold_out=False, begun=found)), apply)
    except OutOfBalance:
        return what_it_takes(investigation.choice, None, investigation.failed)
    with_them = search_from_known(doubted.fitted, doubted.search, doubted.doubts)
    return what_it_takes(investigation.choice, with_them, investigation.failed)


def beside_effects(
    task: Task, unexplained: Investigation, blunders: tuple[Blunder, ...], apply: Apply
) -> tuple[Investigation, tuple[Blunder, ...]]:
    """What is left unexplained, held against blunders that effects have hidden: they show beside those that were found,
    and steps that are exchanged by weights that were not believed, or where two or three alone are not predicted.

    One more blunder is said where the recording is explained once it is mended; else all is as it was.
    """
    there, missed = unexplained.choice.fitted.effects, unexplained.missed_steps
    exchanged = {*unexplained.doubted_steps, *(missed if len(missed) <= task.settings.most_missed_steps else ())}
    as_noted = _mended(task, blunders).recording
    suspected: list[list[int]] = [[]] if there else []
    if len(exchanged) > 1:
        suspected.append(sorted(exchanged))
    for among in suspected:
        hidden = find_blunder(as_noted, task.settings, there, apply, exchanged=among)
        if hidden is None:
            continue
        try:
            mended = check(to_search(_mended(task, (hidden,)), lambda stage: None, apply))
        except OutOfBalance:
            continue
        if mended.verdict != "unexplained":
            return mended, (*blunders, hidden)
    return unexplained, blunders


class SetUp(NamedTuple):
    """What was chosen for a recording, and what is to be said of its set-up."""

    searched: Searched
    blunders: tuple[Blunder, ...]
    """They are mended in what was searched."""
    rival: Blunder | None = None
    """One that would explain the recording by fewer effects than were chosen, for which too little speaks to say it."""
    without_rival: Searched | None = None
    """What was chosen with that mended too."""


def without_blunders(task: Task, report: Report, apply: Apply) -> SetUp:
    """What was chosen for a recording once the blunders of its set-up are mended, and these.

    A blunder that effects may imitate is said only where the recording as it is and the mended one, both searched for
    effects, speak for it.  The second search is given up where its first end is worth less than that of the first one,
    by as much as would have to speak for the blunder.  One that moves no reading beside what was found, as of a cable
    that turns out to be dead, is none: what was found is what the recording is searched from as it is.
    """
    blunders = blunders_of(task.recording, task.settings, apply)
    if not blunders or blunders[-1].plain:
        return SetUp(to_search(_mended(task, blunders), report, apply), blunders)
    plain = blunders[: next(k for k, blunder in enumerate(blunders) if not blunder.plain)]
    searched, said = to_search(_mended(task, plain), report, apply), plain
    for count in range(len(plain) + 1, len(blunders) + 1):
        blunder, choice = blunders[count - 1], searched.choice
        if blunder.faint and not (choice.structured or choice.kinds):
            break
        report("search")
        try:
            tested = to_test(_mended(task, blunders[:count]), lambda stage: None, apply)
            if blunder.faint and len(choice.kinds) == 1 and leaves_something(tested):
                break  # fewer effects than one are none, and constants alone do not explain the mended recording
            other = search(tested, choice.first_worth - (0.0 if blunder.faint else blunder.least))
        except OutOfBalance:
            break
        after, before = ((outcome.choice, outcome.tested.doubted.search) for outcome in (other, searched))
        if not speaks_for(after, before, blunder.least):
            return SetUp(searched, said, blunder, other) if stands_beside(after, before) else SetUp(searched, said)
        as_noted, fitted = _mended(task, said), other.choice.fitted
        if moves_nothing(_without_aside(as_noted.recording, other.tested.doubted.aside), fitted):
            found = adjusted(as_noted.recording.manipulator, fitted.constants, fitted.effects)
            searched = to_search(replace(as_noted, begun=found), lambda stage: None, apply)
            break
        searched, said = other, blunders[:count]
        if not other.choice.structured:
            break
    return SetUp(searched, said)


def _mended(task: Task, blunders: tuple[Blunder, ...]) -> Task:
    return replace(task, recording=blunders[-1].mended) if blunders else task


def to_search(task: Task, report: Report, apply: Apply) -> Searched:
    """All stages between the set-up and the checks."""
    tested = to_test(task, report, apply)
    report("search")
    return search(tested)


def to_test(task: Task, report: Report, apply: Apply) -> Tested:
    """All stages between the set-up and the search."""
    report("calibrate")
    calibrated = calibrate(task)
    report("doubt")
    doubted = doubt(calibrated, apply)
    report("test")
    return test(doubted)


def leaves_something(tested: Tested) -> bool:
    """Whether constants alone leave what an effect would explain, however large the noise is."""
    scale = max(float(np.sqrt(tested.doubted.fitted.reduced)), 1.0)
    return tested.scores.largest > scale * tested.scores.naming


def calibrate(task: Task) -> Calibrated:
    """Set sequences aside, see what repeated ones scatter, and fit the constants to the rest."""
    recording, settings = task.recording, task.settings
    aside = set_aside(recording.of_sequence, recording.loads, task.seed, settings) if task.hold_out else ()
    training = _without_aside(recording, aside)
    fitted = fit_constants(predictor(training, settings), settings=settings)
    return Calibrated(task, recording, aside, scatter(training, settings), fitted)


def _without_aside(recording: Recording, aside: Sequence[int]) -> Recording:
    """What is fitted of a recording."""
    return recording.only(set(range(len(recording.sequences))) - set(aside))


def doubt(calibrated: Calibrated, apply: Apply) -> Doubted:
    """Weigh gross outliers down and set wrong weights aside."""
    task = calibrated.task
    fitted, doubts = without_outliers(calibrated.fitted)
    predict, nearest = fitted.model.predict, task.begun or task.assumed
    states = known_states(nearest, predict) if nearest else None
    scope = Scope.of(predict.recording, predict.chain, states or fitted.solved.states, task.settings)
    library = hypotheses(scope, task.without)
    nominal, known = predict.recording.manipulator, (task.assumed, task.begun)
    assumed, begun = (assumed_of(other, nominal, library) if other else Assumed() for other in known)
    searched = Search(library, task.seed, apply, assumed, begun, task.settings)
    fitted, doubts = without_wrong_weights(fitted, doubts, searched)
    return Doubted(task, calibrated.recording, calibrated.aside, calibrated.repeated, fitted, doubts, searched)


def test(doubted: Doubted) -> Tested:
    """Score what calibration leaves, under the noise as it is stated."""
    return Tested(doubted, examine(doubted.fitted, doubted.search))


def search(tested: Tested, least_worth: float = -np.inf) -> Searched:
    """Choose effects, under the noise that is found with them; `least_worth` as of `search_effects`."""
    doubted = tested.doubted
    return Searched(tested, search_effects(doubted.fitted, doubted.search, doubted.doubts, least_worth))


def standing(searched: Searched) -> Searched:
    """What stands of the choice where it does not explain the recording; the choice itself where it does."""
    choice, tested = searched.choice, searched.tested
    return Searched(tested, coarsened(choice, tested.doubted.search)) if choice.structured else searched


def predicting(choice: Choice, fresh: Unseen | None, search: Search) -> Choice:
    """The choice, or where it does not predict what was set aside, the most probable surviving model that does, of as
    many effects at most: one more takes the evidence by which effects are named."""
    if fresh is None or not fresh.refutes(choice.fitted):
        return choice
    count, least = len(choice.fitted.model.hypotheses), choice.fitted.model.settings.alike_rate
    likely = [s.fitted for s in choice.survivors if s.probability >= least and len(s.effects) <= count]
    other = next((fitted for fitted in likely if not fresh.refutes(fitted)), None)
    return choice if other is None else replace(choice, fitted=other, scores=examine(other, search))


def check(searched: Searched, blunder: Blunder | None = None) -> Investigation:
    """Hold the choice against sequences that no fit has seen, and find out how sure what is.

    Parameters
    ----------
    blunder : of the set-up, that would do in the place of effects.
    """
    tested, choice = searched.tested, searched.choice
    if choice.structured:
        choice = replace(choice, share_of_stated=share_of_stated(choice.fitted, choice.doubts))
    doubted, calibrated = tested.doubted, choice.calibrated
    task, training = doubted.task, calibrated.model.predict.recording
    fresh = unseen(doubted.recording, doubted.aside, task.settings, choice.doubts)
    models = [(survivor.probability, survivor.fitted) for survivor in choice.survivors]
    others = [other for share, other in models if share >= task.settings.alike_rate and other is not choice.fitted]
    fresh = fresh.doubting(choice.fitted, others) if fresh else None
    chosen, choice = choice.fitted, predicting(choice, fresh, doubted.search)
    judged = fresh.judged_by(choice.fitted, models) if fresh else ()
    failed = [sequence for sequence in judged if fresh and sequence.p < fresh.rate]
    wrong = (*choice.doubts.weights, *(fresh.doubted if fresh else ()))
    checks, cables = model_checks(choice, judged), training.manipulator.cable_names
    why = why_unexplained(choice, failed, [cables[weight.cable] for weight in wrong], checks)
    refuted = () if fresh is None or why else choice.refuted_by(fresh.refutes)
    choice = choice.without(refuted)
    effects = range(len(choice.fitted.model.hypotheses))
    named = tuple(named_effect(choice, k, doubted.search, fresh, partial=bool(why)) for k in effects)
    law, gain = empirical_law(fresh, calibrated, choice.fitted, task.seed) if why else (None, None)
    if why or not named:
        verdict = "unexplained" if why else "adequate"
    else:
        rivals = any(effect.rivals for effect in named) or blunder is not None
        more = max(choice.likely.values(), default=0.0) > task.settings.positive_presence
        verdict = "ambiguous" if rivals or more or choice.alternatives or choice.structured else "explained"
    tolerances = tolerances_told(choice.fitted, choice.doubts)
    return Investigation(
        recording=doubted.recording,
        seed=task.seed,
        verdict=verdict,
        why=why,
        training=training,
        fresh=fresh,
        calibrated=calibrated,
        before=tested.scores,
        choice=choice,
        doubts=choice.doubts,
        named=named,
        models=surviving(choice, fresh),
        tolerances=tolerances,
        checks=checks,
        closure=law,
        closure_gain=gain,
        heldout=fresh.judge(calibrated, choice.fitted) if fresh else None,
        experiments=separations(choice, named) if verdict == "ambiguous" else (),
        failed=tuple(sequence.name for sequence in failed),
        remarks=(
            *doubted.recording.remarks,
            *slips_the_other_way(doubted.recording),
            *or_a_blunder(blunder),
            *strained(choice.fitted),
            *found_before(doubted.search.assumed, choice),
            *as_many_as_sought(choice),
            *(misplaced_marker(choice.calibrated, choice.doubts) if why else likely_too(choice)),
            *([] if why or choice.share_of_stated < 1 else against_the_best(checks, task.settings)),
            *beyond_tolerance(tolerances, task.settings),
            *(without_mass(training.manipulator) if verdict in ("ambiguous", "unexplained") else ()),
            *never_unloaded(choice, doubted.search.library),
            *scattered(doubted.repeated),
            *noisy(choice.level, task.settings),
            *below_stated(choice.share_of_stated),
            *wrong_weights(training, choice.doubts.weights),
            *(wrong_weights(fresh.predict.recording, fresh.doubted) if fresh else ()),
            *weighed(choice.doubts),
            *not_predicted(failed),
            *refuted_sets(choice, refuted),
            *chosen_by(chosen, choice.fitted, fresh),
        ),
    )
