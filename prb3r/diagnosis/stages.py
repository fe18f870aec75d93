"""The stages of a diagnosis between set-up and telling; each takes what is known so far (`known.py`) and adds to it.

calibrate -> doubt -> test -> search -> check
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.checks.doubt import without_outliers, without_wrong_weights
from prb3r.diagnosis.checks.heldout import Unseen, unseen
from prb3r.diagnosis.checks.repeats import scatter
from prb3r.diagnosis.checks.residuals import model_checks
from prb3r.diagnosis.checks.set_aside import set_aside
from prb3r.diagnosis.checks.setup.find import Blunder
from prb3r.diagnosis.checks.tolerated import tolerances_told
from prb3r.diagnosis.checks.verdict import empirical_law, why_doubtful, why_unexplained
from prb3r.diagnosis.evidence.stated_accuracy import share_of_stated
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.known import Calibrated, Doubted, Searched, Task, Tested
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.named import named_effect, separations, surviving
from prb3r.diagnosis.result.remarks import (
    against_the_best,
    as_many_as_sought,
    chosen_by,
    found_before,
    likely_too,
    never_unloaded,
    not_predicted,
    or_a_blunder,
    refuted_sets,
)
from prb3r.diagnosis.result.rig_remarks import (
    at_bounds,
    below_stated,
    beyond_tolerance,
    far_rims,
    misplaced_marker,
    noisy,
    off_as_drawn,
    scattered,
    strained,
    weighed,
    wrong_weights,
)
from prb3r.diagnosis.search.apply import Apply
from prb3r.diagnosis.search.assumed import Assumed, assumed_of, known_states
from prb3r.diagnosis.search.coarser import coarsened
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.starts import search_effects
from prb3r.recording.plausibility import slips_the_other_way
from prb3r.recording.recording import Recording

Report = Callable[[str], None]
"""Called with the name of each stage as it begins."""


def to_search(task: Task, report: Report, apply: Apply) -> Searched:
    """The effects chosen for a recording: all stages from calibration to search."""
    tested = to_test(task, report, apply)
    report("search")
    return search(tested)


def to_test(task: Task, report: Report, apply: Apply) -> Tested:
    """The score tests of what calibration leaves: all stages from calibration to test."""
    report("calibrate")
    calibrated = calibrate(task)
    report("doubt")
    doubted = doubt(calibrated, apply)
    report("test")
    return test(doubted)


def leaves_something(tested: Tested) -> bool:
    """Whether constants alone leave something that an effect would explain, even if the noise is as large as what is
    left."""
    scale = max(float(np.sqrt(tested.doubted.fitted.reduced)), 1.0)
    return tested.scores.largest > scale * tested.scores.naming


def calibrate(task: Task) -> Calibrated:
    """Set sequences aside, and fit the constants to the others; see how much the repeated ones of these scatter."""
    recording, settings = task.recording, task.settings
    read = recording.of_sequence[recording.readings.step]
    aside = set_aside(recording.of_sequence, recording.loads, task.seed, settings, read) if task.hold_out else ()
    training = fitted_part(recording, aside)
    fitted = fit_constants(predictor(training, settings), settings=settings)
    return Calibrated(task, recording, aside, scatter(training, settings), fitted)


def fitted_part(recording: Recording, aside: Sequence[int]) -> Recording:
    """The recording without the sequences numbered in `aside`."""
    return recording.only(set(range(len(recording.sequences))) - set(aside))


def doubt(calibrated: Calibrated, apply: Apply) -> Doubted:
    """Weigh gross outliers down, set wrong weights aside, and make the library of effects to be searched."""
    task = calibrated.task
    fitted, doubts = without_outliers(calibrated.fitted)
    predict, nearest = fitted.model.predict, task.start_from or task.assumed
    states = known_states(nearest, predict) if nearest else None
    scope = Scope.of(predict.recording, predict.chain, states or fitted.solved.states, task.settings)
    library = hypotheses(scope, task.without)
    nominal, known = predict.recording.manipulator, (task.assumed, task.start_from)
    assumed, start_from = (assumed_of(other, nominal, library) if other else Assumed() for other in known)
    searched = Search(library, task.seed, apply, assumed, start_from, task.settings)
    fitted, doubts = without_wrong_weights(fitted, doubts, searched)
    return Doubted(task, calibrated.recording, calibrated.aside, calibrated.repeated, fitted, doubts, searched)


def test(doubted: Doubted) -> Tested:
    """The score tests of what calibration leaves, under the stated noise."""
    return Tested(doubted, examine(doubted.fitted, doubted.search))


def search(tested: Tested, least_worth: float = -np.inf) -> Searched:
    """Choose effects, under the noise that is estimated with them; `least_worth`: as of `search_effects`."""
    doubted = tested.doubted
    return Searched(tested, search_effects(doubted.fitted, doubted.search, doubted.doubts, least_worth))


def coarsened_if_unexplained(searched: Searched) -> Searched:
    """The choice; where it leaves more than noise, the effects that stand under a coarser likelihood (`coarsened`)."""
    choice, tested = searched.choice, searched.tested
    return Searched(tested, coarsened(choice, tested.doubted.search)) if choice.structured else searched


def predicting(choice: Choice, fresh: Unseen | None, search: Search) -> Choice:
    """The choice, or the surviving model that the sequences set aside speak for.

    Where the chosen model does not predict them, that is the most probable one that does.  It has at most as many
    effects, as one more has to be named by the evidence of the fitted sequences.  Where the chosen model is but a part
    of the most probable one, it is the smallest such part that is not much less probable by all sequences together, in
    which every effect is named by the evidence of both.  Where there is none, the choice stays.
    """
    if fresh is None:
        return choice
    if fresh.refutes(choice.fitted):
        count, least = len(choice.fitted.model.hypotheses), choice.fitted.model.settings.alike_rate
        likely = [s.fitted for s in choice.survivors if s.probability >= least and len(s.effects) <= count]
        other = next((fitted for fitted in likely if not fresh.refutes(fitted)), None)
        if other is not None:
            return replace(choice, fitted=other, scores=examine(other, search))
    fuller = _by_all_sequences(choice, fresh)
    return choice if fuller is choice.fitted else replace(choice, fitted=fuller, scores=examine(fuller, search))


def _by_all_sequences(choice: Choice, fresh: Unseen) -> Fit:
    """The smallest part of the most probable model, with all that is chosen, whose ln density of fitted and held-out
    sequences is within `Settings.simpler_reach` of the largest; the chosen fit where that is it.

    It also stays where the smallest part misses a held-out sequence by more than noise does in one recording of
    twenty: of models that are all wrong, densities do not tell which names are right.
    """
    best, count, settings = choice.survivors[0], fresh.predict.recording.readings.count, choice.fitted.model.settings
    told = {}
    for survivor in choice.survivors:
        if choice.effects <= survivor.effects <= best.effects:
            fitted = choice.fitted if survivor.effects == choice.effects else survivor.fitted
            score = fresh.log_score(fitted)
            told[fitted] = survivor.log_evidence + (-np.inf if score is None else count * score)
    least = max(told.values(), default=-np.inf) - settings.simpler_reach
    near = [fitted for fitted, worth in told.items() if worth >= least > -np.inf]
    chosen = min(near, key=lambda fitted: (len(fitted.model.hypotheses), -told[fitted]), default=choice.fitted)
    predicts = all(sequence.p >= settings.alike_rate for sequence in fresh.judged(chosen))
    return chosen if predicts else choice.fitted


def check(searched: Searched, blunder: Blunder | None = None) -> Investigation:
    """Hold the choice against the sequences set aside, and give the verdict, the named effects and the remarks.

    Parameters
    ----------
    blunder : a blunder of the set-up that would explain the recording in the place of effects.
    """
    tested, choice = searched.tested, searched.choice
    if choice.structured:
        choice = replace(choice, share_of_stated=share_of_stated(choice.fitted, choice.doubts))
    doubted, calibrated = tested.doubted, choice.calibrated
    task, training = doubted.task, calibrated.model.predict.recording
    fresh = unseen(doubted.recording, doubted.aside, task.settings, choice.doubts)
    models = [(survivor.probability, survivor.fitted) for survivor in choice.survivors]
    likely = [survivor for survivor in choice.survivors if survivor.probability >= task.settings.alike_rate]
    others = [survivor.fitted for survivor in likely if survivor.effects != choice.effects]
    fresh = fresh.doubting(choice.fitted, others) if fresh else None
    chosen, choice = choice.fitted, predicting(choice, fresh, doubted.search)
    judged = fresh.judged_by(choice.fitted, models) if fresh else ()
    failed = [sequence for sequence in judged if fresh and sequence.p < fresh.rate]
    wrong = (*choice.doubts.weights, *(fresh.doubted if fresh else ()))
    checks, cables = model_checks(choice, judged), training.manipulator.cable_names
    why = why_unexplained(choice, failed, [cables[weight.cable] for weight in wrong], checks)
    refuted = () if fresh is None or why else choice.refuted_by(fresh.refutes)
    choice = choice.without(refuted)
    why = why or why_doubtful(choice, doubted.search)
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
        rival_blunder=blunder,
        remarks=(
            *doubted.recording.remarks,
            *slips_the_other_way(doubted.recording),
            *or_a_blunder(blunder),
            *strained(choice.fitted),
            *at_bounds(choice.fitted),
            *far_rims(choice.fitted),
            *found_before(doubted.search.assumed, choice),
            *as_many_as_sought(choice),
            *(misplaced_marker(choice.calibrated, choice.doubts) if why else likely_too(choice)),
            *([] if why or choice.share_of_stated < 1 else against_the_best(checks, task.settings)),
            *beyond_tolerance(tolerances, task.settings),
            *(off_as_drawn(fresh, choice.fitted) if not failed else ()),
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
