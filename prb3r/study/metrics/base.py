"""The base class of metrics, and the solved cases that they measure."""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prb3r.errors import did_you_mean
from prb3r.inverse.target import Target
from prb3r.mechanics.chain import Chain, Loads, no_loads
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator, Strict
from prb3r.model.steps import tension_travel
from prb3r.quantities import Quantity
from prb3r.study.workspace import Tips

LEFT_OUT_OF_FURTHER = ("lowest_eigenvalue", "closed")
"""Fields of `Equilibria` that are not computed for further loads of a metric."""

DiskNumber = Annotated[int, Field(ge=0)] | Literal["tip"]
"""A disk: its number from 0, the base disk, or `tip`."""


@dataclass(frozen=True)
class Solved:
    """Cases of one manipulator with their equilibria: `c` cases of `s` load steps each, one case after the other."""

    manipulator: Manipulator
    chain: Chain
    loads: Loads
    """Loads of the `c s` steps."""
    states: Equilibria
    """Equilibria at the `c s` steps."""
    initial: bool = False
    """Whether the first step of a case is the initial configuration; else that is the unloaded manipulator."""
    cloud: bool = False
    """Whether the steps of a case are independent loads of a cloud.  The positions in `states` may then be those of the
    tip disk alone, and `loads` and other fields of `states` may be empty."""
    count: int = 1
    """Number of cases, `c`."""
    tips: Tips | None = None
    """For a cloud: tip position and peak values under each load."""
    safety: float = 0.0
    """For a cloud: loads that bring a plate nearer to yield than this factor do not count."""
    targets: tuple[Target, ...] = ()
    """Target of each step, if the loads bring a disk along targets; there is one case then."""
    from_rest: tuple[bool, ...] = ()
    """For each target whether it is reached from rest, where it is not from the target before."""

    @property
    def steps(self) -> int:
        """Number of load steps of each case, `s`."""
        return len(self.states.outcome) // self.count

    @property
    def begins(self) -> np.ndarray:
        """(c,) row of the first step of each case."""
        return np.arange(self.count) * self.steps

    @property
    def ends(self) -> np.ndarray:
        """(c,) row of the last step of each case."""
        return self.begins + self.steps - 1

    def by_case(self, values: np.ndarray) -> np.ndarray:
        """(c, s, ...) values of all steps, from (c s, ...)."""
        return values.reshape(self.count, self.steps, *values.shape[1:])

    def part(self, cases: np.ndarray) -> "Solved":
        """The cases where the mask `cases` (c,) is true, with their loads and their states."""
        if cases.all():
            return self
        rows, known = np.repeat(cases, self.steps), {}
        for field in dataclasses.fields(Equilibria):
            values = getattr(self.states, field.name)
            known[field.name] = values[rows] if values is not None and len(values) else values
        loads = Loads(*(values[rows] for values in self.loads))
        return dataclasses.replace(self, loads=loads, states=Equilibria(**known), count=int(cases.sum()))

    def at(self, disk: DiskNumber) -> int:
        """Number of a disk, which may be given as `tip`.

        Raises
        ------
        ValueError
            If the manipulator has no such disk.
        """
        number = self.chain.plates if disk == "tip" else disk
        if number > self.chain.plates:
            raise ValueError(f"there is no disk {number}, the tip is disk {self.chain.plates}")
        return number

    def cable(self, name: str) -> int:
        """Column of a cable in arrays such as tensions, by its name; raises ValueError where no cable has that name."""
        return self.manipulator.cable_names.index(name)

    @cached_property
    def last(self) -> Loads:
        """The loads of the last step of each case, `c` steps."""
        return Loads(*(field[self.ends] for field in self.loads))

    @cached_property
    def unloaded(self) -> "Solved":
        """The manipulator without loads, as one case of one step; its cables are declared drawn in (slip -1)."""
        idle = no_loads(self.chain)
        idle = idle._replace(slip=-np.ones_like(idle.slip))
        return Solved(self.manipulator, self.chain, idle, equilibria_of(self.chain, idle))

    def continued(self, *further: Loads) -> Equilibria:
        """Equilibria of further load steps of all cases, each reached from the last step of its case.

        Parameters
        ----------
        further : loads of `c` steps each, one step for each case; their `travel` follows from the steps before.

        Returns
        -------
        Equilibria under the first loads for all cases, then under the second, and so on; without eigenvalues.
        """
        names = [field.name for field in dataclasses.fields(Equilibria) if field.name not in LEFT_OUT_OF_FURTHER]
        before = self.steps if self.chain.follows_path else 1
        begun = [self.by_case(field)[:, -before:] for field in self.loads]
        from_rest = np.arange((before + 1) * self.count) % (before + 1) == 0
        first = self.steps - before + (0 if self.initial else 1)
        number = np.tile(first + np.minimum(np.arange(before + 1), before - 1), self.count)
        ends = []
        for loads in map(self._travelled, further):
            whole = (np.concatenate([path, more[:, None]], axis=1) for path, more in zip(begun, loads, strict=True))
            path = Loads(*(field.reshape(-1, *field.shape[2:]) for field in whole))
            ends.append(equilibria_of(self.chain, path, from_rest=from_rest, number=number))
        last = {name: np.concatenate([getattr(end, name)[before :: before + 1] for end in ends]) for name in names}
        return Equilibria(**last, lowest_eigenvalue=None)

    def _travelled(self, further: Loads) -> Loads:
        """One further load step of each case, with the cables' travel after the steps of the case."""
        tension, slip = (
            np.concatenate([self.by_case(before), more[:, None]], axis=1).reshape(-1, more.shape[-1])
            for before, more in ((self.loads.tension, further.tension), (self.loads.slip, further.slip))
        )
        travel = tension_travel(tension, slip, np.arange(len(tension)) % (self.steps + 1) == 0)
        return further._replace(travel=travel[self.steps :: self.steps + 1])


class Metric(Strict, ABC):
    """A metric; `kind` names it in a study file."""

    kind: str
    together: ClassVar[bool] = False
    """Whether `values` takes many cases at once; else it gets one case at a time."""
    of_clouds: ClassVar[bool] = False
    """Whether the metric can be computed from a cloud of loads."""
    from_rest: ClassVar[bool] = False
    """Whether, for a case with a cloud, which has no last step, the metric is computed for the unloaded manipulator."""
    of_paths: ClassVar[bool] = False
    """Whether the metric needs a path of targets, `[reach]`."""

    of_loads: ClassVar[frozenset[str]] = frozenset()
    """Columns that tell of the loads that the study gives, and not of what they do."""

    @abstractmethod
    def quantities(self) -> list[Quantity]:
        """Name, symbol, unit and meaning of each column that `values` gives, in the same order."""

    def problems(self, manipulator: Manipulator, cloud: bool) -> Iterator[str]:
        """Why the metric cannot be computed for a manipulator: disks, segments or cables that it lacks, or the loads.

        Parameters
        ----------
        cloud : whether the loads are a cloud instead of steps.
        """
        disk, segment = getattr(self, "disk", "tip"), getattr(self, "segment", None) or 1
        if isinstance(disk, int) and disk > manipulator.plates:
            yield f"there is no disk {disk}, the tip is disk {manipulator.plates}"
        if segment > len(manipulator.segment):
            yield f"there is no segment {segment}, only {len(manipulator.segment)}"
        named = [self.cable] if hasattr(self, "cable") else list(getattr(self, "tension_n", None) or ())
        for name in named:
            if name not in manipulator.cable_names:
                yield f"there is no cable {name!r}{did_you_mean(name, manipulator.cable_names)}"
        if cloud and not (self.of_clouds or self.from_rest):
            yield "needs load steps, the loads are a cloud"

    def lacking(self, manipulator: Manipulator) -> dict[str, str]:
        """Columns without a value for a manipulator, whatever its loads, with the field of its file that they need."""
        return {}

    @abstractmethod
    def values(self, cases: Solved) -> Sequence[np.ndarray | float]:
        """The columns of the metric in the order of `quantities`: (c,) numbers, or one number for all cases.

        NaN where a load has no equilibrium.
        """


def lacking_for_stress(manipulator: Manipulator, *, to_yield: bool) -> str:
    """The field of a manipulator that is needed for bending stress, `to_yield` compared with yield; empty if none."""
    if np.isnan(manipulator.outer_fibre).all():
        return "thickness_m or outer_fibre_m of a segment"
    return "yield_stress_pa" if to_yield and manipulator.yield_stress_pa is None else ""


def largest(values: np.ndarray) -> np.ndarray:
    """(c,) largest number in each row of `values` (c, n); NaN where all of a row are NaN."""
    numbers = np.where(np.isnan(values), -np.inf, values).max(1)
    return np.where(np.isneginf(numbers), np.nan, numbers)


def column_stem(disk: DiskNumber) -> str:
    """First part of the names of a disk's columns: `disk7` or `tip`."""
    return "tip" if disk == "tip" else f"disk{disk}"


def disk_in_words(disk: DiskNumber) -> str:
    """A disk in words, for the descriptions of columns."""
    return "the tip disk" if disk == "tip" else f"disk {disk}"
