"""What a plot is: what it names, what tells apart what it draws, and what it needs of the tables of a study."""

from abc import ABC
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import Field

from prb3r.model.manipulator import Strict
from prb3r.study.wishes import Scalar

COLUMN = "_column"
"""Key column of a plot of several columns in one panel: which of them a row is about."""


class Grouping(NamedTuple):
    """The columns that tell apart what is drawn; None: nothing is told apart so."""

    by: str | None = None
    """By colour and mark."""
    style: str | None = None
    """By the style of lines."""
    panel: str | None = None


@dataclass(frozen=True)
class KeptTables:
    """What a study has for its plots beside the table of cases."""

    states: Literal["none", "final", "path"]
    disks: tuple[int, ...] | None
    """Those whose states are kept; None: all."""
    cloud: bool
    """Whether its loads are a cloud."""
    targets: bool
    """Whether its loads bring a disk to targets."""
    fits: frozenset[tuple[str, str]]
    """Columns (x, y) that it fits lines through."""


class Plot(Strict, ABC):
    """A figure made from the tables of a study, written as PNG and SVG; `kind` names what it is."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9-]+$")]
    kind: str
    caption: str = ""
    where: dict[str, Scalar | list[Scalar]] = {}
    """Only cases with these factor values."""
    by: str | None = None
    """Colour and mark: one line, shape or region for each value of this column."""

    stepwise: ClassVar[bool] = False
    """Whether a row that it draws is a step of a case, where it names columns of states; else a disk in a step."""
    of_states: ClassVar[bool] = False
    """Whether it draws states, whatever columns it names."""

    def columns(self) -> list[str | None]:
        """Every column that it names, of cases or states."""
        return [self.by, *self.where]

    def drawn(self) -> list[str | None]:
        """The columns that its rows must have, from the states where the cases have none of that name."""
        return [*self.groups]

    @property
    def groups(self) -> Grouping:
        """Columns by which what is drawn is told apart: colour and mark, line style, panel; here `by` alone."""
        return Grouping(by=self.by)

    @property
    def stacked(self) -> list[str]:
        """Columns that share a panel, which are stacked: a row of a case becomes one for each of them."""
        return []

    @property
    def behind(self) -> dict[str, Scalar]:
        """Factor values of cases that stand behind all others; empty: none do."""
        return {}

    def units(self) -> Iterator[tuple[str, str]]:
        """Columns and the units that they are to be shown in."""
        yield from ()

    def needs(self, kept: KeptTables) -> Iterator[str]:
        """What it lacks of the tables that a study keeps, a sentence each."""
        yield from ()


class Styled(Plot):
    """A plot whose lines differ in style too."""

    style: str | None = None
    """Second distinction, by line style."""

    def columns(self) -> list[str | None]:
        return [*super().columns(), self.style]

    @property
    def groups(self) -> Grouping:
        return super().groups._replace(style=self.style)


class Panelled(Plot):
    """A plot with several panels."""

    panel: str | None = None
    """One panel for each value of this column."""
    note: str | None = None
    """A column whose value follows the title of each panel that has one value of it."""

    def columns(self) -> list[str | None]:
        return [*super().columns(), self.panel, self.note]

    @property
    def groups(self) -> Grouping:
        return super().groups._replace(panel=self.panel)


class Charted(Plot):
    """A plot of columns over a column."""

    x: str
    y: Annotated[list[str], Field(min_length=1)]
    x_unit: str | None = None
    y_unit: str | None = None
    y_from_zero: bool = False
    """Whether the y axis begins at zero, unless something lies below."""

    def columns(self) -> list[str | None]:
        return [self.x, *self.y, *super().columns()]

    def units(self) -> Iterator[tuple[str, str]]:
        if self.x_unit is not None:
            yield self.x, self.x_unit
        if self.y_unit is not None:
            yield from ((column, self.y_unit) for column in self.y)
