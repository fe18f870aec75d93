"""Judges one opened recording: whether the verdict has effect, place and numbers right."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from prb3r.proof.concealed.labels import Label
from prb3r.proof.judging.missed import Missed
from prb3r.proof.judging.verdict import Claim, Verdict
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.settings import SETTINGS


class OpenedCase(NamedTuple):
    """A recording whose label is known, with the verdict on it."""

    label: Label
    verdict: Verdict
    friction: float
    """True friction coefficient of the rig."""
    missed: tuple[Missed, ...] = ()
    """Errors of predictions for other loads and another design."""


def size_class(label: Label) -> float:
    """The size of the population, in smallest detectable ones, that a label counts as, by its norm."""
    sizes, chosen = sorted(SETTINGS.population.multiples, reverse=True), SETTINGS.sizes
    for size in sizes[:-1]:
        if label.norm > chosen.class_margin * size * chosen.detectable:
            return size
    return sizes[-1]


def confident(verdict: Verdict) -> tuple[Claim, ...]:
    """The effects that an `explained` or `ambiguous` verdict names; none of any other verdict."""
    return verdict.named if verdict.verdict in ("explained", "ambiguous") else ()


def failed(case: OpenedCase) -> bool:
    """Whether there is no verdict: the method raised an error, or the rig could not be recorded."""
    return case.verdict.verdict == "failed"


def named_or_failed(case: OpenedCase) -> bool:
    """Whether the verdict names any effect, or failed, which counts as an error."""
    return bool(case.verdict.named) or failed(case)


def first_right(case: OpenedCase) -> bool:
    """Whether the kind that a confident verdict names first is the true one."""
    named = confident(case.verdict)
    return bool(named) and named[0].kind == case.label.kinds[0]


def mentioned(verdict: Verdict) -> set[str]:
    """Kinds that a confident verdict names or lists as indistinguishable from what it names."""
    named = confident(verdict)
    return {claim.kind for claim in named} | {rival[0] for claim in named for rival in claim.rivals}


def right_claim(case: OpenedCase) -> Claim | None:
    """The first claim of a confident verdict with kind and place of the first true effect; None if there is none."""
    true = case.label.effects[0]
    for claim in confident(case.verdict):
        if claim.kind == true["kind"] and all(
            places_agree(claim.place.get(name), true.get(name)) for name in RECORDS[claim.kind].places
        ):
            return claim
    return None


def places_agree(said: Any, true: Any) -> bool:
    """Whether two values of a place parameter are equal; lists may be in any order."""
    listed = lambda value: sorted(map(str, value)) if isinstance(value, list | tuple) else str(value)  # noqa: E731
    return listed(said) == listed(true)


def plate_of(kind: str, place: Mapping[str, Any]) -> int | None:
    """Number of the plate or disk of an effect that acts at just one; None for any other effect.

    `place` may be all parameters of the effect.
    """
    for name, counted in RECORDS[kind].places.items():
        if counted in ("plates", "disks") and place.get(name) is not None:
            numbers = np.atleast_1d(place[name])
            return int(numbers[0]) if len(numbers) == 1 else None
    return None


def plate_error(case: OpenedCase) -> float:
    """Number of plates by which the named place is off; infinite where the true kind is not named."""
    kind = case.label.kinds[0]
    true = plate_of(kind, case.label.effects[0])
    named = [claim for claim in confident(case.verdict) if claim.kind == kind]
    said = plate_of(kind, named[0].place) if named else None
    return np.inf if true is None or said is None else abs(said - true)


def parameters(case: OpenedCase) -> list[tuple[float, bool | None]]:
    """Relative error of every parameter of the one true effect, and whether its interval covers the truth (None: there
    is no interval).

    Empty if the effect is not named at its place; an infinite error that is not covered for a failed verdict.
    """
    claim, true = right_claim(case), case.label.effects[0]
    if failed(case):
        return [(np.inf, False)]
    if claim is None:
        return []
    record = RECORDS[claim.kind]
    errors, sizes, covered = [], [], []
    for name, (value, low, high) in claim.parameters.items():
        deviation = record.scales[name].deviation
        sizes.append(deviation(true[name], case.friction))
        errors.append(deviation(value, case.friction) - sizes[-1])
        covered.append(None if low is None or high is None else bool(low <= true[name] <= high))
    if record.vector:
        return [(float(np.linalg.norm(errors) / np.linalg.norm(sizes)), hit) for hit in covered]
    return [(abs(error / whole), hit) for error, whole, hit in zip(errors, sizes, covered, strict=True)]
