"""What a study may draw: each kind of plot one class, with its own fields and what it needs of the tables.

To add one, write a class, name it in `AnyPlot`, and say in `present/study/figures.py` how it is drawn.
"""

import re
from abc import ABC
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

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

    def columns(self) -> list[str | None]:
        """Every column that it names, of cases or states."""
        return [self.by, *self.where]

    def drawn(self) -> list[str | None]:
        """The columns that its rows must have, from the states where the cases have none of that name."""
        return [*self.groups]

    @property
    def groups(self) -> Grouping:
        """What tells apart what is drawn."""
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


class PublishedPoint(Strict):
    """A published value laid over a plot, in SI units as the columns are."""

    x: float
    y: float
    label: str


class LinesPlot(Charted, Styled, Panelled):
    """Columns of one quantity over a column, with the range of cases that differ otherwise."""

    kind: Literal["lines"]
    mark: list[PublishedPoint] = []
    """Published points."""
    vertical: str | None = None
    """A column whose (median) value is marked by a vertical line."""
    fit: bool = False
    """Whether the study's fits of this y over x are drawn."""
    log_y: bool = False
    """Whether the y axis is logarithmic."""

    def columns(self) -> list[str | None]:
        return [*super().columns(), self.vertical]

    def drawn(self) -> list[str | None]:
        return [*super().groups, self.x, *self.y]

    @property
    def groups(self) -> Grouping:
        """Several columns are told apart by colour, or by style where `by` has the colour."""
        groups = super().groups
        if len(self.y) == 1:
            return groups
        return groups._replace(by=COLUMN) if groups.by is None else groups._replace(style=groups.style or COLUMN)

    @property
    def stacked(self) -> list[str]:
        return self.y

    def needs(self, kept: KeptTables) -> Iterator[str]:
        if self.fit and not any((self.x, y) in kept.fits for y in self.y):
            yield "fit = true needs a [[fit]] of its y over its x"

    @model_validator(mode="after")
    def _consistent(self) -> "LinesPlot":
        if self.log_y and self.y_from_zero:
            raise ValueError("log_y and y_from_zero exclude each other")
        return self


class BarsPlot(Charted, Styled):
    """Metrics over a column, as bars in a panel for each metric."""

    kind: Literal["bars"]

    def drawn(self) -> list[str | None]:
        return [*super().drawn(), self.x, *self.y]


class LoopsPlot(Charted, Panelled):
    """Positions of disks over the tension of a cable along the path of each case, a row of panels for each."""

    kind: Literal["loops"]

    def needs(self, kept: KeptTables) -> Iterator[str]:
        if kept.states != "path":
            yield "a plot of loops needs states = 'path'"
        if not re.fullmatch(r"cable_.+_n", self.x):
            yield f"x must be the tension of a cable, such as cable_1_n, not {self.x}"
        for column in self.y:
            disk = disk_of(column, 0)
            if disk < 0:
                yield f"y must be positions of disks, such as tip_y_m or disk7_y_m, not {column}"
            elif kept.disks is not None and not {0, disk} <= set(kept.disks):
                yield f"needs disks 0 and {disk} in state_disks"


class ShapesPlot(Styled, Panelled):
    """Manipulators to scale: plates, disks and cables."""

    kind: Literal["shapes"]
    reference: dict[str, Scalar] = {}
    """Cases with these factor values are drawn pale behind all others instead of by themselves."""

    stepwise: ClassVar[bool] = True

    def columns(self) -> list[str | None]:
        return [*super().columns(), *self.reference]

    @property
    def behind(self) -> dict[str, Scalar]:
        return self.reference

    def needs(self, kept: KeptTables) -> Iterator[str]:
        if kept.states == "none":
            yield "a plot of shapes needs states = 'final' or 'path'"
        if kept.disks is not None:
            yield "a plot of shapes needs the states of all disks; leave out state_disks"


class WorkspacePlot(Styled, Panelled):
    """Regions that the tip reaches under a cloud of loads."""

    kind: Literal["workspace"]

    def needs(self, kept: KeptTables) -> Iterator[str]:
        if not kept.cloud or kept.states != "path":
            yield "a plot of a workspace needs [cloud] and states = 'path', or it is empty"


class PathPlot(Panelled):
    """Targets that a disk is brought to, where it comes, and the manipulator on its way."""

    kind: Literal["path"]

    def needs(self, kept: KeptTables) -> Iterator[str]:
        if not kept.targets or kept.states != "path" or kept.disks is not None:
            yield "a plot of a path needs [reach], states = 'path' and the states of all disks (no state_disks)"


AnyPlot = Annotated[
    LinesPlot | BarsPlot | LoopsPlot | ShapesPlot | WorkspacePlot | PathPlot, Field(discriminator="kind")
]


def disk_of(column: str, tip: int) -> int:
    """The disk that a column of positions, such as `disk7_y_m` or `tip_y_m`, is about; -1 for any other column."""
    match = re.fullmatch(r"(?:disk(\d+)|tip)_(?:x_m|y_m|angle_rad)", column)
    return -1 if match is None else int(match[1]) if match[1] else tip
