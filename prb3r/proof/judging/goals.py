"""Goals: the lines of the table of scores, and how a share of recordings is measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from prb3r.proof.judging.intervals import Score, share_of
from prb3r.proof.judging.opened import OpenedCase

Test = Callable[[OpenedCase], bool]
"""Whether a recording counts for a score, or hits."""
Measure = Callable[[Sequence[OpenedCase]], Score]
"""The score of all recordings of a run."""


@dataclass(frozen=True)
class Goal:
    """One line of the table of scores."""

    name: str
    relation: str
    """How the value relates to `asked`: `>=`, `<=` or `in`; empty for information, without a goal."""
    asked: tuple[float, ...]
    """The limit, or both limits of `in`; empty for information."""
    measure: Measure
    short: str = ""
    """Short name of a headline score; empty for the others."""

    def met(self, score: Score) -> bool | None:
        """Whether the value of a score, whatever its interval, keeps the goal; None without data or goal."""
        return _within(self, score.value, score.value) if score.count else None

    def shown(self, score: Score) -> bool | None:
        """Whether the whole interval of a score keeps the goal; None without data or goal."""
        return _within(self, score.low, score.high) if score.count else None


def _within(goal: Goal, low: float, high: float) -> bool | None:
    """Whether all from `low` to `high` keeps a goal; None for information."""
    if not goal.relation:
        return None
    if goal.relation == ">=":
        return bool(low >= goal.asked[0])
    if goal.relation == "<=":
        return bool(high <= goal.asked[0])
    return bool(low >= goal.asked[0] and high <= goal.asked[1])


def share_measure(chosen: Callable[[OpenedCase], bool], hit: Callable[[OpenedCase], bool]) -> Measure:
    """The measure of the share of hits among the chosen recordings; recordings of one design are one cluster."""

    def measure(cases: Sequence[OpenedCase]) -> Score:
        of = [case for case in cases if chosen(case)]
        return share_of([hit(case) for case in of], [case.label.design for case in of])

    return measure
