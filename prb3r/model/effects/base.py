"""The base classes of effects: `Effect` changes the chain of the mechanics, `Observation` changes what is measured."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, Protocol, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from prb3r.errors import did_you_mean
from prb3r.mechanics.chain import Chain

Efficiency = Annotated[float, Field(gt=0, le=1)]
Number = Annotated[int, Field(ge=1)]
Side = Literal["positive", "negative"]
"""Side toward which plates bend: that of positive or of negative cable offsets."""
SIDES: tuple[Side, ...] = "negative", "positive"
"""The sides in the order of arrays that have a column for each."""
SIDE_COLUMN: Mapping[str | None, int | slice] = MappingProxyType({"negative": 0, "positive": 1, None: slice(None)})
"""Column of a side in such arrays; both columns for no side."""


class Host(Protocol):
    """The attributes of a manipulator that its effects may use; see `prb3r.model.manipulator.Manipulator`."""

    @property
    def model(self) -> str: ...

    @property
    def youngs_modulus_pa(self) -> float: ...

    @property
    def effect(self) -> Sequence[Any]: ...

    @property
    def cable_names(self) -> list[str]: ...

    @property
    def plates(self) -> int: ...

    @property
    def segment(self) -> Sequence[Any]: ...

    @property
    def disk(self) -> Any: ...

    @property
    def friction(self) -> Any: ...

    @property
    def bending_stiffness(self) -> np.ndarray: ...

    @property
    def outer_fibre(self) -> np.ndarray: ...

    @property
    def disk_masses(self) -> np.ndarray: ...

    def cable_arm(self, side: int) -> np.ndarray: ...


class CachedHost:
    """The attributes of a manipulator that effects use, computed once, to build many chains of it."""

    def __init__(self, manipulator: Host) -> None:
        self.model, self.youngs_modulus_pa = manipulator.model, manipulator.youngs_modulus_pa
        self.segment, self.disk, self.friction = manipulator.segment, manipulator.disk, manipulator.friction
        self.effect, self.cable_names, self.plates = manipulator.effect, manipulator.cable_names, manipulator.plates
        self.bending_stiffness, self.outer_fibre = manipulator.bending_stiffness, manipulator.outer_fibre
        self.disk_masses = manipulator.disk_masses
        self._arms = {side: manipulator.cable_arm(side) for side in (-1, 1)}
        for shared in (self.bending_stiffness, self.outer_fibre, self.disk_masses, *self._arms.values()):
            shared.flags.writeable = False

    def cable_arm(self, side: int) -> np.ndarray:
        """(plates,) as `Manipulator.cable_arm`."""
        return self._arms[side]


class Effect(BaseModel, ABC):
    """One effect; `kind` names it in a manipulator file."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    def __init__(self, **parameters: Any) -> None:
        """Take the parameters of the effect by name; `kind` may be left out."""
        super().__init__(**_named_kind(type(self)) | parameters)

    late: ClassVar[int] = 0
    """Rank by which effects are applied, small numbers first; those of equal rank in the order of the file."""
    once: ClassVar[bool] = False
    """Whether a second effect of the kind in a file replaces what the first has set.

    Effects of other kinds add up, multiply, or act at places of their own.
    """
    instead_of: ClassVar[frozenset[str]] = frozenset()
    """Kinds that describe the same property of the same parts, so that a manipulator cannot have one beside this."""
    follows_history: ClassVar[bool] = False
    """Whether the effect makes slip follow from the load path, so that a state depends on all states before it."""
    needs_times: ClassVar[bool] = False
    """Whether the effect depends on the times of steps, which tables of steps then have to give."""
    goes_by_time: ClassVar[bool] = False
    """Whether what the effect does to the arm changes as time passes, or depends on how fast loads follow each other;
    where no times are known, each step takes as long."""
    kind: str

    @abstractmethod
    def change(self, chain: Chain, manipulator: Host) -> Chain:
        """A copy of `chain`, a chain of the manipulator, with the effect."""

    def problems(self, manipulator: Host) -> Iterator[str]:
        """Messages on why the manipulator cannot have the effect: parts that do not exist, effects that exclude it."""
        for other in sorted(self.instead_of & {effect.kind for effect in manipulator.effect}):
            yield f"effect {self.kind} stands in the place of {other}: leave one of both out"
        names = manipulator.cable_names
        for cable in self._named("cable"):
            if cable not in names:
                yield f"effect {self.kind}: there is no cable {cable!r}{did_you_mean(cable, names)}"
        for segment in self._named("segment"):
            if segment > len(manipulator.segment):
                yield f"effect {self.kind}: there is no segment {segment}, only {len(manipulator.segment)}"
        for plate in self._named("plate"):
            if plate > manipulator.plates:
                yield f"effect {self.kind}: there is no plate {plate}, only {manipulator.plates}"
        for disk in self._named("disk"):
            if disk >= manipulator.plates:
                yield f"effect {self.kind}: cables rub at disks 0 to {manipulator.plates - 1}, not at {disk}"

    def idle(self, manipulator: Host) -> str:
        """Why the effect changes nothing with this manipulator, as a clause; empty where it may change something."""
        return ""

    def _named(self, part: str) -> list[Any]:
        """Values of the fields named `part` and its plural: names or numbers of parts; empty where neither is given."""
        single, several = getattr(self, part, None), getattr(self, f"{part}s", None)
        return [*([] if single is None else [single]), *(several or ())]


@cache
def _named_kind(effect: type[Effect]) -> dict[str, str]:
    """The parameter `kind` of an effect class with its value; empty for a base class, which has none."""
    kinds = get_args(effect.model_fields["kind"].annotation)
    return {"kind": kinds[0]} if kinds else {}


def mask_of(plates: Sequence[int], count: int) -> np.ndarray:
    """(count,) whether each of `count` plates is among the numbers `plates`, counted from 1."""
    named = np.zeros(count, bool)
    named[np.asarray(plates, int) - 1] = True
    return named


class Observation(Effect):
    """An effect of the measurement: it changes what is read, not the chain."""

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain

    @abstractmethod
    def observe(self, points: np.ndarray, centre: np.ndarray, elapsed: np.ndarray | float) -> np.ndarray:
        """(..., 2) measured positions of `points` (..., 2), m.

        `centre` (2,) is that of the image, m; `elapsed` (...) is the number of steps that had passed before each point.
        """

    def turn(self, elapsed: np.ndarray | float) -> np.ndarray | float:
        """(...) angle that is added to measured angles after so many `elapsed` (...) steps, rad."""
        return 0.0


def columns(cables: Sequence[str] | None, manipulator: Host) -> list[int]:
    """Indices (from 0) of the named cables; of all cables for None."""
    names = manipulator.cable_names
    return list(range(len(names))) if cables is None else [names.index(cable) for cable in cables]
