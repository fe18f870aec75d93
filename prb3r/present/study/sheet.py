"""A plot together with its data: the rows that it shows, their groups with looks and panels, and legend entries."""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from prb3r.model.files.cells import count
from prb3r.model.manipulator import Manipulator
from prb3r.present import style
from prb3r.present.legends import named_in_legend, without_repeats
from prb3r.present.style import Look, Shown, pale, shown
from prb3r.quantities import Quantity
from prb3r.study.compare import select
from prb3r.study.plots.base import COLUMN, Panelled, Plot

FAILED_MARK: dict[str, Any] = {"color": style.INK, "ls": "", "marker": "x", "mew": 1.2, "ms": 4.8}
"""Cross of failed cases."""
UNBOUNDED_MARK: dict[str, Any] = {"color": style.INK, "ls": "", "marker": "^", "mfc": "white", "mew": 0.9, "ms": 4.8}
"""Triangle of cases whose value is without bound, at the upper edge."""

PlotKind = TypeVar("PlotKind", bound=Plot)
"""The kind of plot that is drawn."""


@dataclass(frozen=True)
class Scene:
    """What a drawing needs beyond the tables of cases and states."""

    manipulator: Callable[[int], Manipulator]
    """The manipulator of a case, by its `case_id`."""
    quantities: tuple[Quantity, ...] = ()
    """Descriptions of columns; other columns are described by their names."""
    fits: tuple[Mapping[str, Any], ...] = ()
    """Fitted lines: `x, y, slope, intercept, largest_deviation, where`, all in SI."""
    sampled: frozenset[str] = frozenset()
    """Factors whose values are random samples; cases have no order then along which a line could join them."""
    reach: Callable[[int], Mapping[str, Any]] = lambda case: {}
    """Disk and targets of the path that a case follows, by its `case_id`."""
    loads: int | None = None
    """Number of first loads of each cloud to which the states are limited; None: the states are all."""
    factors: tuple[str, ...] = ()
    """Columns of the cases that hold factors."""
    compared: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """By column of a comparison, what is known of the cases that others are compared with."""


@dataclass(frozen=True)
class Sheet(Generic[PlotKind]):
    """A plot with its data: which cases are drawn, in which panel, and with which look."""

    plot: PlotKind
    cases: pd.DataFrame
    states: pd.DataFrame | None
    scene: Scene

    @cached_property
    def rows(self) -> pd.DataFrame:
        """The selected cases, joined with states if the plot names columns of these, and with key columns.

        Tensions are those at the base disk, which are applied.
        Key columns hold the values by which rows are told apart: `_by` (colour), `_style` (line style) and `_panel`.
        In a plot that stacks columns, each row becomes one for each of them, with its value in `_y`.

        Raises
        ------
        ValueError
            If no case is selected, or a column is in neither table.
        """
        plot, rows = self.plot, select(self.cases, self.plot.where)
        if plot.behind:
            rows = rows.drop(select(rows, plot.behind).index)
        if rows.empty:
            raise ValueError(f"plot {plot.name!r}: no case has {plot.where}")
        missing = {column for column in plot.drawn() if column and column not in rows}
        if missing and self.states is not None:
            states = self.states if plot.stepwise else self.states[self.states["disk"] == self.states["disk"].min()]
            columns = ["case_id", "step", *missing] if plot.stepwise else states.columns
            states = states[list(dict.fromkeys(columns))].drop_duplicates()
            rows = rows.merge(states, "left", "case_id", suffixes=("", "_state"))
        if absent := sorted(missing - set(rows)):
            raise ValueError(f"plot {plot.name!r}: no column {', '.join(absent)} in cases or states")
        if plot.stacked:
            rows = pd.concat([rows.assign(**{COLUMN: y, "_y": rows[y]}) for y in plot.stacked], ignore_index=True)
        keys = {"_by": self.by, "_style": self.style, "_panel": self.panel}
        return rows.assign(**{key: values_of(rows, column) for key, column in keys.items()})

    @property
    def by(self) -> str | None:
        """The column whose values differ in colour and mark, if any."""
        return self.plot.groups.by

    @property
    def style(self) -> str | None:
        """The column whose values differ in line style, if any."""
        return self.plot.groups.style

    @property
    def panel(self) -> str | None:
        """The column with a panel for each value, if any."""
        return self.plot.groups.panel

    @cached_property
    def looks(self) -> dict[Any, Look]:
        """Look of each value of `by`; words keep the same look in all plots of a study, whichever of them are shown."""
        present = ordered(self.rows["_by"])
        known = ordered(values_of(self.cases, self.by)) if self.by in self.cases else present
        fixed = not pd.api.types.is_numeric_dtype(self.rows["_by"]) and len(known) <= len(style.palette())
        return {value: look for value, look in style.looks(known if fixed else present).items() if value in present}

    @cached_property
    def dashes(self) -> dict[Any, Any]:
        """Line style of each value of `style`."""
        return {value: style.LINES[i % len(style.LINES)] for i, value in enumerate(ordered(self.rows["_style"]))}

    def line(self, look: Look, key: Any) -> Any:
        """Line style of a group: that of its value `key` of `style` or, if the plot has no such column, of its look."""
        return self.dashes[key] if self.style else look.line

    def quantity(self, column: str) -> Quantity:
        """Name, symbol, unit and meaning of a column."""
        return style.quantity_of(column, self.scene.quantities)

    def shown(self, column: str, unit: str | None = None) -> Shown:
        """How a column is shown: in `unit`, or in the one that suits the size of its values."""
        known = column in self.rows and pd.api.types.is_numeric_dtype(self.rows[column])
        return shown(self.quantity(column), self.rows[column] if known else (), unit)

    def text(self, column: str | None, value: Any) -> str:
        """A value of a column as legends and panel titles say it; empty without a column."""
        if column is None:
            return ""
        if column == COLUMN:
            title = self.quantity(value).title.split()
            beginning = title[: len(title) - len(self.ending_of_stacked.split())]
            return " ".join(beginning or title)
        if column == "broken_cables":
            return f"cable{'s' * (',' in value)} {style.literal(value)} broken" if value else "all cables intact"
        if isinstance(value, (str, bool)):
            others = [str(other) for other in self.rows[column].unique()]
            numbered = any(other[:1].isdigit() for other in others) and max(map(len, others)) < 10
            words = style.literal(str(value))
            return f"{self.quantity(column).title}: {words}" if numbered else words or "none"
        quantity, unit = self.quantity(column), self.shown(column)
        if not quantity.symbol:
            return f"{quantity.title} {style.with_unit(value * unit.factor, unit.unit)}"
        return f"{style.symbol_text(quantity.symbol)} = {style.with_unit(value * unit.factor, unit.unit)}"

    @cached_property
    def ending_of_stacked(self) -> str:
        """The words that the titles of all stacked columns end with, in small letters; of a single column all words."""
        titles = [self.quantity(column).title.lower().split()[::-1] for column in self.plot.stacked]
        same = itertools.takewhile(lambda words: len(set(words)) == 1, zip(*titles, strict=False))
        return " ".join([words[0] for words in same][::-1])

    def panels(self) -> tuple[list[str], list[pd.DataFrame]]:
        """Titles of the panels, and the rows in each."""
        values = ordered(self.rows["_panel"])
        parts = [self.rows[self.rows["_panel"] == value] for value in values]
        titles = [self.text(self.panel, value) if self.panel else "" for value in values]
        notes = map(self._note, parts)
        return [", ".join(filter(None, pair)) for pair in zip(titles, notes, strict=True)], parts

    def _note(self, part: pd.DataFrame) -> str:
        """The value of the plot's column `note`, to two digits, if all rows of a panel have the same; else empty."""
        column = self.plot.note if isinstance(self.plot, Panelled) else None
        if column is None or part[column].nunique() != 1:
            return ""
        if not pd.api.types.is_numeric_dtype(part[column]):
            return style.literal(str(part[column].dropna().iloc[0]))
        unit = self.shown(column)
        return style.with_unit(float(f"{part[column].iloc[0] * unit.factor:.2g}"), unit.unit)

    def groups(self, rows: pd.DataFrame) -> Iterator[tuple[Look, Any, pd.DataFrame]]:
        """Look, line style and rows of each group of a panel."""
        for value, look in self.looks.items():
            for key in self.dashes:
                group = rows[(rows["_by"] == value) & (rows["_style"] == key)]
                if len(group):
                    yield look, self.line(look, key), group

    def handles(self, patch: bool = False, solid: bool = False) -> list[Any]:
        """Legend entries of colours and of line styles.

        Colours are shown by lines, by `solid` lines whatever their look, or by a `patch`.
        """
        entries: list[Any] = []
        named = named_in_legend(list(self.looks)) if self.by else []
        for value, text in zip(named, without_repeats([self.text(self.by, value) for value in named]), strict=True):
            look = self.looks[value]
            line = "-" if self.style or solid else look.line
            if patch:
                entries.append(Patch(fc=pale(look.colour), ec=look.colour, hatch=look.hatch, ls=line, label=text))
            else:
                entries.append(Line2D([], [], color=look.colour, marker=look.marker, ls=line, label=text))
        if self.by and len(named) < len(self.looks):
            more = f"and {len(self.looks) - len(named):,} more values"
            entries.append(Line2D([], [], ls="", label=more))
        texts = without_repeats([self.text(self.style, value) for value in self.dashes]) if self.style else []
        for text, line in zip(texts, self.dashes.values(), strict=bool(texts)):
            entries.append(Line2D([], [], color=style.QUIET, ls=line, label=text))
        return entries


def values_of(rows: pd.DataFrame, column: str | None) -> pd.Series:
    """A column by which rows are grouped: empty cells of words as "", and "" for all rows without a column."""
    if column is None:
        return pd.Series("", rows.index)
    return rows[column] if pd.api.types.is_numeric_dtype(rows[column]) else rows[column].fillna("")


def ordered(values: pd.Series) -> list[Any]:
    """Distinct values: numbers sorted, words in the order in which they first appear."""
    distinct = values.dropna().drop_duplicates()
    return (distinct.sort_values() if pd.api.types.is_numeric_dtype(values) else distinct).tolist()


def begin_at_zero(panels: Sequence[Axes]) -> None:
    """Let y axes begin at zero, except if a value in the panel, or in one that shares its axis, is negative."""
    for panel in panels:
        sharing = panel.get_shared_y_axes().get_siblings(panel)
        if min(other.dataLim.y0 for other in sharing) >= 0:
            panel.set_ylim(bottom=0)


def entry(ink: Mapping[str, Any]) -> Line2D:
    """A legend entry with the look and the label of lines or marks; the place `at` of a look is ignored."""
    return Line2D([], [], **{key: value for key, value in ink.items() if key != "at"})


def failures(rows: pd.DataFrame) -> list[dict[str, Any]]:
    """Look and label for each outcome of failed cases, with their number; :func:`entry` makes the legend entry."""
    failed = rows[rows["outcome"] != "converged"]
    placed = failed["_at"].notna() if "_at" in failed else failed["outcome"].notna()
    entries = []
    for outcome, group in failed.groupby("outcome"):
        number, lost = group["case_id"].nunique(), group["case_id"][~placed[group.index]].nunique()
        low = group["_up"].isna().sum() if "_up" in group else 0
        aside = f", {lost} of them without a place" if lost else ", at the lower edge: without a value" if low else ""
        entries.append(f"{outcome} ({count(number, 'case')}{aside})")
    return [{**FAILED_MARK, "label": text} for text in entries]


def unbounded(rows: pd.DataFrame, columns: Sequence[str]) -> list[dict[str, Any]]:
    """Look and label of cases in which one of the `columns` is without bound, as of :func:`failures`; none without."""
    cases = rows.loc[np.isinf(rows[list(columns)].to_numpy(float)).any(1), "case_id"].nunique()
    text = f"at the upper edge: without bound ({count(cases, 'case')})"
    return [{**UNBOUNDED_MARK, "label": text}] if cases else []
