"""Figures of a study: its tables and a plot of its spec in, a matplotlib figure out, and the figure onto disk."""

import io
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy import ndimage

from prb3r.model.manipulator import Manipulator
from prb3r.present import style
from prb3r.present.style import Look, Shown, shown
from prb3r.quantities import Quantity, describe
from prb3r.study.spec import Plot

COLUMN = "_column"
"""Key column of a plot with several y: which of them a row is about."""


@dataclass(frozen=True)
class Scene:
    """What a drawing needs beyond the tables."""

    manipulator: Callable[[int], Manipulator]
    """From `case_id`."""
    quantities: tuple[Quantity, ...] = ()
    """Of metric columns; others are described by their names."""
    fits: tuple[Mapping[str, Any], ...] = ()
    """`x, y, slope, intercept, largest_deviation, where`, all in SI."""


def draw(plot: Plot, cases: pd.DataFrame, states: pd.DataFrame | None, scene: Scene) -> Figure:
    """The figure that `plot` asks for; cases without equilibrium are marked or named in it.

    Raises
    ------
    ValueError
        If the tables lack a column or states that the plot needs, or a unit does not fit.
    """
    kinds = {"lines": lines, "shapes": shapes, "workspace": workspace, "bars": bars}
    with matplotlib.rc_context(style.RC):
        return kinds[plot.kind](Sheet(plot, cases, states, scene))


def save(figure: Figure, folder: str | Path, name: str) -> list[Path]:
    """Write `name.png` (200 dpi) and `name.svg` whole or not at all; the same figure gives the same bytes."""
    paths = []
    for kind, metadata in (("png", {"Software": None}), ("svg", {"Date": None, "Creator": None})):
        content = io.BytesIO()
        with matplotlib.rc_context(style.RC):
            figure.savefig(content, format=kind, dpi=200, metadata=metadata)
        paths.append(write_whole(Path(folder) / f"{name}.{kind}", content.getvalue()))
    return paths


def write_whole(path: Path, content: bytes) -> Path:
    """Replace a file so that readers never see a part of it."""
    temporary = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def selected(rows: pd.DataFrame, where: Mapping[str, Any]) -> pd.DataFrame:
    """Rows whose columns have the given values, or one of a list of values; numbers up to rounding."""
    for column, wanted in where.items():
        wanted = wanted if isinstance(wanted, list) else [wanted]
        if pd.api.types.is_numeric_dtype(rows[column]):
            same = np.isclose(rows[column].to_numpy(float)[:, None], np.asarray(wanted, float), rtol=1e-9, atol=1e-12)
            rows = rows[same.any(1)]
        else:
            rows = rows[rows[column].fillna("").isin(wanted)]
    return rows


@dataclass(frozen=True)
class Sheet:
    """A plot with its data: who is drawn, in which panel, and in which look."""

    plot: Plot
    cases: pd.DataFrame
    states: pd.DataFrame | None
    scene: Scene

    @cached_property
    def rows(self) -> pd.DataFrame:
        """Selected cases (with their states where the plot names columns of those), with key columns."""
        plot, rows = self.plot, selected(self.cases, self.plot.where)
        wanted = [plot.by, plot.style, plot.panel, plot.x, *(plot.y if plot.kind in ("lines", "bars") else ())]
        missing = {column for column in wanted if column and column not in rows}
        if missing and self.states is not None:
            columns = ["case_id", "step", *missing] if plot.kind == "shapes" else self.states.columns
            rows = rows.merge(self.states[list(dict.fromkeys(columns))].drop_duplicates(), "left", "case_id", suffixes=("", "_state"))
        if missing - set(rows):
            raise ValueError(f"plot {plot.name!r}: no column {', '.join(sorted(missing - set(rows)))} in cases or states")
        if plot.kind == "lines":
            rows = pd.concat([rows.assign(**{COLUMN: y, "_y": rows[y]}) for y in plot.y], ignore_index=True)
        keys = {"_by": self.by, "_style": self.style, "_panel": plot.panel}
        return rows.assign(**{key: _values(rows, column) for key, column in keys.items()})

    @property
    def by(self) -> str | None:
        return self.plot.by or (COLUMN if self.plot.kind == "lines" and len(self.plot.y) > 1 else None)

    @property
    def style(self) -> str | None:
        several = self.plot.kind == "lines" and len(self.plot.y) > 1 and self.plot.by is not None
        return self.plot.style or (COLUMN if several else None)

    @cached_property
    def looks(self) -> dict[Any, Look]:
        """Look of each value of `by`: texts keep theirs whichever of them a plot selects."""
        present = _ordered(self.rows["_by"])
        known = _ordered(_values(self.cases, self.by)) if self.by in self.cases else present
        fixed = not pd.api.types.is_numeric_dtype(self.rows["_by"]) and len(known) <= len(style.PALETTE)
        return {value: look for value, look in style.looks(known if fixed else present).items() if value in present}

    @cached_property
    def dashes(self) -> dict[Any, Any]:
        return {value: style.LINES[i % len(style.LINES)] for i, value in enumerate(_ordered(self.rows["_style"]))}

    def line(self, look: Look, key: Any) -> Any:
        return self.dashes[key] if self.style else look.line

    def quantity(self, column: str) -> Quantity:
        return next((q for q in self.scene.quantities if q.name == column), None) or describe(column)

    def shown(self, column: str, unit: str | None = None) -> Shown:
        numbers = self.rows[column] if column in self.rows else ()
        return shown(self.quantity(column), numbers if pd.api.types.is_numeric_dtype(numbers) else (), unit)

    def text(self, column: str, value: Any) -> str:
        """A value of a key column as a legend or a panel title says it."""
        if column == COLUMN:
            return self.quantity(value).title
        if column == "broken_cables":
            return f"cable{'s' * (',' in value)} {value} broken" if value else "all cables intact"
        if isinstance(value, (str, bool)):
            return str(value) or "none"
        quantity, unit = self.quantity(column), self.shown(column)
        if not quantity.symbol:
            return f"{quantity.title} {style.with_unit(value * unit.factor, unit.unit)}"
        return f"${quantity.symbol}$ = {style.with_unit(value * unit.factor, unit.unit)}"

    def panels(self) -> tuple[list[str], list[pd.DataFrame]]:
        """Title and rows of each panel."""
        values = _ordered(self.rows["_panel"])
        titles = [self.text(self.plot.panel, value) if self.plot.panel else "" for value in values]
        return titles, [self.rows[self.rows["_panel"] == value] for value in values]

    def groups(self, rows: pd.DataFrame) -> Iterator[tuple[Look, Any, pd.DataFrame]]:
        """Look, line style and rows of each group of a panel."""
        for value, look in self.looks.items():
            for key in self.dashes:
                group = rows[(rows["_by"] == value) & (rows["_style"] == key)]
                if len(group):
                    yield look, self.line(look, key), group

    def handles(self, patch: bool = False) -> list[Any]:
        """Legend entries of colours and of line styles."""
        entries: list[Any] = []
        for value, look in self.looks.items() if self.by else ():
            text, line = self.text(self.by, value), "-" if self.style else look.line
            if patch:
                entries.append(Patch(facecolor=_pale(look.colour), edgecolor=look.colour, hatch=look.hatch, ls=line, label=text))
            else:
                entries.append(Line2D([], [], color=look.colour, marker=look.marker, ls=line, label=text))
        for value, line in self.dashes.items() if self.style else ():
            entries.append(Line2D([], [], color=style.QUIET, ls=line, label=self.text(self.style, value)))
        return entries


def _values(rows: pd.DataFrame, column: str | None) -> pd.Series:
    if column is None:
        return pd.Series("", rows.index)
    return rows[column] if pd.api.types.is_numeric_dtype(rows[column]) else rows[column].fillna("")


def _ordered(values: pd.Series) -> list[Any]:
    """Distinct values: numbers sorted, texts as they come."""
    distinct = values.dropna().drop_duplicates()
    return (distinct.sort_values() if pd.api.types.is_numeric_dtype(values) else distinct).tolist()


def _pale(colour: Any, share: float = 0.25) -> tuple[float, ...]:
    return tuple(1 - share * (1 - part) for part in matplotlib.colors.to_rgb(colour))


# Lines

FAILED = {"color": style.ALARM, "ls": "", "marker": "x", "mew": 1.1, "ms": 4.5}


def lines(sheet: Sheet) -> Figure:
    """Columns against a column, with published points, fits, a marked value and failed cases."""
    plot, rows = sheet.plot, sheet.rows
    x, y = sheet.shown(plot.x, plot.x_unit), shown(sheet.quantity(plot.y[0]), rows["_y"], plot.y_unit)
    rows["_at"], rows["_up"] = rows[plot.x].astype(float) * x.factor, rows["_y"].astype(float) * y.factor
    fits, points = list(_fits(sheet, x, y)), _published(plot)
    extra = [*(style_of for _, _, style_of in fits), *points.values(), *_failures(rows)]
    titles, parts = sheet.panels()
    figure, axes = style.panels(titles, sheet.handles() + [Line2D([], [], **one) for one in extra], 0.68)
    for one, part in zip(axes, parts, strict=True):
        for index, (look, line, group) in enumerate(sheet.groups(part)):
            _line(one, sheet, group, {"color": look.colour, "marker": look.marker, "ls": line}, index)
        for reach, law, style_of in fits:
            if len(ends := selected(part, reach)["_at"].dropna().agg(["min", "max"]).to_numpy()) and np.isfinite(ends).all():
                one.plot(ends, law(ends), **style_of)
        for point in plot.mark:
            one.plot(point.x * x.factor, point.y * y.factor, **points[point.label])
        if plot.vertical and part[plot.vertical].notna().any():
            _vertical(one, sheet, float(part[plot.vertical].median()), x)
        if plot.y_from_zero and not (rows["_up"] < 0).any():
            one.set_ylim(bottom=0)
    style.outer_labels(axes, x.label, y.label if len(plot.y) == 1 else _common(sheet, y.unit))
    return figure


def _line(axes: Axes, sheet: Sheet, rows: pd.DataFrame, ink: Mapping[str, Any], index: int) -> None:
    """One line: over a factor sorted, several values at one place as median and band; over a metric in case order."""
    axes_x = axes.get_xaxis_transform()
    curve = rows[["_at", "_up"]].rename(columns={"_up": "median"})
    if sheet.plot.x not in {quantity.name for quantity in sheet.scene.quantities}:
        curve = rows.groupby("_at")["_up"].agg(["median", "min", "max"]).reset_index()
        if (curve["max"] > curve["min"]).any():
            axes.fill_between(curve["_at"], curve["min"], curve["max"], color=ink["color"], alpha=0.15, lw=0)
    step = 1 if len(curve) <= 12 else -(-len(curve) // 8)
    axes.plot(curve["_at"], curve["median"], markevery=(index * step // 3 % step, step), mec="white", mew=0.4, **ink)
    failed = rows[rows["outcome"] != "converged"]
    seen = np.isfinite(failed["_up"])
    axes.plot(failed["_at"][seen], failed["_up"][seen], zorder=3, **FAILED)
    edge = failed[~seen & np.isfinite(failed["_at"])]
    axes.plot(edge["_at"], np.full(len(edge), 0.025 + 0.04 * index), transform=axes_x, clip_on=False, **FAILED)
    if lost := int((~seen & failed["_at"].isna()).sum()):
        text = f"× {lost} without equilibrium"
        axes.text(0.99, 0.02 + 0.06 * index, text, transform=axes.transAxes, ha="right", color=ink["color"], fontsize=6.5)


def _failures(rows: pd.DataFrame) -> list[dict[str, Any]]:
    outcomes = rows.loc[rows["outcome"] != "converged", "outcome"].unique()
    return [{**FAILED, "label": " / ".join(outcomes)}] if len(outcomes) else []


def _published(plot: Plot) -> dict[str, dict[str, Any]]:
    """Open symbols, one for each label of published points."""
    labels = dict.fromkeys(point.label for point in plot.mark)
    common = {"color": style.INK, "ls": "", "mfc": "white", "mew": 0.9, "ms": 5.2, "zorder": 4}
    return {text: {**common, "marker": mark, "label": text} for text, mark in zip(labels, style.OPEN_MARKERS, strict=False)}


def _fits(sheet: Sheet, x: Shown, y: Shown) -> Iterator[tuple[dict[str, Any], Callable, dict[str, Any]]]:
    """Which rows each fit of this plot is about, its law in shown units, and its line with the law in words."""
    plot = sheet.plot
    fits = [fit for fit in sheet.scene.fits if plot.fit and fit["x"] == plot.x and fit["y"] in plot.y]
    for index, fit in enumerate(fits):
        reach = dict(fit.get("where") or {}) | ({COLUMN: fit["y"]} if len(plot.y) > 1 else {})
        slope, start = fit["slope"] * y.factor / x.factor, fit["intercept"] * y.factor
        text = law_in_words(slope, fit["largest_deviation"] * y.factor, y.unit, x.unit or _symbol(sheet.quantity(plot.x)))
        if len(fits) > 1:
            text = ", ".join(sheet.text(column, value) for column, value in reach.items()) + ": " + text
        line = {"color": style.QUIET, "ls": style.LINES[(index + 1) % 8], "lw": 1.0, "zorder": 1.8, "label": text}
        yield reach, lambda at, slope=slope, start=start: start + slope * at, line


def law_in_words(slope: float, deviation: float, y_unit: str, x_unit: str) -> str:
    """`56.8 mm per unit μ, within 1.1 mm`."""
    rate = f"{style.with_unit(float(f'{slope:.3g}'), y_unit)} per {x_unit}"
    return f"{rate}, within {style.with_unit(float(f'{deviation:.2g}'), y_unit)}"


def _symbol(quantity: Quantity) -> str:
    return f"unit {quantity.symbol or quantity.title.lower()}"


def _common(sheet: Sheet, unit: str) -> str:
    """Axis label of several columns: the words that all of their names end with."""
    titles = [sheet.quantity(column).title.lower().split() for column in sheet.plot.y]
    same = [words[0] for words in zip(*(title[::-1] for title in titles), strict=False) if len(set(words)) == 1]
    text = " ".join(same[::-1]).capitalize() or "Value"
    return f"{text} ({unit})" if unit else text


def _vertical(axes: Axes, sheet: Sheet, value: float, x: Shown) -> None:
    column = sheet.plot.vertical or ""
    text = f"{sheet.quantity(column).title.lower()}\n{style.with_unit(value * x.factor, x.unit)}"
    axes.axvline(value * x.factor, color=style.INK, lw=0.8, ls=(0, (4, 2)), zorder=1.5)
    right = value * x.factor > np.mean(axes.get_xlim())
    axes.annotate(text, (value * x.factor, 0.98), xycoords=axes.get_xaxis_transform(), xytext=(-3 if right else 3, 0),
                  textcoords="offset points", va="top", ha="right" if right else "left", fontsize=6.5)  # fmt: skip


# Shapes


@dataclass(frozen=True)
class Body:
    """A manipulator in one state as curves to draw, m."""

    disks: np.ndarray
    """(n + 1, 4, 2) corners."""
    plates: np.ndarray
    """(n, points, 2) clamps as straight ends, the arc between as a cubic with the tangents of its disks."""
    cables: tuple[np.ndarray, ...]
    """Each (2k + 2, 2): behind the base disk, then where the cable leaves and enters the holes of k plates."""
    tensions: tuple[np.ndarray, ...]
    """Each (2k + 1,) tension of the parts between those points, N."""


def body(manipulator: Manipulator, state: pd.DataFrame) -> Body:
    """Curves of one state: rows of disks 0..n with `x_m, y_m, angle_rad` and tensions `cable_<name>_n`.

    Raises
    ------
    ValueError
        If disks are missing.
    """
    state = state.sort_values("disk")
    if len(state) != manipulator.plates + 1:
        raise ValueError(f"drawing {manipulator.name!r} takes the states of all its disks, 0 to {manipulator.plates}")
    centre, angle = state[["x_m", "y_m"]].to_numpy(float), state["angle_rad"].to_numpy(float)
    along = np.stack([np.cos(angle), np.sin(angle)], -1)
    across = np.stack([-along[:, 1], along[:, 0]], -1)
    half = manipulator.disk.thickness_m / 2
    near, far = centre - half * along, centre + half * along
    offsets = np.array([[cable.offset(k) for k in range(len(manipulator.segment))] for cable in manipulator.cable])
    height = 1.1 * np.abs(offsets).max() if offsets.size else 0.5 * manipulator.segment[0].length_m
    disks = np.stack([near - height * across, far - height * across, far + height * across, near + height * across], 1)
    clamp = manipulator.per_plate(segment.clamp_m for segment in manipulator.segment)[:, None]
    arc = manipulator.per_plate(segment.length_m for segment in manipulator.segment)[:, None] - 2 * clamp
    start, end = far[:-1] + clamp * along[:-1], near[1:] - clamp * along[1:]
    s = np.linspace(0, 1, 9)[:, None, None]
    curve = (1 + 2 * s) * (1 - s) ** 2 * start + s**2 * (3 - 2 * s) * end
    curve = curve + arc * (s * (1 - s) ** 2 * along[:-1] - s**2 * (1 - s) * along[1:])
    plates = np.moveaxis(np.concatenate([far[None, :-1], curve, near[None, 1:]]), 0, 1)
    cables, tensions = [], []
    for cable in manipulator.cable:
        reach = manipulator.segment_ends[cable.ends_at_segment - 1]
        offset = manipulator.per_plate(cable.offset(k) for k in range(len(manipulator.segment)))[:reach, None]
        leaves, enters = far[:reach] + offset * across[:reach], near[1 : reach + 1] + offset * across[1 : reach + 1]
        behind, last = near[0] + offset[0] * across[0], far[reach] + offset[-1] * across[reach]
        holes = np.stack([leaves, enters], 1).reshape(-1, 2)
        cables.append(np.concatenate([behind[None], holes, last[None]]))
        name = f"cable_{cable.name}_n"
        tension = np.nan_to_num(state[name].to_numpy(float)) if name in state else np.zeros(reach + 1)
        tensions.append(np.repeat(tension[: reach + 1], 2)[1:])
    return Body(disks, plates, tuple(cables), tuple(tensions))


def shapes(sheet: Sheet) -> Figure:
    """Manipulators to scale: plates, disks, cables (as thick as they are tensioned), a mark at each tip."""
    if sheet.states is None:
        raise ValueError(f"plot {sheet.plot.name!r} draws shapes and needs states")
    by_case = {number: state for number, state in sheet.states.groupby("case_id")}
    drawn: dict[int, Body] = {}
    for index, row in sheet.rows.iterrows():
        state = by_case.get(row["case_id"], sheet.states[:0])
        state = state[state["step"] == (row["step"] if "step" in sheet.rows else state["step"].max())]
        if len(state) and np.isfinite(state[["x_m", "y_m", "angle_rad"]].to_numpy(float)).all():
            drawn[index] = body(sheet.scene.manipulator(int(row["case_id"])), state)
    corners = np.concatenate([np.zeros((1, 2)), *(one.disks.reshape(-1, 2) for one in drawn.values())])
    strongest = max((tension.max() for one in drawn.values() for tension in one.tensions), default=0.0)
    titles, parts = sheet.panels()
    figure, axes = style.panels(titles, sheet.handles(), _frame(corners)[2])
    for one, part in zip(axes, parts, strict=True):
        missing = []
        for look, line, group in sheet.groups(part):
            for index, row in group.iterrows():
                if index in drawn:
                    _shape(one, drawn[index], look, line, strongest)
                else:
                    missing.append(": ".join(filter(None, [sheet.text(sheet.by, row["_by"]) if sheet.by else "", row["outcome"]])))
        _to_scale(one, corners)
        _note(one, missing)
    style.outer_labels(axes, "$x$ (mm)", "$y$ (mm)")
    return figure
