"""The decisions about blunders of the set-up: which are reported, each weighed against the effects that stand in for
it."""

from collections import Counter
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.checks.setup.find import Blunder, blunders_of
from prb3r.diagnosis.checks.setup.imitated import blunder_in_place
from prb3r.diagnosis.checks.setup.weigh import is_left_behind, is_rival, moves_nothing, speaks_for
from prb3r.diagnosis.fit.calibrate import OutOfBalance
from prb3r.diagnosis.known import Searched, Task, Tested
from prb3r.diagnosis.result.tell import adjusted
from prb3r.diagnosis.search.apply import Apply
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import (
    Report,
    leaves_something,
    search,
    searched_as,
    searched_on,
    to_search,
    to_test,
)


class SetUp(NamedTuple):
    """The effects chosen for a recording, and the blunders of its set-up."""

    searched: Searched
    blunders: tuple[Blunder, ...]
    """Blunders that are reported; they are mended in the recording that was searched."""
    rival: Blunder | None = None
    """A blunder that would explain the recording with fewer effects, but has too little evidence to be reported."""
    without_rival: Searched | None = None
    """The effects chosen when the rival is mended too."""


def without_blunders(task: Task, report: Report, apply: Apply) -> SetUp:
    """The blunders of a recording's set-up, and the effects chosen once these are mended.

    Where an effect imitates a blunder that only shows beside the other effects (:func:`blunder_in_place`), the mended
    recording is searched too, and the blunder is reported, or a rival, by the same comparison as others.
    """
    found = _without_shown_blunders(task, report, apply)
    searched, said, *_ = found
    if found.rival or len(said) >= task.settings.most_blunders:
        return found
    recording = mended_task(task, said).recording
    blunder = blunder_in_place(recording, searched.choice, searched.tested.doubted.search)
    if blunder is None:
        return found
    try:
        mended = to_search(mended_task(task, (blunder,)), report, apply)
    except OutOfBalance:
        return found
    if _speaks(mended, searched, blunder):
        return SetUp(mended, (*said, blunder))
    return SetUp(searched, said, blunder, mended) if is_rival(_weighed(mended), _weighed(searched)) else found


def _without_shown_blunders(task: Task, report: Report, apply: Apply) -> SetUp:
    """:func:`without_blunders` with the blunders that show with constants alone.

    If constants alone do not explain the mended recording, effects may have imitated the blunder.  The recording as it
    is and the mended one are then both searched for effects, and the blunder is reported only if the comparison
    supports it (:func:`speaks_for`).  A search is stopped after its first start where that settles the comparison
    (:func:`_both_begun`, :func:`_mended_beside`).  If mending changes no prediction with the effects found in the
    mended recording, as for a cable that turns out to be dead, there is no blunder, and the recording as it is is
    searched again from these effects.  A blunder that is sure (`Blunder.sure`) is reported
    without such a comparison, unless mending it changes no prediction.
    """
    blunders = blunders_of(task.recording, task.settings, apply)
    if not blunders or blunders[-1].sure:
        searched = to_search(mended_task(task, blunders), report, apply)
        return _without_idle(task, searched, blunders, apply) or SetUp(searched, blunders)
    sure = blunders[: next(k for k, blunder in enumerate(blunders) if not blunder.sure)]
    as_it_is, said = to_test(mended_task(task, sure), report, apply), sure
    report("search")
    begun = _both_begun(task, blunders[: len(sure) + 1], as_it_is, apply)
    searched, mended = begun if begun else (search(as_it_is), None)
    if begun and not _is_clear(*begun, blunders[len(sure)], task.settings):
        searched = searched_on(searched)
    for count in range(len(sure) + 1, len(blunders) + 1):
        blunder = blunders[count - 1]
        report("search")
        other = _mended_beside(task, blunders[:count], searched, apply, mended if count == len(sure) + 1 else None)
        if other is None:
            break
        if not _speaks(other, searched, blunder):
            rival = is_rival(_weighed(other), _weighed(searched))
            return SetUp(searched, said, blunder, other) if rival else SetUp(searched, said)
        if fewer := _without_idle(task, other, blunders[:count], apply):
            return fewer
        searched, said = other, blunders[:count]
        if not other.choice.structured:
            break
    return SetUp(searched, said)


def _without_idle(task: Task, mended: Searched, blunders: tuple[Blunder, ...], apply: Apply) -> SetUp | None:
    """The effects chosen with as few of the first `blunders` mended as leave every prediction with the effects found
    with all of them `mended`, begun from these effects; None if mending the last one changes a prediction."""
    fitted, all_mended = mended.choice.fitted, mended_task(task, blunders).recording
    for count in range(len(blunders)):
        as_noted = mended_task(task, blunders[:count])
        if moves_nothing(as_noted.recording, all_mended, fitted):
            found = adjusted(as_noted.recording.manipulator, fitted.constants, fitted.effects)
            searched = to_search(replace(as_noted, start_from=found), lambda stage: None, apply)
            return SetUp(searched, blunders[:count])
    return None


def _both_begun(
    task: Task, blunders: tuple[Blunder, ...], as_it_is: Tested, apply: Apply
) -> tuple[Searched, Searched] | None:
    """Searches of the recording as it is, ended after the first start, and with all `blunders` mended, ended there too
    if the worth reached is not ahead by `Settings.clear_blunder` times the evidence that the last blunder needs.

    None if the last blunder is faint, or if mending it lets constants alone leave a larger misfit or no balance.
    """
    last = blunders[-1]
    if last.faint:
        return None
    try:
        tested = to_test(mended_task(task, blunders), lambda stage: None, apply)
        if tested.doubted.fitted.reduced > as_it_is.doubted.fitted.reduced:
            return None
        begun = search(as_it_is, np.inf)
        return begun, searched_as(tested, begun, _ahead(begun, last, task.settings))
    except OutOfBalance:
        return None


def _ahead(as_it_is: Searched, last: Blunder, settings: Settings) -> float:
    """The worth from the first start from which on a mended recording is clearly ahead of that as it is."""
    return as_it_is.choice.worth_of_first_start + settings.clear_blunder * last.least


def _is_clear(as_it_is: Searched, mended: Searched, last: Blunder, settings: Settings) -> bool:
    """Whether a blunder is clear from the searches of :func:`_both_begun`: the mended recording is ahead, and effects
    explain it.

    This spares the full search of a recording that is spoiled, which takes long and finds nothing.
    """
    ahead = mended.choice.worth_of_first_start > _ahead(as_it_is, last, settings)
    return ahead and not mended.choice.structured and _speaks(mended, as_it_is, last)


def _mended_beside(
    task: Task, blunders: tuple[Blunder, ...], searched: Searched, apply: Apply, begun: Searched | None
) -> Searched | None:
    """The effects chosen with all `blunders` mended, or None if the last of these cannot be reported.

    It cannot if no constants bring the mended recording into balance, or if it is faint and would not save an effect.
    The search is stopped after its first start if the worth reached is below that of the recording without the last
    blunder mended (`searched`) by more than the evidence that this blunder needs.

    Parameters
    ----------
    begun : a search of the mended recording, which may have ended after its first start; absent: nothing yet.
    """
    last, choice = blunders[-1], searched.choice
    if last.faint and not (choice.structured or choice.kinds):
        return None
    least_worth = choice.worth_of_first_start - (0.0 if last.faint else last.least)
    if begun is not None:
        return searched_as(begun.tested, searched, least_worth, begun)
    try:
        tested = to_test(mended_task(task, blunders), lambda stage: None, apply)
        if last.faint and len(choice.kinds) == 1 and leaves_something(tested):
            return None  # to save the only effect, constants alone would have to explain the mended recording
        if not choice.structured and is_left_behind(tested.doubted.fitted, tested.doubted.doubts, choice):
            return None
        return searched_as(tested, searched, least_worth)
    except OutOfBalance:
        return None


def _weighed(searched: Searched) -> tuple[Choice, Search]:
    """The choice and the search that it came from, as :func:`speaks_for` takes them."""
    return searched.choice, searched.tested.doubted.search


def _speaks(mended: Searched, as_it_is: Searched, blunder: Blunder) -> bool:
    """Whether mending explains a recording so much better that the blunder is reported (:func:`speaks_for`).

    Where it spares effects, and no others take their place, less evidence suffices (`Blunder.least_in_place`).
    """
    left, before = (Counter(effect.kind for effect in each.choice.effects) for each in (mended, as_it_is))
    spared = left < before and not mended.choice.structured
    least = min(blunder.least, blunder.least_in_place) if spared else blunder.least
    return speaks_for(_weighed(mended), _weighed(as_it_is), least)


def mended_task(task: Task, blunders: tuple[Blunder, ...]) -> Task:
    """The task with all `blunders` mended in its recording; each blunder holds the recording with those before it
    mended too."""
    return replace(task, recording=blunders[-1].mended) if blunders else task
