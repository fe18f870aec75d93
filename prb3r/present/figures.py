"""Figures of a study: its tables and a plot of its spec in, a matplotlib figure out, and the figure onto disk."""

import io
import itertools
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
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from scipy import ndimage

from prb3r.model.manipulator import Manipulator
from prb3r.present import style
from prb3r.present.style import Look, Shown, shown
from prb3r.quantities import Quantity
from prb3r.study.compare import select
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
        plot, rows = self.plot, select(self.cases, self.plot.where)
        wanted = [plot.by, plot.style, plot.panel, plot.x, *(plot.y if plot.kind in ("lines", "bars") else ())]
        missing = {column for column in wanted if column and column not in rows}
        if missing and self.states is not None:
            columns = ["case_id", "step", *missing] if plot.kind == "shapes" else self.states.columns
            states = self.states[list(dict.fromkeys(columns))].drop_duplicates()
            rows = rows.merge(states, "left", "case_id", suffixes=("", "_state"))
        if absent := sorted(missing - set(rows)):
            raise ValueError(f"plot {plot.name!r}: no column {', '.join(absent)} in cases or states")
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
        return style.quantity_of(column, self.scene.quantities)

    def shown(self, column: str, unit: str | None = None) -> Shown:
        known = column in self.rows and pd.api.types.is_numeric_dtype(self.rows[column])
        return shown(self.quantity(column), self.rows[column] if known else (), unit)

    def text(self, column: str, value: Any) -> str:
        """A value of a key column as a legend or a panel title says it."""
        if column == COLUMN:
            return self.quantity(value).title
        if column == "broken_cables":
            return f"cable{'s' * (',' in value)} {value} broken" if value else "all cables intact"
        if isinstance(value, (str, bool)):
            others = [str(other) for other in self.rows[column].unique()]
            numbered = any(other[:1].isdigit() for other in others) and max(map(len, others)) < 10
            return f"{self.quantity(column).title}: {value}" if numbered else str(value) or "none"
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

    def handles(self, patch: bool = False, solid: bool = False) -> list[Any]:
        """Legend entries of colours (lines, solid ones, or patches) and of line styles."""
        entries: list[Any] = []
        for value, look in self.looks.items() if self.by else ():
            text, line = self.text(self.by, value), "-" if self.style or solid else look.line
            if patch:
                entries.append(Patch(fc=_pale(look.colour), ec=look.colour, hatch=look.hatch, ls=line, label=text))
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

FAILED = {"color": style.INK, "ls": "", "marker": "x", "mew": 1.2, "ms": 4.8}


def lines(sheet: Sheet) -> Figure:
    """Columns against a column, with published points, fits, a marked value and failed cases."""
    plot, rows = sheet.plot, sheet.rows
    x, y = sheet.shown(plot.x, plot.x_unit), shown(sheet.quantity(plot.y[0]), rows["_y"], plot.y_unit)
    rows["_at"], rows["_up"] = rows[plot.x].astype(float) * x.factor, rows["_y"].astype(float) * y.factor
    titles, parts = sheet.panels()
    fits, points, bounds = list(_fits(sheet, x, y)), _published(plot), _verticals(sheet, parts, x)
    extra = [*(ink for _, _, ink in fits), *points.values(), *bounds[:1], *_failures(rows)]
    figure, axes = style.panels(titles, [*sheet.handles(), *_band(sheet), *map(_entry, extra)], 0.68)
    for number, (one, part) in enumerate(zip(axes, parts, strict=True)):
        for index, (look, line, group) in enumerate(sheet.groups(part)):
            ink = {"color": look.colour, "marker": look.marker, "ls": line} | ({"lw": 0.6} if fits else {})
            _line(one, sheet, group, ink, index)
        for reach, law, ink in fits:
            ends = select(part, reach).dropna(subset=["_up"])["_at"].agg(["min", "max"]).to_numpy()
            if np.isfinite(ends).all():
                one.plot(ends, law(ends), **ink)
        for point in plot.mark:
            one.plot(point.x * x.factor, point.y * y.factor, **points[point.label])
        if bounds and np.isfinite(bounds[number]["at"]):
            one.axvline(bounds[number]["at"], **{key: value for key, value in bounds[number].items() if key != "at"})
        if _in_order(sheet) and len(axes) == 1:
            one.set_aspect("equal", adjustable="datalim")
        if plot.log_y:
            one.set_yscale("log")
            one.minorticks_off()
        elif plot.y_from_zero and not (rows["_up"] < 0).any():
            one.set_ylim(bottom=0)
    style.outer_labels(axes, x.label, y.label if len(plot.y) == 1 else _common(sheet, y.unit))
    return figure


def _entry(ink: Mapping[str, Any]) -> Line2D:
    """A legend entry drawn as its lines or marks are."""
    return Line2D([], [], **{key: value for key, value in ink.items() if key != "at"})


def _in_order(sheet: Sheet) -> bool:
    """Whether the plot is a locus, y positions over x positions, whose lines follow the cases instead of x."""
    return sheet.plot.x.endswith("x_m") and all(y.endswith("y_m") for y in sheet.plot.y)


def _band(sheet: Sheet) -> list[Patch]:
    """Legend entry of the bands, if cases of one line share a place."""
    spread = sheet.rows.groupby(["_panel", "_by", "_style", "_at"])["_up"].agg(np.ptp)
    if _in_order(sheet) or not (spread > 0).any():
        return []
    return [Patch(fc=style.PALE, lw=0, label="median and range of cases that differ otherwise")]


def _line(axes: Axes, sheet: Sheet, rows: pd.DataFrame, ink: Mapping[str, Any], index: int) -> None:
    """One line: sorted, several values at one place as median and band; a locus in the order of the cases.

    Failed cases are crosses: at their value if they have one, else at the lower edge.
    """
    curve = rows[["_at", "_up"]].rename(columns={"_up": "median"})
    if not _in_order(sheet):
        curve = rows.groupby("_at")["_up"].agg(["median", "min", "max"]).reset_index()
        if (curve["max"] > curve["min"]).any():
            axes.fill_between(curve["_at"], curve["min"], curve["max"], color=ink["color"], alpha=0.15, lw=0)
    step = 1 if len(curve) <= 12 else -(-len(curve) // 8)
    axes.plot(curve["_at"], curve["median"], markevery=(index * step // 3 % step, step), mec="white", mew=0.4, **ink)
    cross = FAILED | {"color": ink["color"]}
    failed = rows[(rows["outcome"] != "converged") & rows["_at"].notna()]
    seen, edge = failed[failed["_up"].notna()], failed[failed["_up"].isna()]
    if len(seen):
        axes.plot(seen["_at"], seen["_up"], zorder=3, **cross)
    if len(edge):
        height = np.full(len(edge), 0.03 + 0.05 * index)
        axes.plot(edge["_at"], height, transform=axes.get_xaxis_transform(), zorder=3, **cross)


def _failures(rows: pd.DataFrame) -> list[dict[str, Any]]:
    """Legend entry of each way in which cases failed, with their number."""
    failed = rows[rows["outcome"] != "converged"]
    placed = failed["_at"].notna() if "_at" in failed else failed["outcome"].notna()
    entries = []
    for outcome, group in failed.groupby("outcome"):
        count, lost = group["case_id"].nunique(), group["case_id"][~placed[group.index]].nunique()
        aside = f", {lost} of them without a place" if lost else ""
        entries.append(f"{outcome} ({count} case{'s' * (count > 1)}{aside})")
    return [{**FAILED, "label": text} for text in entries]


def _verticals(sheet: Sheet, parts: list[pd.DataFrame], x: Shown) -> list[dict[str, Any]]:
    """The marked value of each panel; its line names it, with the value if all panels have the same."""
    column = sheet.plot.vertical
    if column is None:
        return []
    values = [float(part[column].median()) * x.factor for part in parts]
    ends = dict.fromkeys(style.with_unit(end, x.unit) for end in (np.nanmin(values), np.nanmax(values)))
    text = f"{sheet.quantity(column).title.lower()}, {' to '.join(ends)}"
    ink = {"color": style.INK, "lw": 0.8, "ls": (0, (7, 2)), "zorder": 1.5, "label": text}
    return [{**ink, "at": value} for value in values]


def _published(plot: Plot) -> dict[str, dict[str, Any]]:
    """Open symbols, one for each label of published points."""
    labels = dict.fromkeys(point.label for point in plot.mark)
    common = {"color": style.INK, "ls": "", "mfc": "white", "mew": 0.9, "ms": 5.2, "zorder": 4}
    marks = itertools.cycle(style.OPEN_MARKERS)
    return {text: {**common, "marker": next(marks), "label": text} for text in labels}


def _fits(sheet: Sheet, x: Shown, y: Shown) -> Iterator[tuple[dict[str, Any], Callable, dict[str, Any]]]:
    """Which rows each fit of this plot is about, its law in shown units, and its line with the law in words."""
    plot = sheet.plot
    fits = [fit for fit in sheet.scene.fits if fit["x"] == plot.x and fit["y"] in plot.y]
    fits = [fit for fit in fits if plot.fit and fit["slope"] is not None]
    for index, fit in enumerate(sorted(fits, key=lambda fit: plot.y.index(fit["y"]))):
        reach = dict(fit.get("where") or {}) | ({COLUMN: fit["y"]} if len(plot.y) > 1 else {})
        slope, start = fit["slope"] * y.factor / x.factor, fit["intercept"] * y.factor
        per = x.unit or _symbol(sheet.quantity(plot.x))
        text = law_in_words(slope, fit["largest_deviation"] * y.factor, y.unit, per)
        about = [sheet.text(column, value) for column, value in reach.items() if column not in plot.where]
        text = f"{', '.join(about)}: {text}" if about else text
        ink = {"color": style.INK, "ls": style.LINES[(index + 1) % 8], "lw": 0.9, "zorder": 1.8, "label": text}
        yield reach, lambda at, slope=slope, start=start: start + slope * at, ink


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
    drawn = _bodies(sheet)
    corners = np.concatenate([[[-0.016, 0.0]], *(one.disks.reshape(-1, 2) for one in drawn.values())])
    strongest = max((tension.max() for one in drawn.values() for tension in one.tensions), default=0.0)
    missing = sheet.rows[~sheet.rows.index.isin(list(drawn))]
    notes = [_not_drawn(sheet, row, str(row["outcome"])) for _, row in missing.iterrows()]
    titles, parts = sheet.panels()
    figure, axes = style.panels(titles, sheet.handles(solid=True) + _notes(notes), _frame(corners)[2])
    for one, part in zip(axes, parts, strict=True):
        for look, line, group in sheet.groups(part):
            for index in group.index.intersection(list(drawn)):
                _shape(one, drawn[index], look, line if sheet.style else "-", strongest)
        _ground(one, drawn)
        _to_scale(one, corners)
    style.outer_labels(axes, "$x$ (mm)", "$y$ (mm)")
    return figure


def _bodies(sheet: Sheet) -> dict[int, Body]:
    """What can be drawn, by row: the state of that row's step, or the last one of its case."""
    if sheet.states is None:
        raise ValueError(f"plot {sheet.plot.name!r} draws shapes and needs states")
    by_case = dict(iter(sheet.states.groupby("case_id")))
    drawn: dict[int, Body] = {}
    for index, row in sheet.rows.iterrows():
        state = by_case.get(row["case_id"], sheet.states[:0])
        state = state[state["step"] == (row["step"] if "step" in sheet.rows else state["step"].max())]
        if len(state) and np.isfinite(state[["x_m", "y_m", "angle_rad"]].to_numpy(float)).all():
            drawn[index] = body(sheet.scene.manipulator(int(row["case_id"])), state)
    return drawn


def _not_drawn(sheet: Sheet, row: pd.Series, what: str) -> str:
    keys = {sheet.plot.panel: "_panel", sheet.by: "_by", sheet.style: "_style"}
    names = [sheet.text(column, row[key]) for column, key in keys.items() if column]
    return f"{', '.join(names)}: {what}" if names else what


def _notes(texts: list[str], most: int = 6) -> list[Line2D]:
    """Legend entries for what is not drawn."""
    more = [f"and {len(texts) - most} more"] if len(texts) > most else []
    return [_entry({**FAILED, "label": text}) for text in texts[:most] + more]


def _ground(axes: Axes, drawn: Mapping[int, Body]) -> None:
    """The wall that holds the base disk."""
    if drawn:
        base = 1e3 * next(iter(drawn.values())).disks[0]
        back, low, high = base[:, 0].min(), base[:, 1].min(), base[:, 1].max()
        wall = [(back, low), (back - 9, low), (back - 9, high), (back, high)]
        axes.add_patch(Polygon(wall, facecolor="none", edgecolor=style.QUIET, hatch="/////", lw=0))


def straight(manipulator: Manipulator) -> Body:
    """The manipulator at rest, without tension."""
    pitch = manipulator.per_plate(segment.length_m for segment in manipulator.segment) + manipulator.disk.thickness_m
    x = np.concatenate([[0.0], np.cumsum(pitch)]) - manipulator.disk.thickness_m / 2
    return body(manipulator, pd.DataFrame({"disk": range(len(x)), "x_m": x, "y_m": 0.0, "angle_rad": 0.0}))


def _shape(axes: Axes, drawn: Body, look: Look, line: Any, strongest: float) -> None:
    """One manipulator: slack cables grey, tensioned ones in its colour and as thick as their tension."""
    for cable, tension in zip(drawn.cables, drawn.tensions, strict=True):
        spans = 1e3 * np.stack([cable[:-1], cable[1:]], 1)
        if strongest > 0 and tension[0] > 1e-9 * strongest:
            widths = 0.35 + 1.1 * tension / strongest
            axes.add_collection(LineCollection(spans, colors=[look.colour], linewidths=widths, zorder=2.4))
        else:
            axes.add_collection(LineCollection(spans, colors=[style.PALE], linewidths=0.4, zorder=2.0))
    axes.add_collection(LineCollection(1e3 * drawn.plates, colors=[look.colour], linewidths=1.5, zorder=2.6))
    fill = {"facecolors": [_pale(look.colour)], "edgecolors": [look.colour], "linewidths": 0.5}
    axes.add_collection(PolyCollection(1e3 * drawn.disks, zorder=2.5, **fill))
    tip = 1e3 * drawn.disks[-1].mean(0)
    if line != "-":
        axes.plot(*1e3 * drawn.plates.reshape(-1, 2).T, color="white", ls=line, lw=0.8, zorder=2.7)
    axes.plot(*tip, marker=look.marker, color=look.colour, mec="white", mew=0.5, ms=5, zorder=3)


def _frame(points: np.ndarray) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Limits along x and y with a margin, mm, and height over width; points in m."""
    low, high = 1e3 * np.nanmin(points, 0), 1e3 * np.nanmax(points, 0)
    margin = 0.04 * np.max(high - low) + 1e-9
    x, y = (low[0] - margin, high[0] + margin), (low[1] - margin, high[1] + margin)
    return x, y, (y[1] - y[0]) / (x[1] - x[0])


def _to_scale(axes: Axes, points: np.ndarray) -> None:
    x, y, _ = _frame(points)
    axes.set(xlim=x, ylim=y)
    axes.set_aspect("equal")
    axes.locator_params(nbins=6, steps=[1, 2, 5, 10])


# Workspaces


def workspace(sheet: Sheet) -> Figure:
    """Regions that tips reach: overlaid outlines told apart by colour, hatch and line; a lone one with its density."""
    if sheet.states is None:
        raise ValueError(f"plot {sheet.plot.name!r} draws workspaces and needs states")
    tips = sheet.states[sheet.states["disk"] == sheet.states["disk"].max()]
    clouds = {number: cloud[["x_m", "y_m"]].to_numpy(float) for number, cloud in tips.groupby("case_id")}
    clouds = {number: clouds.get(number, np.zeros((0, 2))) for number in sheet.rows["case_id"].unique()}
    reached = {number: cloud[np.isfinite(cloud).all(1)] for number, cloud in clouds.items()}
    notes = []
    for _, row in sheet.rows.iterrows():
        count, good = len(clouds[row["case_id"]]), len(reached[row["case_id"]])
        if good < count or not count:
            what = f"{count - good:,} of {count:,} loads without equilibrium" if count else str(row["outcome"])
            notes.append(_not_drawn(sheet, row, what))
    titles, parts = sheet.panels()
    rests = [straight(sheet.scene.manipulator(int(part["case_id"].iloc[0]))) for part in parts]
    corners = np.concatenate([*(rest.disks.reshape(-1, 2) for rest in rests), *reached.values()])
    figure, axes = style.panels(titles, sheet.handles(patch=True) + _notes(notes), _frame(corners)[2])
    for one, part, rest in zip(axes, parts, rests, strict=True):
        _shape(one, rest, Look(style.PALE, "", "-", ""), "-", 0.0)
        groups = list(sheet.groups(part))
        for look, line, group in groups:
            points = np.concatenate([reached[number] for number in group["case_id"]])
            if len(points) > 2:
                _region(one, points, look, line, lone=len(groups) == 1)
        _to_scale(one, corners)
    style.outer_labels(axes, "tip $x$ (mm)", "tip $y$ (mm)")
    return figure


def occupancy(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Centres of square cells (m), points in each (x, y), and the region as a smoothed mask: inside above one half.

    Cells are as small as the points allow, about eight in each on average.
    """
    low, size = points.min(0), max(*np.ptp(points, axis=0), 1e-9)
    coarse = size / np.clip(np.sqrt(len(points)) / 4, 8, 60)
    taken = len(np.unique(np.floor((points - low) / coarse), axis=0))
    side = np.clip(coarse * np.sqrt(8 * taken / len(points)), size / 200, size / 8)
    counts = np.ceil(np.ptp(points, axis=0) / side).astype(int) + 9
    edges = [start + side * (np.arange(count + 1) - 4) for start, count in zip(low, counts, strict=True)]
    filled, *_ = np.histogram2d(*points.T, bins=edges)
    mask = ndimage.binary_closing(filled > 0, ndimage.iterate_structure(ndimage.generate_binary_structure(2, 1), 3))
    x, y = (edge[:-1] + side / 2 for edge in edges)
    return x, y, filled, ndimage.gaussian_filter(mask.astype(float), 1.0)


def _region(axes: Axes, points: np.ndarray, look: Look, line: Any, lone: bool) -> None:
    x, y, filled, inside = occupancy(points)
    at = 1e3 * x, 1e3 * y, inside.T
    if lone:
        density = np.where(inside > 0.5, ndimage.gaussian_filter(filled, 1.0), np.nan)
        shades = LinearSegmentedColormap.from_list("", [_pale(look.colour, 0.12), _pale(look.colour, 0.75)])
        axes.pcolormesh(*at[:2], np.log1p(density).T, cmap=shades, rasterized=True, zorder=1.1)
    else:
        fills = [axes.contourf(*at, levels=[0.5, 2.0], colors=[look.colour], alpha=0.10, zorder=1.1)]
        if look.hatch:
            fills.append(axes.contourf(*at, levels=[0.5, 2.0], colors="none", hatches=[look.hatch], zorder=1.2))
            fills[1].set(edgecolor=_pale(look.colour, 0.55), linewidth=0.0)
        for fill in fills:
            fill.set_rasterized(True)
    axes.contour(*at, levels=[0.5], colors=[look.colour], linestyles=[line], linewidths=1.0, zorder=1.6)


# Bars


def bars(sheet: Sheet) -> Figure:
    """Grouped bars, a panel for each metric with its own unit; whiskers span the cases that share a bar."""
    plot, rows = sheet.plot, sheet.rows
    handles = [*sheet.handles(patch=True, solid=True), *(_entry(ink) for ink in _failures(rows))]
    units = [sheet.shown(metric, plot.y_unit if len(plot.y) == 1 else None) for metric in plot.y]
    figure, axes = style.panels([unit.label for unit in units], handles, 0.62, shared=False)
    places = _ordered(_values(rows, plot.x))
    groups = list(sheet.groups(rows))
    width = 0.8 / max(len(groups), 1)
    for one, metric, unit in zip(axes, plot.y, units, strict=True):
        for index, (look, line, group) in enumerate(groups):
            at = np.arange(len(places)) + (index - (len(groups) - 1) / 2) * width
            ink = {"fc": _pale(look.colour, 0.7), "ec": look.colour, "hatch": look.hatch, "width": 0.92 * width}
            values = group.assign(_x=_values(group, plot.x), _v=group[metric] * unit.factor)
            _bar(one, at, places, values, ink | ({"ls": line} if sheet.style else {}))
        one.set_xticks(range(len(places)), [_tick(sheet, place) for place in places])
        one.grid(False, axis="x")
        if plot.x != "broken_cables":
            one.set_xlabel(sheet.shown(plot.x).label)
    return figure


def _bar(axes: Axes, at: np.ndarray, places: list[Any], group: pd.DataFrame, ink: Mapping[str, Any]) -> None:
    """The bars of one group: medians, with whiskers where cases share a bar and crosses where cases failed."""
    spread = group.groupby("_x")["_v"].agg(["min", "median", "max"]).reindex(places).to_numpy(float)
    low, middle, high = spread.T
    axes.bar(at, middle, lw=0.7, **ink)
    if (high > low).any():
        whiskers = [middle - low, high - middle]
        axes.errorbar(at, middle, whiskers, fmt="none", ecolor=style.INK, elinewidth=0.7, capsize=1.5)
    failed = at[np.isin(places, group["_x"][group["outcome"] != "converged"])]
    if len(failed):
        axes.plot(failed, np.full(len(failed), 0.03), transform=axes.get_xaxis_transform(), **FAILED)


def _tick(sheet: Sheet, value: Any) -> str:
    column = sheet.plot.x or ""
    if column == "broken_cables":
        return "\n".join(sheet.text(column, value).rsplit(" ", 1))
    return str(value) if isinstance(value, (str, bool)) else style.number(value * sheet.shown(column).factor)
