"""Hypotheses on several rigs together: what they have in common, and what is each one's own.

Rigs of one make share what belongs to their material and to the pair of surfaces that rubs.  Everything else is a
rig's own, and a rig may prove to have its own where it should not.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.library.suspect import Group, Shared

SHARED: Mapping[str, Shared] = MappingProxyType(
    {kind: suspect.shared for kind, suspect in SUSPECTS.items() if suspect.shared}
)
"""Kinds that rigs may share, as their records say."""
CONSTANT_GROUPS: Mapping[str, Group] = MappingProxyType({"log_stiffness": "material", "log_friction": "friction"})
"""Constants that rigs may share."""
IN_CURVATURE = frozenset({"knee_per_m", "cubic_m2", "yield_per_m"})
"""Parameters of bending laws that mean the same on equal sections only."""


class Slot(NamedTuple):
    """A free parameter of a joint hypothesis."""

    rig: int | None
    """Whose it is; None: of all that the hypothesis is about."""
    free: Free


@dataclass(frozen=True)
class JointHypothesis:
    """An effect of one rig, one that several have in common, or a constant that one rig has for itself."""

    kind: str
    parts: tuple[Hypothesis | None, ...]
    """(rigs,) the effect as each rig has it."""
    common: tuple[str, ...] = ()
    """Names of the free parameters that have one value on all its rigs."""
    parting: Free | None = None
    """By how much a constant is off the shared one, on the one rig of `rigs`; then there are no parts."""
    parted: int | None = None
    """Number of the rig whose constant `parting` is off; None without one."""

    @cached_property
    def rigs(self) -> tuple[int, ...]:
        """Numbers of the rigs that it is about."""
        return tuple(k for k, part in enumerate(self.parts) if part is not None or k == self.parted)

    @property
    def first(self) -> Hypothesis | None:
        """The effect as the first of its rigs has it."""
        return next((part for part in self.parts if part is not None), None)

    @cached_property
    def slots(self) -> tuple[Slot, ...]:
        """Its free parameters: those in common, then those of each rig."""
        if self.parting is not None:
            return (Slot(self.parted, self.parting),)
        first = self.first
        shared = [Slot(None, free) for free in first.free if free.name in self.common] if first else []
        unshared = [
            Slot(k, free)
            for k, part in enumerate(self.parts)
            if part is not None
            for free in part.free
            if free.name not in self.common
        ]
        return (*shared, *unshared)

    @cached_property
    def free(self) -> tuple[Free, ...]:
        """The parameters that are fitted, those in common once."""
        return tuple(slot.free for slot in self.slots)

    def places(self, rig: int) -> list[int]:
        """Where the parameters of the effect on one rig stand among `free`, in their order there."""
        part = self.parts[rig]
        keys = [(slot.rig, slot.free.name) for slot in self.slots]
        return (
            [keys.index((None if free.name in self.common else rig, free.name)) for free in part.free] if part else []
        )

    @property
    def by_degrees(self) -> bool:
        """Whether every part comes by degrees (`Hypothesis.by_degrees`); a constant that parts always does."""
        return self.parting is not None or all(part.by_degrees for part in self.parts if part)

    @property
    def kinked(self) -> bool:
        """Whether the part of any rig is (`Hypothesis.kinked`)."""
        return any(part.kinked for part in self.parts if part)

    def sided(self, frictions: Sequence[float]) -> bool:
        """Whether a part is (`Hypothesis.sided`), beside the coefficient of its rig."""
        return any(part.sided(friction) for part, friction in zip(self.parts, frictions, strict=True) if part)

    @property
    def costly(self) -> bool:
        """Whether the part of any rig is (`Hypothesis.costly`)."""
        return any(part.costly for part in self.parts if part)

    @property
    def name(self) -> str:
        """What and, of an effect that is not shared, on which rig, counted from 1."""
        first = self.first
        text = self.kind if first is None else first.name
        return text if len(self.rigs) > 1 else f"{text} on rig {self.rigs[0] + 1}"

    def excludes(self, other: "JointHypothesis") -> bool:
        """Whether a joint model cannot have both: on some rig one excludes the other or is the same."""
        if self == other or (self.parting and other.parting and (self.kind, self.parted) == (other.kind, other.parted)):
            return True
        pairs = zip(self.parts, other.parts, strict=True)
        return any(here and there and (here.excludes(there) or _alike(here, there)) for here, there in pairs)

    def starts(self, frictions: Sequence[float]) -> list[np.ndarray]:
        """Points `u` from which a fit begins, beside the calibrated coefficient of every rig."""
        if self.parting is not None:
            return [np.zeros(1)]
        probes = [part.starts(friction) if part else None for part, friction in zip(self.parts, frictions, strict=True)]
        count = min(len(of_rig) for of_rig in probes if of_rig is not None)
        out = []
        for k in range(count):
            u = np.zeros(len(self.slots))
            for rig in reversed(self.rigs):  # the first has the last word on what is in common
                u[self.places(rig)] = probes[rig][k]  # type: ignore[index]
            out.append(u)
        return out


def _alike(first: Hypothesis, other: Hypothesis) -> bool:
    """Whether two are the same effect at the same place, with other bounds."""
    return (first.kind, first.place) == (other.kind, other.place)


def alone_on(rig: int, hypothesis: Hypothesis, count: int) -> JointHypothesis:
    """The effect as one that rig `rig` of `count`, counted from 0, has alone."""
    parts = tuple(hypothesis if k == rig else None for k in range(count))
    return JointHypothesis(hypothesis.kind, parts)


def in_common(
    libraries: Sequence[Sequence[Hypothesis]], groups: Mapping[Group, tuple[int, ...]], same_sections: bool
) -> Iterator[JointHypothesis]:
    """What all rigs of a group may have in common: the kinds of `SHARED` at places that every one of them has.

    `same_sections`: whether laws in curvature mean the same on all rigs with the same material.
    """
    for kind, (group, names) in SHARED.items():
        rigs = groups.get(group, ())
        if len(rigs) < 2:
            continue
        for hypothesis in libraries[rigs[0]]:
            if hypothesis.kind != kind:
                continue
            keys = {free.name for free in hypothesis.free}
            counterparts = [_counterpart(hypothesis, libraries[rig]) for rig in rigs]
            cut = keys & IN_CURVATURE and not same_sections
            if "cables" in dict(hypothesis.place) or cut or None in counterparts:
                continue
            parts = _merged([part for part in counterparts if part], names)
            by_rig = dict(zip(rigs, parts, strict=True))
            common = tuple(free.name for free in hypothesis.free if names is None or free.name in names)
            yield JointHypothesis(kind, tuple(by_rig.get(k) for k in range(len(libraries))), common)


def _counterpart(hypothesis: Hypothesis, library: Sequence[Hypothesis]) -> Hypothesis | None:
    """The same effect at the same place, by the same parameters, of another rig."""
    names = [free.name for free in hypothesis.free]
    alike = (other for other in library if _alike(hypothesis, other) and [free.name for free in other.free] == names)
    return next(alike, None)


def _merged(parts: Sequence[Hypothesis], names: Sequence[str] | None) -> list[Hypothesis]:
    """One effect of several rigs: what is in common has the widest of their bounds and is tried wherever one tries it.

    `names` of what is in common; None: everything.
    """
    free = []
    for alike in zip(*(part.free for part in parts), strict=True):
        widest = max(alike, key=lambda bounded: bounded.high)
        low, high = min(bounded.low for bounded in alike), widest.high
        free.append(widest._replace(low=low, high=high) if names is None or widest.name in names else None)
    if names is None:
        probes = tuple(dict.fromkeys(probe for part in parts for probe in part.probes))
        whole = tuple(slot for slot in free if slot is not None)
        return [replace(part, free=whole, probes=probes, structural=parts[0].structural) for part in parts]
    return [
        replace(part, free=tuple(shared or unshared for shared, unshared in zip(free, part.free, strict=True)))
        for part in parts
    ]
