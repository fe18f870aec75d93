"""Hypotheses on several rigs together: effects that rigs share, and effects and constants of one rig alone.

Rigs of one make share what belongs to their material and to the pair of surfaces that rubs.  All else may be each rig's
own, or the same on all of them, as from one way of building or from one bench.  A rig may also have its own value of
what it should share.
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
"""Which parameters rigs may share of each kind of effect that they may share, from its `Suspect`."""
CONSTANT_GROUPS: Mapping[str, Group] = MappingProxyType({"log_stiffness": "material", "log_friction": "friction"})
"""Constants that rigs may share, and the group of rigs that does."""
IN_CURVATURE = frozenset({"knee_per_m", "cubic_m2", "yield_per_m"})
"""Parameters of bending laws in terms of curvature, which mean the same on equal sections only."""


class Slot(NamedTuple):
    """A free parameter of a joint hypothesis."""

    rig: int | None
    """Number of the rig, from 0, that the parameter belongs to; None: shared by all rigs of the hypothesis."""
    free: Free


@dataclass(frozen=True)
class JointHypothesis:
    """An effect of one rig, an effect that several rigs share, or the deviation of one rig's constant from the shared
    one."""

    kind: str
    parts: tuple[Hypothesis | None, ...]
    """(rigs,) the effect as each rig has it; None for rigs without it."""
    common: tuple[str, ...] = ()
    """Names of the free parameters that have the same value on all rigs of the hypothesis."""
    parting: Free | None = None
    """Difference of one rig's constant from the shared one, all `parts` then being None; None for an effect."""
    parted: int | None = None
    """Number of the rig, from 0, whose constant deviates; None for an effect."""

    @cached_property
    def rigs(self) -> tuple[int, ...]:
        """Numbers, from 0, of the rigs that have the effect, or the deviating constant."""
        return tuple(k for k, part in enumerate(self.parts) if part is not None or k == self.parted)

    @property
    def first(self) -> Hypothesis | None:
        """The effect as the first rig that has it does; None for a deviating constant."""
        return next((part for part in self.parts if part is not None), None)

    @cached_property
    def slots(self) -> tuple[Slot, ...]:
        """The free parameters with the rigs that they belong to: shared ones first, then those of each rig."""
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
        """The free parameters in the order of `slots`, shared ones once."""
        return tuple(slot.free for slot in self.slots)

    def places(self, rig: int) -> list[int]:
        """Positions among `free` of the parameters of the effect on rig `rig`, in the order in which its part has them;
        empty for a rig without the effect."""
        part = self.parts[rig]
        keys = [(slot.rig, slot.free.name) for slot in self.slots]
        return (
            [keys.index((None if free.name in self.common else rig, free.name)) for free in part.free] if part else []
        )

    @property
    def continuous(self) -> bool:
        """Whether the effect vanishes continuously on every rig (`Hypothesis.continuous`); a deviating constant always
        does."""
        return self.parting is not None or all(part.continuous for part in self.parts if part)

    @property
    def kinked(self) -> bool:
        """Whether the effect is kinked on some rig (`Hypothesis.kinked`)."""
        return any(part.kinked for part in self.parts if part)

    def sided(self, frictions: Sequence[float]) -> bool:
        """Whether the effect is one-sided on some rig (`Hypothesis.sided`); `frictions` are the calibrated coefficients
        of all rigs."""
        return any(part.sided(friction) for part, friction in zip(self.parts, frictions, strict=True) if part)

    def one_sided(self, frictions: Sequence[float]) -> bool:
        """Whether only positive multiples of the effect's change of the readings make sense, as for a `Hypothesis`."""
        return self.sided(frictions) or self.kinked or not self.continuous

    @property
    def deviations(self) -> np.ndarray:
        """(k,) prior standard deviations of the free parameters, in the order of `slots` and in their own scale `u`."""
        return np.array([free.prior_sd for free in self.free])

    @property
    def costly(self) -> bool:
        """Whether predictions with the effect are slow on some rig (`Hypothesis.costly`)."""
        return any(part.costly for part in self.parts if part)

    @property
    def name(self) -> str:
        """Kind and place, or the constant; on a single rig followed by its number, counted from 1."""
        first = self.first
        text = self.kind if first is None else first.name
        return text if len(self.rigs) > 1 else f"{text} on rig {self.rigs[0] + 1}"

    def excludes(self, other: "JointHypothesis") -> bool:
        """Whether a joint model cannot have both hypotheses: they are equal, let the same constant of the same rig
        deviate, or on some rig exclude each other or are the same effect at the same place."""
        if self == other or (self.parting and other.parting and (self.kind, self.parted) == (other.kind, other.parted)):
            return True
        pairs = zip(self.parts, other.parts, strict=True)
        return any(here and there and (here.excludes(there) or here.same_effect(there)) for here, there in pairs)

    def starts(self, frictions: Sequence[float]) -> list[np.ndarray]:
        """Points `u` (k,), in the order of `slots`, from which a fit begins; `frictions` are the calibrated
        coefficients of all rigs.

        The n-th point joins the n-th of every rig; of a shared parameter that of the first rig counts.
        """
        if self.parting is not None:
            return [np.zeros(1)]
        probes = [part.starts(friction) if part else None for part, friction in zip(self.parts, frictions, strict=True)]
        count = min(len(of_rig) for of_rig in probes if of_rig is not None)
        out = []
        for k in range(count):
            u = np.zeros(len(self.slots))
            for rig in reversed(self.rigs):  # the first rig comes last, so that its shared values stay
                u[self.places(rig)] = probes[rig][k]  # type: ignore[index]
            out.append(u)
        return out


def alone_on(rig: int, hypothesis: Hypothesis, count: int) -> JointHypothesis:
    """The hypothesis as an effect that rig `rig`, counted from 0, of `count` rigs has alone."""
    parts = tuple(hypothesis if k == rig else None for k in range(count))
    return JointHypothesis(hypothesis.kind, parts)


def in_common(
    libraries: Sequence[Sequence[Hypothesis]], groups: Mapping[Group, tuple[int, ...]], same_sections: bool
) -> Iterator[JointHypothesis]:
    """Every effect that all rigs of a group may share: of the kinds in `SHARED`, at places that each of them has, but
    for those at single cables.

    Parameters
    ----------
    libraries : (rigs,) the hypotheses of each rig.
    groups : numbers of the rigs that share material, and of those that share friction.
    same_sections : whether laws in curvature mean the same on all rigs with the same material; else they are left out.
    """
    for kind, (group, names) in SHARED.items():
        rigs = groups.get(group, ())
        if len(rigs) < 2:
            continue
        for hypothesis in libraries[rigs[0]]:
            if hypothesis.kind != kind:
                continue
            keys = {free.name for free in hypothesis.free}
            cut = keys & IN_CURVATURE and not same_sections
            if "cables" in dict(hypothesis.place) or cut:
                continue
            joint = _joined(hypothesis, libraries, rigs, names)
            if joint:
                yield joint


def alike_on_all(
    libraries: Sequence[Sequence[Hypothesis]], rigs: Sequence[int], one_design: bool
) -> Iterator[JointHypothesis]:
    """Every effect of the kinds that are not in `SHARED` which all the `rigs` may have in one size, from one way of
    building them or from one bench; none for fewer than two rigs.

    Parameters
    ----------
    libraries : (rigs,) the hypotheses of each rig.
    one_design : whether the manipulator files are the same, so that it may be one rig that was recorded more than once;
        effects of single parts are left out otherwise, but for those of a bench at single cables.
    """
    for hypothesis in libraries[rigs[0]] if len(rigs) > 1 else ():
        at_cables = {name for name, _ in hypothesis.place} == {"cables"} and SUSPECTS[hypothesis.kind].of_the_setup
        if hypothesis.kind in SHARED or not (hypothesis.of_whole_rig or one_design or at_cables):
            continue
        joint = _joined(hypothesis, libraries, rigs, None)
        if joint:
            yield joint


def _joined(
    hypothesis: Hypothesis, libraries: Sequence[Sequence[Hypothesis]], rigs: Sequence[int], names: Sequence[str] | None
) -> JointHypothesis | None:
    """The effect of the first of the `rigs` as one that they all have; None where the library of one of them lacks it.

    `names`: of the parameters that they share; None: all.
    """
    counterparts = [counterpart(hypothesis, libraries[rig]) for rig in rigs]
    if None in counterparts:
        return None
    parts = _merged([part for part in counterparts if part], names)
    by_rig = dict(zip(rigs, parts, strict=True))
    common = tuple(free.name for free in hypothesis.free if names is None or free.name in names)
    return JointHypothesis(hypothesis.kind, tuple(by_rig.get(k) for k in range(len(libraries))), common)


def counterpart(hypothesis: Hypothesis, library: Sequence[Hypothesis]) -> Hypothesis | None:
    """The hypothesis of a `library` on the same effect at the same place with the same parameters, if there is one."""
    return next((other for other in library if hypothesis.same_form(other)), None)


def _merged(parts: Sequence[Hypothesis], names: Sequence[str] | None) -> list[Hypothesis]:
    """The hypotheses `parts` of several rigs on one effect, made to agree on shared parameters: these get the widest
    bounds of all rigs.

    `names` are those of the shared parameters; None: all are shared, and every part then also has the probes of all.
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
