"""The stages of a diagnosis between set-up and check; each takes the results so far (`known.py`) and adds its own.

calibrate -> doubt -> test -> search
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logit

from prb3r.diagnosis.checks.doubt import without_outliers, without_wrong_weights
from prb3r.diagnosis.checks.frame import frame_misstated, frame_taken, with_frame
from prb3r.diagnosis.checks.repeats import scatter
from prb3r.diagnosis.checks.set_aside import set_aside
from prb3r.diagnosis.checks.statements import (
    constants_stated_otherwise,
    contradicted,
    may_be_misstated,
    shifted_markers,
    stated_otherwise,
    turned_markers,
    with_shifted_markers,
    with_turned_markers,
)
from prb3r.diagnosis.evidence.model_evidence import log_evidence_in_full
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.known import Calibrated, Doubted, Searched, Task, Tested
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.search.apply import Apply
from prb3r.diagnosis.search.assumed import Assumed, assumed_of, known_states
from prb3r.diagnosis.search.coarser import coarsened
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.search.starts import search_effects
from prb3r.recording.recording import Recording

Report = Callable[[str], None]
"""Called with the name of each stage as it begins."""


def framed(task: Task) -> Task:
    """The task with the camera's frame to be fitted, where its recording does not state how exactly that is known and a
    rigid motion removes most of what constants leave (`frame_taken`); else the task itself."""
    taken = frame_taken(task.recording, task.settings)
    if not taken:
        return task
    lines = tuple(f"{name} = {sd:g}" for name, sd in taken.items())
    return replace(task, recording=with_frame(task.recording, taken), frame_taken=lines)


def to_search(task: Task, report: Report, apply: Apply) -> Searched:
    """The effects chosen for a recording: all stages from calibration to search."""
    tested = to_test(task, report, apply)
    report("search")
    return search(tested)


def to_test(task: Task, report: Report, apply: Apply) -> Tested:
    """The score tests of the residuals of calibration: all stages from calibration to test.

    Where markers seem turned on their disks by far more than is stated, and constants alone explain the readings with
    that, it is not believed.  Otherwise the angle of every marker would be told as a rest curvature.
    """
    tested, recording = _as_stated_to_test(task, report, apply), task.recording
    wide = with_turned_markers(tested.doubted.fitted, tested.doubted.doubts) if leaves_something(tested) else None
    freed = wide and _explained_to_test(replace(task, recording=replace(recording, tolerance=wide)), apply)
    if not freed:
        return tested
    return _with_remarks(freed, [turned_markers(recording, freed.doubted.fitted, freed.doubted.doubts)])


def with_other_constants(searched: Searched, apply: Apply) -> Searched:
    """The choice with one more model, where the readings contradict what is stated of Young's modulus, of friction or
    of the camera's frame and constants alone explain them without it: that the statement is wrong.

    Otherwise an effect that acts like another modulus, such as soft clamps, or like another frame, such as an arm that
    sags, would be sure to be there.
    """
    tested, choice = searched.tested, searched.choice
    task, fields = tested.doubted.task, contradicted(tested.doubted.fitted)
    missed = choice.structured or choice.kinds
    frame = frame_misstated(tested.doubted.fitted.recording, task.settings) if missed else {}
    if not fields and not frame:
        return searched
    other = stated_otherwise(task.recording, fields, frame, task.settings)
    freed = _explained_to_test(replace(task, recording=other), apply)
    model = constants_stated_otherwise(choice, fields, frame)
    if freed is None or model is None:
        return searched
    remarks, share = may_be_misstated(task.recording, fields, frame, model), model.probability
    stated = tuple(replace(survivor, probability=(1 - share) * survivor.probability) for survivor in choice.survivors)
    if share <= 1 / 2:
        return Searched(_with_remarks(tested, remarks), replace(choice, survivors=(*stated, model)))
    chosen = search(freed).choice
    free = (replace(survivor, probability=share * survivor.probability) for survivor in chosen.survivors)
    return Searched(_with_remarks(freed, remarks), replace(chosen, survivors=(*free, *stated)))


def with_wider_markers(searched: Searched, apply: Apply) -> Searched:
    """The choice with markers that may sit farther off their places than is stated, where some would have to beside
    what is chosen, and fewer effects explain the recording with that; else the choice as it is.

    It has to be the more probable one, though that a statement is wrong has the prior probability `Settings.misstated`.
    Otherwise effects that move these markers alone, such as a weak plate or a lens, would be sure to be there.
    """
    choice, task = searched.choice, searched.tested.doubted.task
    wide = with_shifted_markers(choice.fitted, choice.doubts)
    if not wide:
        return searched
    tested = _as_stated_to_test(replace(task, recording=replace(task.recording, tolerance=wide)), _unsaid, apply)
    freed = search(tested)
    before, after = (
        log_evidence_in_full(each.choice.fitted, each.tested.doubted.search.log_odds) for each in (searched, freed)
    )
    better = after + logit(task.settings.misstated) > before and not freed.choice.structured
    if not better or len(freed.choice.effects) >= len(choice.effects):
        return searched
    return replace(freed, tested=_with_remarks(tested, [shifted_markers(task.recording, choice, freed.choice)]))


def _unsaid(stage: str) -> None:
    """A report of stages that tells nobody."""


def _explained_to_test(task: Task, apply: Apply) -> Tested | None:
    """As :func:`to_test`, with all that is stated believed; None where constants alone leave something."""
    tested = _as_stated_to_test(task, _unsaid, apply)
    return None if leaves_something(tested) else tested


def _with_remarks(tested: Tested, remarks: Sequence[str]) -> Tested:
    """The tests with more remarks on the recording."""
    doubted = tested.doubted
    recording = replace(doubted.recording, remarks=(*doubted.recording.remarks, *remarks))
    return replace(tested, doubted=replace(doubted, recording=recording))


def _as_stated_to_test(task: Task, report: Report, apply: Apply) -> Tested:
    """As :func:`to_test`, with all that is stated believed."""
    report("calibrate")
    calibrated = calibrate(task)
    report("doubt")
    doubted = doubt(calibrated, apply)
    report("test")
    return test(doubted)


def leaves_something(tested: Tested) -> bool:
    """Whether constants alone leave structure that an effect would explain, even if the noise were as large as their
    residuals."""
    scale = max(float(np.sqrt(tested.doubted.fitted.reduced)), 1.0)
    return tested.scores.largest > scale * tested.scores.naming


def calibrate(task: Task) -> Calibrated:
    """Set sequences aside, fit the constants to the others, and measure the scatter of repeated ones among these."""
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


def searched_on(searched: Searched, least_worth: float = -np.inf) -> Searched:
    """The search gone on with where it ended after the first start; as it is where it did not end there."""
    begun, doubted = searched.choice.begun, searched.tested.doubted
    if begun is None or searched.choice.worth_of_first_start < least_worth:
        return searched
    choice = search_effects(doubted.fitted, doubted.search, doubted.doubts, least_worth, begun)
    return Searched(searched.tested, choice)


def searched_as(
    tested: Tested, before: Searched, least_worth: float = -np.inf, begun: Searched | None = None
) -> Searched:
    """As :func:`search`, gone on with where an earlier search (`before`) ended if that fitted the same readings under
    the same loads: then the two recordings differ in what is set aside alone.

    Else it goes on with where a search of these tests ended that was `begun`, if any.
    """
    if _fit_the_same(before.tested.doubted.fitted, tested.doubted.fitted):
        return searched_on(Searched(tested, before.choice), least_worth)
    return searched_on(begun, least_worth) if begun else search(tested, least_worth)


def _fit_the_same(one: Fit, other: Fit) -> bool:
    """Whether two calibrations are of the same readings and loads of the same rig, and came out the same, but for
    rounding."""
    a, b = one.recording, other.recording
    if a.manipulator != b.manipulator or one.residual.shape != other.residual.shape or one.p.shape != other.p.shape:
        return False
    pairs = [*zip(a.readings, b.readings, strict=True), *zip(a.loads, b.loads, strict=True)]
    pairs += [(one.p, other.p), (one.residual, other.residual)]
    return all(x.shape == y.shape and np.allclose(x, y, rtol=1e-9, atol=1e-9) for x, y in pairs)


def coarsened_if_unexplained(searched: Searched) -> Searched:
    """The choice; where it leaves more than noise, the effects that stand under a coarser likelihood (`coarsened`)."""
    choice, tested = searched.choice, searched.tested
    return Searched(tested, coarsened(choice, tested.doubted.search)) if choice.structured else searched
