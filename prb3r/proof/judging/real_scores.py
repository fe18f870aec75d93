"""Scores of real rigs: several effects at once, imperfections, other loads, another design, blunders."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from prb3r.proof.concealed.elsewhere import OTHER_DESIGN, OTHER_LOADS
from prb3r.proof.judging.goals import Goal, Measure, Test, share_measure
from prb3r.proof.judging.intervals import Score, mean_of, median_of, quantile_of, share_of
from prb3r.proof.judging.methods import kind_of
from prb3r.proof.judging.opened import OpenedCase, failed, mentioned, places_agree
from prb3r.proof.judging.verdict import Claim
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.settings import SETTINGS

REAL = SETTINGS.real


def of_class(*classes: str) -> Test:
    """The test whether a recording is of one of some classes."""
    return lambda case: case.label.cls in classes


def is_hit(claim: Claim, true: Mapping[str, Any]) -> bool:
    """Whether a claim has the kind of a true effect and its place, or one of its places among those not told apart."""
    if claim.kind != true["kind"]:
        return False
    return all(
        any(places_agree(value, true.get(name)) for value in (claim.place.get(name), *claim.sets.get(name, ())))
        for name in RECORDS[claim.kind].places
    )


def named_of(case: OpenedCase) -> list[bool]:
    """For every true effect, whether it is named."""
    return [any(is_hit(claim, true) for claim in case.verdict.named) for true in case.label.effects]


def wrong_of(case: OpenedCase) -> list[bool]:
    """For every named effect, whether the rig has none of its kind."""
    return [claim.kind not in case.label.kinds for claim in case.verdict.named]


def misplaced(case: OpenedCase) -> list[bool]:
    """For every named effect, whether the rig has its kind, but at another place."""
    true = case.label.effects
    return [c.kind in case.label.kinds and not any(is_hit(c, effect) for effect in true) for c in case.verdict.named]


def whole_set(case: OpenedCase) -> bool:
    """Whether all true effects are named at their places, and no others."""
    return all(named_of(case)) and len(case.verdict.named) == len(case.label.effects)


def listed_set(case: OpenedCase) -> bool:
    """Whether all true effects and no others are named, or a surviving model has just the true kinds."""
    true = sorted(case.label.kinds)
    return whole_set(case) or any(sorted(map(kind_of, model)) == true for model in case.verdict.models)


def surviving_kinds(case: OpenedCase) -> set[str]:
    """Kinds that are named, listed as indistinguishable, or part of a surviving model."""
    return mentioned(case.verdict) | {kind_of(name) for model in case.verdict.models for name in model}


REFUSED = {"angle_rad is in degrees": "degrees? write radians"}
"""Blunders for which the reading of a recording may refuse it, and the words by which it does."""


def blunder_said(case: OpenedCase) -> bool:
    """Whether the blunder that was made is said, is among those said to look the same, or is why the recording is
    refused."""
    assert case.label.blunder is not None
    blunder = case.label.blunder["said"]
    return any(blunder in said for said in case.verdict.setup) or REFUSED.get(blunder, blunder) in case.verdict.reason


def _pooled(chosen: Test, outcomes: Callable[[OpenedCase], Sequence[bool]]) -> Measure:
    """The measure of the share of true outcomes over all effects or names of the chosen recordings; those of one design
    are one cluster (a real rig's recording has a design of its own)."""

    def measure(cases: Sequence[OpenedCase]) -> Score:
        of = [(case.label.design, list(outcomes(case))) for case in cases if chosen(case)]
        flat = [hit for _, hits in of for hit in hits]
        return share_of(flat, [design for design, hits in of for _ in hits])

    return measure


def _worthy(case: OpenedCase) -> list[bool]:
    """For every true effect that is worth enough, whether it is named."""
    return [hit for hit, worth in zip(named_of(case), case.label.worth, strict=True) if worth >= REAL.worth]


def _rare_named(case: OpenedCase) -> list[bool]:
    """Whether the rare effect, the first, is named; empty if it is not worth enough."""
    return named_of(case)[:1] if case.label.worth[0] >= REAL.worth else []


def _unexplained(case: OpenedCase) -> bool:
    return case.verdict.verdict == "unexplained"


def _told_apart(case: OpenedCase) -> list[bool]:
    """For every true effect that is worth enough, whether it is far from every kind that the rig lacks; empty where
    distances are unknown."""
    return [
        far >= SETTINGS.sizes.apart
        for far, worth in zip(case.label.apart, case.label.worth, strict=False)
        if worth >= REAL.worth
    ]


def _named_if_told_apart(case: OpenedCase) -> list[bool]:
    """For every true effect that is worth enough and can be told apart, whether it is named."""
    return [
        hit
        for hit, far, worth in zip(named_of(case), case.label.apart, case.label.worth, strict=False)
        if worth >= REAL.worth and far >= SETTINGS.sizes.apart
    ]


def _worthy_listed(case: OpenedCase) -> list[bool]:
    """For every true effect that is worth enough, whether its kind is named, listed or in a surviving model."""
    listed = surviving_kinds(case)
    return [
        kind in listed for kind, worth in zip(case.label.kinds, case.label.worth, strict=True) if worth >= REAL.worth
    ]


def _all_worthy(case: OpenedCase) -> bool:
    """Whether the recording has several effects, each of which is worth enough."""
    return HAS_SEVERAL(case) and min(case.label.worth) >= REAL.worth


def _removed(name: str, worst: bool) -> Measure:
    """The measure of the share of excess error removed at a target: in the worst tenth, or the median."""

    def measure(cases: Sequence[OpenedCase]) -> Score:
        values = [m.removed for case in cases if HAS_SEVERAL(case) for m in case.missed if m.name == name and m.counts]
        return quantile_of(values, REAL.worst) if worst else median_of(values)

    return measure


def _covered(name: str) -> Measure:
    """The measure of the mean coverage of the bands at a target, over recordings of real rigs."""
    return lambda cases: mean_of([m.covered for c in cases if c.label.build for m in c.missed if m.name == name])


def _seconds(slow: bool, worst: bool) -> Measure:
    """The measure of processor time, longest or median, of real rigs with friction along the path (`slow`) or not."""

    def measure(cases: Sequence[OpenedCase]) -> Score:
        values = [c.verdict.seconds for c in cases if c.label.build and c.label.follows_path == slow]
        return quantile_of(values, 1.0) if worst else median_of(values)

    return measure


HAS_SEVERAL, HAS_RARE, _CLEAN = of_class("several"), of_class("rare"), of_class("imperfect-clean")
_BLUNDERED = of_class("blunder")
REAL_GOALS: tuple[Goal, ...] = (
    Goal(
        "imperfect clean rigs: adequate",
        ">=",
        (0.95,),
        share_measure(_CLEAN, lambda c: c.verdict.verdict == "adequate"),
        "real clean",
    ),
    Goal(
        "imperfect clean rigs: an effect named",
        "<=",
        (0.02,),
        share_measure(_CLEAN, lambda c: bool(c.verdict.named) or failed(c)),
    ),
    Goal(
        "imperfect rigs, five times detectable: named or among the alternatives",
        ">=",
        (0.95,),
        share_measure(of_class("imperfect-single"), lambda c: c.label.kinds[0] in surviving_kinds(c)),
    ),
    Goal(
        f"several: effects worth {REAL.worth:g} sd at other loads named",
        ">=",
        (0.9,),
        _pooled(HAS_SEVERAL, _worthy),
        "several named",
    ),
    Goal("several: names that are wrong", "<=", (0.05,), _pooled(HAS_SEVERAL, wrong_of), "several wrong"),
    Goal("several: all named and none beside", ">=", (0.7,), share_measure(HAS_SEVERAL, whole_set)),
    Goal("several: all in a surviving set", ">=", (0.9,), share_measure(HAS_SEVERAL, listed_set)),
    Goal("other loads: excess error removed, median", ">=", (0.95,), _removed(OTHER_LOADS, False)),
    Goal("other loads: excess error removed, worst tenth", ">=", (0.8,), _removed(OTHER_LOADS, True)),
    Goal("another design: excess error removed, median", ">=", (0.9,), _removed(OTHER_DESIGN, False), "other design"),
    Goal("another design: excess error removed, worst tenth", ">=", (0.7,), _removed(OTHER_DESIGN, True)),
    Goal("other loads: 95 % bands cover", "in", (0.9, 0.98), _covered(OTHER_LOADS)),
    Goal("another design: 95 % bands cover", "in", (0.9, 0.98), _covered(OTHER_DESIGN)),
    Goal("blunders said by name", ">=", (0.95,), share_measure(_BLUNDERED, blunder_said), "blunders"),
    Goal(
        "blunders said where there is none",
        "<=",
        (0.005,),
        share_measure(lambda c: c.label.blunder is None, lambda c: bool(c.verdict.setup)),
    ),
    Goal("real rigs, declared slip: seconds, median", "<=", REAL.seconds[:1], _seconds(False, False)),
    Goal("real rigs, declared slip: seconds, longest", "<=", REAL.seconds[1:], _seconds(False, True)),
    Goal("real rigs, history: seconds, median", "<=", REAL.history_seconds[:1], _seconds(True, False)),
    Goal("real rigs, history: seconds, longest", "<=", REAL.history_seconds[1:], _seconds(True, True)),
)
REAL_INFORMATION: tuple[Goal, ...] = (
    Goal("several: all effects named", "", (), _pooled(HAS_SEVERAL, named_of)),
    Goal(f"several: worth {REAL.worth:g} sd, share that can be told apart", "", (), _pooled(HAS_SEVERAL, _told_apart)),
    Goal(
        f"several: worth {REAL.worth:g} sd and can be told apart: named",
        "",
        (),
        _pooled(HAS_SEVERAL, _named_if_told_apart),
    ),
    Goal(
        f"several, every one worth {REAL.worth:g} sd: all named and none beside",
        "",
        (),
        share_measure(_all_worthy, whole_set),
    ),
    Goal(
        f"several, every one worth {REAL.worth:g} sd: all in a surviving set",
        "",
        (),
        share_measure(_all_worthy, listed_set),
    ),
    Goal("several: explained", "", (), share_measure(HAS_SEVERAL, lambda c: c.verdict.verdict == "explained")),
    Goal("several: unexplained", "", (), share_measure(HAS_SEVERAL, _unexplained)),
    Goal(
        f"several: worth {REAL.worth:g} sd, named or in a surviving set", "", (), _pooled(HAS_SEVERAL, _worthy_listed)
    ),
    Goal("several: right kinds at a wrong place, of names", "", (), _pooled(HAS_SEVERAL, misplaced)),
    Goal(
        f"rare beside others: the rare one, if worth {REAL.worth:g} sd, named", "", (), _pooled(HAS_RARE, _rare_named)
    ),
    Goal(f"rare beside others: effects worth {REAL.worth:g} sd named", "", (), _pooled(HAS_RARE, _worthy)),
    Goal("rare beside others: names that are wrong", "", (), _pooled(HAS_RARE, wrong_of)),
    Goal(
        "rare beside others: unexplained", "", (), share_measure(HAS_RARE, lambda c: c.verdict.verdict == "unexplained")
    ),
)
