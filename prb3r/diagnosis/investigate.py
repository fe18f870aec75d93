"""From a recording to a diagnosis: all stages in order.

set-up -> calibrate -> doubt -> test -> search -> check -> tell
"""

from collections.abc import Sequence
from dataclasses import replace

from prb3r.diagnosis.blunders import mended_task, without_blunders
from prb3r.diagnosis.check import check
from prb3r.diagnosis.checks.setup.find import Blunder, find_blunder
from prb3r.diagnosis.fit.calibrate import OutOfBalance
from prb3r.diagnosis.known import Searched, Task
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.remarks import what_it_takes
from prb3r.diagnosis.result.tell import adjusted, tell
from prb3r.diagnosis.search.apply import Apply, serially
from prb3r.diagnosis.search.starts import search_from_known
from prb3r.diagnosis.stages import (
    Report,
    calibrate,
    coarsened_if_unexplained,
    doubt,
    framed,
    searched_as,
    to_test,
    with_other_constants,
    with_wider_markers,
)
from prb3r.errors import Problem, RecordingError
from prb3r.model.effects import AnyEffect
from prb3r.recording.plausibility import forgotten_slips

STAGES = ("set-up", "calibrate", "doubt", "test", "search", "check", "tell")


def run_stages(task: Task, report: Report = lambda stage: None, apply: Apply = serially) -> Diagnosis:
    """The diagnosis of the recording of a task, by all stages; parameters and errors as of :func:`investigate`."""
    investigation = investigate(task, report, apply)
    report("tell")
    return tell(investigation)


def investigate(task: Task, report: Report = lambda stage: None, apply: Apply = serially) -> Investigation:
    """The outcome of all stages but the last, with the underlying fits.

    Parameters
    ----------
    report : called with the name of every stage as it begins.
    apply : applies a function to many tasks, in worker processes for instance.

    Raises
    ------
    RecordingError
        If nothing near the nominal manipulator is in balance under the recorded loads.
    """
    report("set-up")
    task = framed(task)
    try:
        searched, blunders, rival, mended = without_blunders(task, report, apply)
    except OutOfBalance as error:
        raise RecordingError(Problem(task.recording.name, str(error))) from None
    searched = with_wider_markers(with_other_constants(searched, apply), apply)
    report("check")
    investigation = check(coarsened_if_unexplained(searched), rival)
    if investigation.verdict == "unexplained" and rival and mended:
        other = check(coarsened_if_unexplained(mended))
        if other.verdict != "unexplained":
            investigation, blunders = other, (*blunders, rival)
    if investigation.verdict == "unexplained" and len(blunders) < task.settings.most_blunders:
        investigation, blunders = beside_effects(task, searched, investigation, blunders, apply)
    if investigation.failed and not investigation.choice.structured:
        remark = fitted_too(mended_task(task, blunders), investigation, apply)
        investigation = replace(investigation, remarks=(*investigation.remarks, remark))
    if not blunders:
        return investigation
    filed = task.recording.manipulator if any(each.file == "manipulator" for each in blunders) else None
    return replace(investigation, verdict="set-up", blunders=blunders, as_filed=filed)


def fitted_too(task: Task, investigation: Investigation, apply: Apply) -> str:
    """A sentence on the effects that would be needed to predict the sequences set aside that are not predicted.

    They are those found by a search on all sequences together, those set aside included.
    """
    fitted = investigation.choice.fitted
    found = adjusted(investigation.recording.manipulator, fitted.constants, fitted.effects)
    try:
        doubted = doubt(calibrate(replace(task, hold_out=False, start_from=found)), apply)
    except OutOfBalance:
        return what_it_takes(investigation.choice, None, investigation.failed)
    with_them = search_from_known(doubted.fitted, doubted.search, doubted.doubts)
    return what_it_takes(investigation.choice, with_them, investigation.failed)


def beside_effects(
    task: Task, before: Searched, unexplained: Investigation, blunders: tuple[Blunder, ...], apply: Apply
) -> tuple[Investigation, tuple[Blunder, ...]]:
    """The investigation and the blunders, with one more blunder if effects had hidden it; else both unchanged.

    If effects were found, a blunder is sought with these effects in the model.  Two steps may be exchanged if they have
    weights that were not believed, or are held-out steps that are not predicted, these only if there are at most
    `Settings.most_missed_steps` of them.  Weights of a sequence that is held out and not predicted may be noted as a
    multiple of what hung there; this is sought without effects, too.  Where columns of slip may have been forgotten, it
    is also sought beside the effects that do not follow the load path: slip that follows the path stands in for them.

    A blunder is added only if mending it makes the recording explained, and only if it still shows beside the effects
    that are then found; otherwise it had stood in for other physics.  The search of the mended recording is stopped
    after its first start if the worth reached is below that of the earlier search by more than the evidence that the
    blunder needs.
    """
    there, missed = unexplained.choice.fitted.effects, unexplained.missed_steps
    exchanged = {*unexplained.doubted_steps, *(missed if len(missed) <= task.settings.most_missed_steps else ())}
    as_noted = mended_task(task, blunders).recording
    pairs = sorted(exchanged) if len(exchanged) > 1 else []
    suspected: list[tuple[list[int], bool, tuple[str, ...]]] = [([], False, ())] if there else []
    if pairs:
        suspected.append((pairs, False, ()))
    if unexplained.failed:
        suspected.append((pairs, False, unexplained.failed))
    if forgotten_slips(as_noted) and any(effect.follows_history for effect in there):
        suspected.append(([], True, ()))
    for among, declared, failed in suspected:
        with_them = _beside(there, declared)
        hidden = find_blunder(as_noted, task.settings, with_them, apply, exchanged=among, missed=failed)
        if hidden is None:
            continue
        try:
            tested = to_test(mended_task(task, (hidden,)), lambda stage: None, apply)
            searched = searched_as(tested, before, unexplained.choice.worth_of_first_start - hidden.least)
        except OutOfBalance:
            continue
        found = _beside(searched.choice.fitted.effects, declared)
        now = find_blunder(as_noted, task.settings, found, apply, exchanged=among, missed=failed)
        if now is None or not hidden.is_same(now):
            continue
        mended = check(searched)
        if mended.verdict != "unexplained":
            return mended, (*blunders, hidden)
    return unexplained, blunders


def _beside(effects: Sequence[AnyEffect], declared: bool) -> list[AnyEffect]:
    """The effects beside which a blunder is sought: all, or where slip is to be as declared those that follow no load
    path."""
    return [effect for effect in effects if not (declared and effect.follows_history)]
