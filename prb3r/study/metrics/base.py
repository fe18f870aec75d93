"""What a metric is, and the solved case that it measures."""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator, Strict
from prb3r.quantities import Quantity

LEFT_OUT_OF_FURTHER = ("lowest_eigenvalue", "closed")
"""What equilibria of a metric's own loads do without."""

DiskNumber = Annotated[int, Field(ge=0)] | Literal["tip"]


@dataclass(frozen=True)
class Solved:
    """A case with its equilibria.

    `initial` tells whether the first load step is the initial configuration (else the case starts from rest).
    """

    manipulator: Manipulator
    chain: Chain
    loads: Loads
    states: Equilibria
    initial: bool = False
    cloud: bool = False

    def at(self, disk: DiskNumber) -> int:
        """Number of a disk.

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
        """Column of a cable in arrays."""
        return self.manipulator.cable_names.index(name)

    @cached_property
    def last(self) -> Loads:
        """The loads of the last step, as one step."""
        return Loads(*(field[-1:] for field in self.loads))

    def continued(self, *further: Loads) -> Equilibria:
        """Equilibria of further load steps, each reached from the last one of the case."""
        paths = [Loads(*(np.concatenate(pair) for pair in zip(self.last, step, strict=True))) for step in further]
        ends = [equilibria_of(self.chain, path, number=np.ones(2)) for path in paths]
        names = [field.name for field in dataclasses.fields(Equilibria) if field.name not in LEFT_OUT_OF_FURTHER]
        last = {name: np.concatenate([getattr(end, name)[-1:] for end in ends]) for name in names}
        return Equilibria(**last, lowest_eigenvalue=None)


class Metric(Strict, ABC):
    """A metric; `kind` names it in a study file."""

    kind: str

    @abstractmethod
    def quantities(self) -> list[Quantity]:
        """What its columns are, in their order."""

    @abstractmethod
    def values(self, case: Solved) -> Sequence[float]:
        """Its numbers, in the order of the columns; NaN where a load has no equilibrium."""


def column_stem(disk: DiskNumber) -> str:
    """How the columns of a disk begin: `disk7` or `tip`."""
    return "tip" if disk == "tip" else f"disk{disk}"


def disk_in_words(disk: DiskNumber) -> str:
    """A disk as the descriptions of columns name it."""
    return "the tip disk" if disk == "tip" else f"disk {disk}"
