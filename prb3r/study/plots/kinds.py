"""The kinds of plots, one class for each."""

import re
from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import model_validator

from prb3r.model.manipulator import Strict
from prb3r.study.plots.base import COLUMN, Charted, Grouping, KeptTables, Panelled, Styled
from prb3r.study.wishes import Scalar


class PublishedPoint(Strict):
    """A published value laid over a plot, in SI units as the columns are."""

    x: float
    """Its value along the x axis, in the SI unit of the column."""
    y: float
    """Its value along the y axis, in the SI unit of the column."""
    label: str
    """Its name in the legend."""


class LinesPlot(Charted, Styled, Panelled):
    """Columns of one unit over a column: the median of cases that differ otherwise, and their range."""

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

    def of_one_unit(self) -> Iterator[tuple[str, str]]:
        if self.vertical is not None:
            yield self.x, self.vertical

    def numeric(self) -> list[str | None]:
        placed = self.vertical is not None or self.fit or self.mark
        return [*super().numeric(), self.vertical, *([self.x] if placed else [])]

    def drawn(self) -> list[str | None]:
        return [*super().groups, self.x, *self.y]

    @property
    def groups(self) -> Grouping:
        """The grouping of the bases; several columns `y` differ by colour, or by line style if `by` is given."""
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

    of_states: ClassVar[bool] = True
    of_angles: ClassVar[bool] = True

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
    of_states: ClassVar[bool] = True
    of_angles: ClassVar[bool] = True

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

    of_states: ClassVar[bool] = True

    def needs(self, kept: KeptTables) -> Iterator[str]:
        if not kept.cloud or kept.states != "path":
            yield "a plot of a workspace needs [cloud] and states = 'path', or it is empty"


class PathPlot(Panelled):
    """Targets that a disk is brought to, where it comes, and the manipulator on its way."""

    kind: Literal["path"]

    of_states: ClassVar[bool] = True
    of_angles: ClassVar[bool] = True

    def needs(self, kept: KeptTables) -> Iterator[str]:
        if not kept.targets or kept.states != "path" or kept.disks is not None:
            yield "a plot of a path needs [reach], states = 'path' and the states of all disks (no state_disks)"


def disk_of(column: str, tip: int) -> int:
    """Number of the disk of a column such as `disk7_y_m` or `tip_y_m`, with `tip` as that of the tip; -1 for others."""
    match = re.fullmatch(r"(?:disk(\d+)|tip)_(?:x_m|y_m|angle_rad)", column)
    return -1 if match is None else int(match[1]) if match[1] else tip
