"""One opened recording: whether the verdict has the effect, the place and the numbers right."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from prb3r.proof.concealed.labels import Label
from prb3r.proof.concealed.responses import NORM
from prb3r.proof.judging.methods import Claim, Verdict


class Judged(NamedTuple):
    """A recording, opened."""

    label: Label
    verdict: Verdict
    friction: float
    """True coefficient."""


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


def plate_of(place: Mapping[str, Any]) -> int | None:
    """The one plate, or disk, of an effect that sits at one."""
    plates = place.get("plates")
    if plates is not None:
        return int(plates[0]) if len(plates) == 1 else None
    found = place.get("plate", place.get("disk"))
    return None if found is None else int(found)


def plate_error(case: Judged) -> float:
    """By how many plates the place is missed; infinite where the kind is."""
    true = plate_of(case.label.effects[0])
    named = [each for each in confident(case.verdict) if each.kind == case.label.kinds[0]]
    found = plate_of(named[0].place) if named else None
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
