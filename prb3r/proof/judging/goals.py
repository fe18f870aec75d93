"""Lines of the table of scores: what is asked, and how a share of recordings is measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from prb3r.proof.judging.intervals import Score, share_of
from prb3r.proof.judging.opened import OpenedCase

Test = Callable[[OpenedCase], bool]
Measure = Callable[[Sequence[OpenedCase]], Score]


@dataclass(frozen=True)
class Goal:
    """One line of the table."""

    name: str
    relation: str
    """`>=`, `<=`, `in`, or empty for information."""
    asked: tuple[float, ...]
    measure: Measure
    short: str = ""
    """Of a headline: its name where there is little room."""

    def met(self, score: Score) -> bool | None:
        """By the point estimate; None without data or goal."""
        return _within(self, score.value, score.value) if score.count else None

    def shown(self, score: Score) -> bool | None:
        """Whether the whole interval of a score keeps the goal; None where nothing was counted."""
        return _within(self, score.low, score.high) if score.count else None


def _within(goal: Goal, low: float, high: float) -> bool | None:
    if not goal.relation:
        return None
    if goal.relation == ">=":
        return bool(low >= goal.asked[0])
    if goal.relation == "<=":
        return bool(high <= goal.asked[0])
    return bool(low >= goal.asked[0] and high <= goal.asked[1])


def share_measure(chosen: Callable[[OpenedCase], bool], hit: Callable[[OpenedCase], bool]) -> Measure:
    """Share of the chosen recordings that hit; those of a design are one cluster."""

    def measure(cases: Sequence[OpenedCase]) -> Score:
        of = [case for case in cases if chosen(case)]
        return share_of([hit(case) for case in of], [case.label.design for case in of])

    return measure
