"""The table of scores: goals, what counts towards each, and what is given for information."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.proof.concealed.labels import FAR_OUTSIDE
from prb3r.proof.concealed.responses import APART, SAME
from prb3r.proof.judging.intervals import Score, median_of, ratio_of, share_of
from prb3r.proof.judging.methods import Proposal, Verdict, kind_of, name_of
from prb3r.proof.judging.opened import (
    Judged,
    confident,
    failed,
    first_right,
    mentioned,
    named_or_failed,
    parameters,
    plate_error,
    plate_of,
    size_class,
)


@dataclass(frozen=True)
class Goal:
    """One line of the table."""

    name: str
    relation: str
    """`>=`, `<=`, `in`, or empty for information."""
    asked: tuple[float, ...]
    measure: Callable[[Sequence[Judged]], Score]

    def met(self, score: Score) -> bool | None:
        """By the point estimate; None without data or goal."""
        return _within(self, score.value, score.value) if score.count else None

    def shown(self, score: Score) -> bool | None:
        """By the whole interval."""
        return _within(self, score.low, score.high) if score.count else None


def _within(goal: Goal, low: float, high: float) -> bool | None:
    if not goal.relation:
        return None
    if goal.relation == ">=":
        return bool(low >= goal.asked[0])
    if goal.relation == "<=":
        return bool(high <= goal.asked[0])
    return bool(low >= goal.asked[0] and high <= goal.asked[1])


def _of(cls: str, *sizes: float) -> Callable[[Judged], bool]:
    return lambda case: case.label.cls == cls and (not sizes or size_class(case.label) in sizes)


def _share(chosen: Callable[[Judged], bool], hit: Callable[[Judged], bool]) -> Callable[[Sequence[Judged]], Score]:
    return lambda cases: share_of([hit(case) for case in cases if chosen(case)])


def _first(size: float) -> Callable[[Sequence[Judged]], Score]:
    return _share(lambda case: _of("single", size)(case) and case.label.distinguishable, first_right)


def _placed(case: Judged) -> bool:
    if not (_of("single", 2.0, 5.0)(case) and case.label.distinguishable):
        return False
    return plate_of(case.label.kinds[0], case.label.effects[0]) is not None


def _covering(cases: Sequence[Judged]) -> Score:
    chosen = [case for case in cases if _of("single", 2.0, 5.0)(case)]
    return share_of([one for case in chosen for _, one in parameters(case) if one is not None])


def _errors(cases: Sequence[Judged]) -> Score:
    return median_of([error for case in cases if _of("single", 5.0)(case) for error, _ in parameters(case)])


def _heldout(cases: Sequence[Judged]) -> Score:
    """Pooled over effects at 5 times the detectable size; a failure removes nothing of the quarter that was there."""
    parts = []
    for case in cases:
        if _of("single", 5.0)(case) and failed(case):
            parts.append((0.0, case.label.norm**2 / 4))
        elif _of("single", 5.0)(case) and case.verdict.heldout is not None:
            before, after, count = case.verdict.heldout
            if before > count:
                parts.append((before - after, before - count))
    return ratio_of(parts)


def _after(cases: Sequence[Judged]) -> Score:
    chosen = [c.verdict.heldout for c in cases if _of("single", 5.0)(c) and c.verdict.heldout is not None]
    return median_of([after / count for _, after, count in chosen])


def outside(case: Judged) -> bool:
    return case.label.cls in ("foreign", "deleted") and case.label.distance >= FAR_OUTSIDE


def far_outside(case: Judged) -> bool:
    """Whether not even two effects of the library together come near."""
    return outside(case) and (case.label.pair_distance or 0.0) >= APART


def _flagged(case: Judged) -> bool:
    near = [kind for kind, far in case.label.nearest.items() if far < SAME]
    kinds = mentioned(case.verdict)
    return case.verdict.verdict == "ambiguous" and case.label.kinds[0] in kinds and bool(kinds & set(near))


def _weight_named(case: Judged) -> bool:
    if case.label.wrong_weight is None or case.verdict.verdict != "adequate":
        return False
    sequence, step, _, _ = case.label.wrong_weight
    wanted = f"sequence s{sequence + 1}, step {step + 1}: the weight on "
    return any(remark.startswith(wanted) for remark in case.verdict.remarks)


def _pair(case: Judged) -> bool:
    return case.label.cls == "pair" and case.label.distance >= APART


def _false_constant(which: str) -> Callable[[Sequence[Judged]], Score]:
    """Error of E in the class where calibration hides the effect."""

    def measure(cases: Sequence[Judged]) -> Score:
        found = []
        for case in cases:
            values = case.verdict.loading if which == "loading" else getattr(case.verdict, which)
            if case.label.cls == "hidden" and values is not None and case.verdict.verdict != "failed":
                found.append(abs(float(np.expm1(values[0] - case.label.constants[0]))))
        return median_of(found)

    return measure


GOALS: tuple[Goal, ...] = (
    Goal("clean sets with a named effect", "<=", (0.01,), _share(_of("clean"), named_or_failed)),
    Goal("right effect first, at 2 times detectable", ">=", (0.95,), _first(2.0)),
    Goal("right effect first, at 5 times detectable", ">=", (0.99,), _first(5.0)),
    Goal(
        "truth among named and indistinguishable",
        ">=",
        (0.98,),
        _share(_of("single", 2.0, 5.0), lambda c: c.label.kinds[0] in mentioned(c.verdict)),
    ),
    Goal(
        "plate exactly",
        ">=",
        (0.92,),
        _share(lambda c: _placed(c) and not c.label.places, lambda c: plate_error(c) == 0),
    ),
    Goal("plate within one", ">=", (0.99,), _share(_placed, lambda c: plate_error(c) <= 1)),
    Goal("95 % intervals cover", "in", (0.90, 0.98), _covering),
    Goal("parameter error at 5 times, median", "<=", (0.05,), _errors),
    Goal("held-out excess error removed", ">=", (0.90,), _heldout),
    Goal(
        "both of a pair named",
        ">=",
        (0.80,),
        _share(_pair, lambda c: set(c.label.kinds) <= {each.kind for each in confident(c.verdict)}),
    ),
    Goal(
        "outside the library: `unexplained`",
        ">=",
        (0.90,),
        _share(outside, lambda c: c.verdict.verdict == "unexplained"),
    ),
    Goal(
        "outside the library: wrong confident name",
        "<=",
        (0.03,),
        _share(outside, lambda c: bool(confident(c.verdict)) or failed(c)),
    ),
    Goal("confusable flagged", ">=", (0.98,), _share(_of("confusable"), _flagged)),
)
FOLLOWED = Goal("proposed experiment resolves the pair", ">=", (0.90,), lambda cases: share_of([]))
INFORMATION: tuple[Goal, ...] = (
    Goal("clean sets not adequate", "", (), _share(_of("clean"), lambda c: c.verdict.verdict != "adequate")),
    Goal(
        "right effect first, at the detectable size",
        "",
        (),
        _share(lambda c: _of("single", 1.0)(c) and c.label.distinguishable, first_right),
    ),
    Goal(
        "effect at the detectable size noticed",
        "",
        (),
        _share(_of("single", 1.0), lambda c: c.verdict.verdict not in ("adequate", "failed")),
    ),
    Goal(
        "pairs: truth named or indistinguishable, both",
        "",
        (),
        _share(_pair, lambda c: set(c.label.kinds) <= mentioned(c.verdict)),
    ),
    Goal(
        "wrong weight: adequate, and its step named",
        "",
        (),
        _share(lambda c: c.label.wrong_weight is not None, _weight_named),
    ),
    Goal(
        "outside, two effects together included: `unexplained`",
        "",
        (),
        _share(far_outside, lambda c: c.verdict.verdict == "unexplained"),
    ),
    Goal(
        "outside, two effects together included: wrong confident name",
        "",
        (),
        _share(far_outside, lambda c: bool(confident(c.verdict)) or failed(c)),
    ),
    Goal("decoys with a named effect", "", (), _share(_of("decoy"), named_or_failed)),
    Goal("held-out chi-square a reading, median", "", (), _after),
    Goal("calibration hides it: true effect first", "", (), _share(_of("hidden"), first_right)),
    Goal(
        "calibration hides it: loading alone fits (p > 0.01)",
        "",
        (),
        _share(
            lambda c: c.label.cls == "hidden" and c.verdict.loading is not None,
            lambda c: c.verdict.loading is not None and c.verdict.loading[2] > 0.01,
        ),
    ),
    Goal("calibration hides it: error of E, loading alone, median", "", (), _false_constant("loading")),
    Goal("calibration hides it: error of E, all sequences, median", "", (), _false_constant("calibrated")),
    Goal("calibration hides it: error of E, explained, median", "", (), _false_constant("explained")),
    Goal("failed", "", (), _share(lambda c: True, lambda c: c.verdict.verdict == "failed")),
)


def worth(verdict: Verdict) -> Proposal | None:
    """The first proposal that promises to tell two explanations apart; it is carried out."""
    return next((each for each in verdict.proposals if each.separation >= APART), None)


def tested(case: Judged) -> Proposal | None:
    """The proposal that is carried out, if the truth is one of the two effects that it is to tell apart."""
    proposal = worth(case.verdict)
    if case.label.cls not in ("single", "confusable", "hidden") or case.verdict.verdict != "ambiguous":
        return None
    true = [] if proposal is None else [kind_of(name) == case.label.kinds[0] for name in (proposal.one, proposal.other)]
    return proposal if sum(true) == 1 else None


def resolved(first: Judged, second: Verdict) -> bool:
    """Whether after the proposed experiment the truth is named first and the rival that it was to refute is gone."""
    proposal, named = tested(first), confident(second)
    if proposal is None or not named or named[0].kind != first.label.kinds[0]:
        return False
    other = proposal.other if kind_of(proposal.one) == first.label.kinds[0] else proposal.one
    return all(other != name_of(kind, place) for each in named for kind, place, *_ in each.rivals)
