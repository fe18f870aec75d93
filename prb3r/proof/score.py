"""Scores with their intervals, from opened labels and the verdicts on their recordings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binom, norm

from prb3r.proof.labels import FAR_OUTSIDE, Label
from prb3r.proof.methods import Claim, Verdict
from prb3r.proof.responses import APART, NORM, SAME

CONFIDENCE = 0.95
DRAWS = 2000


class Judged(NamedTuple):
    """A recording, opened."""

    label: Label
    verdict: Verdict
    friction: float
    """True coefficient."""


@dataclass(frozen=True)
class Goal:
    """One line of the table."""

    name: str
    relation: str
    """`>=`, `<=`, `in`, or empty for information."""
    asked: tuple[float, ...]
    measure: Callable[[Sequence[Judged]], "Score"]


@dataclass(frozen=True)
class Score:
    """A share, a median or a ratio, with its 95 % interval."""

    value: float
    low: float
    high: float
    count: int
    hits: int | None = None
    """Of a share."""

    def met(self, goal: Goal) -> bool | None:
        """By the point estimate; None without data or goal."""
        return _within(goal, self.value, self.value) if self.count else None

    def shown(self, goal: Goal) -> bool | None:
        """By the whole interval."""
        return _within(goal, self.low, self.high) if self.count else None


def _within(goal: Goal, low: float, high: float) -> bool | None:
    if not goal.relation:
        return None
    if goal.relation == ">=":
        return bool(low >= goal.asked[0])
    if goal.relation == "<=":
        return bool(high <= goal.asked[0])
    return bool(low >= goal.asked[0] and high <= goal.asked[1])


def wilson(hits: int, count: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Wilson's interval of a share [J. Am. Stat. Assoc. 22 (1927) 209]."""
    if count == 0:
        return 0.0, 1.0
    z = float(norm.isf((1 - confidence) / 2))
    share, width = hits / count, z**2 / count
    middle = (share + width / 2) / (1 + width)
    half = z * np.sqrt(share * (1 - share) / count + width / (4 * count)) / (1 + width)
    return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))


def share_of(found: Sequence[bool]) -> Score:
    """A share and Wilson's interval."""
    hits, count = int(sum(found)), len(found)
    return Score(hits / count if count else np.nan, *wilson(hits, count), count, hits)


def median_of(values: Sequence[float]) -> Score:
    """A median and the interval between order statistics that covers it."""
    ordered = np.sort(np.asarray(values, float))
    count = len(ordered)
    if not count:
        return Score(np.nan, np.nan, np.nan, 0)
    low = int(binom.ppf((1 - CONFIDENCE) / 2, count, 0.5))
    low, high = max(low - 1, 0), min(count - low, count - 1)
    return Score(float(np.median(ordered)), float(ordered[low]), float(ordered[high]), count)


def ratio_of(parts: Sequence[tuple[float, float]]) -> Score:
    """Sum over sum, with a bootstrapped interval."""
    pairs = np.asarray(parts, float).reshape(-1, 2)
    if not len(pairs):
        return Score(np.nan, np.nan, np.nan, 0)
    drawn = pairs[np.random.default_rng(0).integers(len(pairs), size=(DRAWS, len(pairs)))].sum(1)
    low, high = np.quantile(drawn[:, 0] / drawn[:, 1], [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    whole = pairs.sum(0)
    return Score(float(whole[0] / whole[1]), float(low), float(high), len(pairs))


def size_class(label: Label) -> float:
    """1, 2 or 5 times the smallest detectable size; of an effect without a size, by its norm."""
    return 5.0 if label.norm > 4.5 * NORM else 2.0 if label.norm > 1.8 * NORM else 1.0


def confident(verdict: Verdict) -> tuple[Claim, ...]:
    """What is named without reserve."""
    return verdict.named if verdict.verdict in ("explained", "ambiguous") else ()


def failed(case: Judged) -> bool:
    return case.verdict.verdict == "failed"


def named_or_failed(case: Judged) -> bool:
    """A crash counts against every score it belongs to."""
    return bool(case.verdict.named) or failed(case)


def first_right(case: Judged) -> bool:
    named = confident(case.verdict)
    return bool(named) and named[0].kind == case.label.kinds[0]


def mentioned(verdict: Verdict) -> set[str]:
    """Kinds that are named or listed as indistinguishable."""
    named = confident(verdict)
    return {each.kind for each in named} | {rival[0] for each in named for rival in each.rivals}


def own_claim(case: Judged) -> Claim | None:
    """The claim that is of the true kind, at the true place."""
    true = case.label.effects[0]
    for claim in confident(case.verdict):
        if claim.kind == true["kind"] and all(_same(claim.place.get(key), true.get(key)) for key in PLACES):
            return claim
    return None


PLACES = ("plate", "plates", "disk", "cable", "cables", "segment", "law")


def _same(one: Any, other: Any) -> bool:
    listed = lambda value: sorted(map(str, value)) if isinstance(value, list | tuple) else str(value)  # noqa: E731
    return listed(one) == listed(other)


def _plate(place: Mapping[str, Any]) -> int | None:
    """The one plate, or disk, of an effect that sits at one."""
    plates = place.get("plates")
    if plates is not None:
        return int(plates[0]) if len(plates) == 1 else None
    found = place.get("plate", place.get("disk"))
    return None if found is None else int(found)


def plate_error(case: Judged) -> float:
    """By how many plates the place is missed; infinite where the kind is."""
    true = _plate(case.label.effects[0])
    named = [each for each in confident(case.verdict) if each.kind == case.label.kinds[0]]
    found = _plate(named[0].place) if named else None
    return np.inf if true is None or found is None else abs(found - true)


LOGARITHMIC = {"factor", "efficiency", "scale", "ratio", "presliding_m"}


def _deviation(name: str, value: float, friction: float) -> float:
    """How far a parameter is from no effect."""
    if name in LOGARITHMIC:
        return float(np.log(value))
    return value - friction if name == "coefficient" else value


def parameters(case: Judged) -> list[tuple[float, bool | None]]:
    """Relative error of every parameter of the one true effect, and whether its interval covers it."""
    claim, true = own_claim(case), case.label.effects[0]
    if failed(case):
        return [(np.inf, False)]
    if claim is None:
        return []
    friction = case.friction if true["kind"] == "worn_hole" else 0.0
    deviations, covered = [], []
    for name, (value, low, high) in claim.parameters.items():
        there, here = (_deviation(name, v, friction) for v in (true[name], value))
        deviations.append((here - there, there))
        covered.append(None if low is None or high is None else bool(low <= true[name] <= high))
    if true["kind"] in ("gravity", "tip_force"):
        away, whole = np.array(deviations).T
        return [(float(np.linalg.norm(away) / np.linalg.norm(whole)), one) for one in covered]
    return [(abs(d / w), one) for (d, w), one in zip(deviations, covered, strict=True)]


def _of(cls: str, *sizes: float) -> Callable[[Judged], bool]:
    return lambda case: case.label.cls == cls and (not sizes or size_class(case.label) in sizes)


def _share(chosen: Callable[[Judged], bool], hit: Callable[[Judged], bool]) -> Callable[[Sequence[Judged]], Score]:
    return lambda cases: share_of([hit(case) for case in cases if chosen(case)])


def _first(size: float) -> Callable[[Sequence[Judged]], Score]:
    return _share(lambda case: _of("single", size)(case) and case.label.distinguishable, first_right)


def _placed(case: Judged) -> bool:
    label = case.label
    return _of("single", 2.0, 5.0)(case) and label.distinguishable and _plate(label.effects[0]) is not None


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


def _flagged(case: Judged) -> bool:
    near = [kind for kind, far in case.label.nearest.items() if far < SAME]
    kinds = mentioned(case.verdict)
    return case.verdict.verdict == "ambiguous" and case.label.kinds[0] in kinds and bool(kinds & set(near))


def _weight_named(case: Judged) -> bool:
    if case.label.wrong_weight is None or case.verdict.verdict != "adequate":
        return False
    sequence, step, cable, _ = case.label.wrong_weight
    wanted = f"sequence s{sequence + 1}, step {step + 1}: the weight on cable {cable}"
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
        "wrong weight: adequate and named as a wrong weight",
        "",
        (),
        _share(lambda c: c.label.wrong_weight is not None, _weight_named),
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


def resolved(first: Judged, second: Verdict) -> bool:
    """Whether after the proposed experiment the truth is named first and its rival is gone."""
    proposal = tested(first)
    named = confident(second)
    if proposal is None or not named or named[0].kind != first.label.kinds[0]:
        return False
    other = proposal.other if proposal.one == first.label.kinds[0] else proposal.one
    return other not in mentioned(second)


def tested(case: Judged):
    """The proposal that is worth an experiment: the truth is one of the two, and they would come apart."""
    if case.label.cls not in ("single", "confusable", "hidden") or case.verdict.verdict != "ambiguous":
        return None
    true = case.label.kinds[0]
    good = [
        p for p in case.verdict.proposals if p.separation >= APART and true in (p.one, p.other) and p.one != p.other
    ]
    return good[0] if good else None


def confusion(cases: Sequence[Judged]) -> tuple[list[str], list[str], np.ndarray]:
    """True kinds, named kinds and counts, of single effects at 2 and 5 times the detectable size."""
    chosen = [case for case in cases if _of("single", 2.0, 5.0)(case)]
    rows = sorted({case.label.kinds[0] for case in chosen})
    columns = [*rows, "another kind", "adequate", "unexplained", "failed"]
    table = np.zeros((len(rows), len(columns)), int)
    for case in chosen:
        named = confident(case.verdict)
        said = named[0].kind if named else case.verdict.verdict
        said = said if said in columns else "another kind"
        table[rows.index(case.label.kinds[0]), columns.index(said)] += 1
    return rows, columns, table


def by_effect(cases: Sequence[Judged]) -> list[dict[str, Any]]:
    """Right first, by kind and size."""
    out = []
    chosen = [case for case in cases if case.label.cls == "single"]
    for kind in sorted({case.label.kinds[0] for case in chosen}):
        for size in (1.0, 2.0, 5.0):
            own = [c for c in chosen if c.label.kinds[0] == kind and size_class(c.label) == size]
            apart = [first_right(c) for c in own if c.label.distinguishable]
            if own:
                right = share_of(apart)
                among = share_of([c.label.kinds[0] in mentioned(c.verdict) for c in own])
                out.append({"kind": kind, "size": size, "first": right, "among": among})
    return out
