"""Base classes of plots: the columns that a plot names and groups by, and the tables of a study that it needs."""

from abc import ABC
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import Field

from prb3r.model.manipulator import Strict
from prb3r.study.wishes import Scalar

COLUMN = "_column"
"""Column that is added to the rows of a plot of several columns in one panel: name of the column of the row."""


class Grouping(NamedTuple):
    """The columns by whose values a plot distinguishes what it draws; None: that distinction is not made."""

    by: str | None = None
    """Column distinguished by colour and mark."""
    style: str | None = None
    """Column distinguished by line style."""
    panel: str | None = None
    """Column with a panel for each value."""


@dataclass(frozen=True)
class KeptTables:
    """What a study keeps for its plots besides the table of cases."""

    states: Literal["none", "final", "path"]
    """States that are kept: none, those of the last step, or those of all steps."""
    disks: tuple[int, ...] | None
    """Disks whose states are kept; None: all."""
    cloud: bool
    """Whether the loads of the study are a cloud."""
    targets: bool
    """Whether the loads of the study bring a disk to targets."""
    fits: frozenset[tuple[str, str]]
    """Pairs (x, y) of columns that the study fits lines through."""


class Plot(Strict, ABC):
    """A figure made from the tables of a study, written as PNG and SVG; `kind` names what it is."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9-]+$")]
    """Name of the files of the figure."""
    kind: str
    caption: str = ""
    where: dict[str, Scalar | list[Scalar]] = {}
    """Only what has these values of columns is drawn; of a list, any of them."""
    by: str | None = None
    """Colour and mark: one line, shape or region for each value of this column."""

    stepwise: ClassVar[bool] = False
    """Whether a row of states, as the plot takes them, is one step of a case; else it is one disk in a step."""
    of_states: ClassVar[bool] = False
    """Whether the plot draws states, whichever columns it names."""
    of_angles: ClassVar[bool] = False
    """Whether it draws angles of disks in these states, not their places alone."""

    def columns(self) -> list[str | None]:
        """Every column of cases or states that the plot names; None for absent options."""
        return [self.by, *self.where]

    def numeric(self) -> list[str | None]:
        """The columns that must hold numbers; None for absent options."""
        return []

    def drawn(self) -> list[str | None]:
        """The columns that the rows of the plot must have, taken from states where the cases have no such column."""
        return [*self.groups]

    @property
    def groups(self) -> Grouping:
        """The columns by which the plot distinguishes what it draws; in this base class `by` alone."""
        return Grouping(by=self.by)

    @property
    def stacked(self) -> list[str]:
        """Columns drawn in one panel: the row of a case is repeated for each of them, see `COLUMN`; here none."""
        return []

    @property
    def behind(self) -> dict[str, Scalar]:
        """Factor values of the cases that are drawn behind all others; empty: there are none."""
        return {}

    def units(self) -> Iterator[tuple[str, str]]:
        """Pairs of a column and the unit in which it is shown."""
        yield from ()

    def of_one_unit(self) -> Iterator[tuple[str, str]]:
        """Pairs of a column on an axis and another column whose value is marked there."""
        yield from ()

    def needs(self, kept: KeptTables) -> Iterator[str]:
        """A sentence for each thing that the plot needs and the study does not keep."""
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
    """Column along the x axis."""
    y: Annotated[list[str], Field(min_length=1)]
    """Columns along the y axis."""
    x_unit: str | None = None
    y_unit: str | None = None
    y_from_zero: bool = False
    """Whether the y axis begins at zero, unless something lies below; that of bars always does."""

    def columns(self) -> list[str | None]:
        return [self.x, *self.y, *super().columns()]

    def numeric(self) -> list[str | None]:
        return [*self.y, *super().numeric()]

    def units(self) -> Iterator[tuple[str, str]]:
        if self.x_unit is not None:
            yield self.x, self.x_unit
        if self.y_unit is not None:
            yield from ((column, self.y_unit) for column in self.y)
