"""The plot `lines`: columns of one unit over another column, with fitted lines, published points and failed cases."""

import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator
from matplotlib.transforms import ScaledTranslation

from prb3r.present import canvas, style
from prb3r.present.spots import LAST, point_at
from prb3r.present.study.bars import name_places
from prb3r.present.study.sheet import (
    FAILED_MARK,
    UNBOUNDED_MARK,
    Sheet,
    begin_at_zero,
    entry,
    failures,
    ordered,
    unbounded,
    values_of,
)
from prb3r.present.style import Shown, shown
from prb3r.quantities import Quantity
from prb3r.study.compare import select
from prb3r.study.plots.base import COLUMN
from prb3r.study.plots.kinds import LinesPlot

EDGE_STEP = 0.02
"""Height between the marks at an edge of two lines, as a share of the panel's."""


def lines_figure(sheet: Sheet[LinesPlot]) -> Figure:
    """Lines of the y columns over the x column, with fits, published points, a vertical line and failed cases."""
    plot, rows = sheet.plot, sheet.rows
    places = _places(sheet)
    x, y = sheet.shown(plot.x, plot.x_unit), shown(sheet.quantity(plot.y[0]), rows["_y"], plot.y_unit)
    at = values_of(rows, plot.x).map(places.index) if places else rows[plot.x]
    rows["_at"], rows["_up"] = at.astype(float) * x.factor, rows["_y"].astype(float) * y.factor
    endless = unbounded(rows, ["_up"])
    drawable = np.isfinite(rows["_up"]) & ((rows["_up"] > 0) | (not plot.log_y))
    rows["_endless"], rows["_up"] = np.isinf(rows["_up"]), rows["_up"].where(drawable)
    titles, parts = sheet.panels()
    fits, points, bounds = list(_fits(sheet, x, y)), _published(plot), _verticals(sheet, parts, x)
    extra = [*points.values(), *bounds[:1], *failures(rows), *endless]
    figure, axes = canvas.panels(titles, [*sheet.handles(), *_band(sheet), *map(entry, extra)], 0.68)
    for number, (panel, part) in enumerate(zip(axes, parts, strict=True)):
        for index, (look, line, group) in enumerate(sheet.groups(part)):
            ink = {"color": look.colour, "marker": look.marker, "ls": line} | ({"lw": 0.6} if fits else {})
            if sheet.scene.sampled:
                ink |= {"ls": ""}
            _line(panel, sheet, group, ink, index)
        for reach, law, ink in fits:
            ends = select(part, reach).dropna(subset=["_up"])["_at"].agg(["min", "max"]).to_numpy()
            if np.isfinite(ends).all():
                panel.plot(ends, law(ends), **ink)
                _told_beside(panel, ends, law(ends), ink["label"])
        for point in plot.mark:
            panel.plot(point.x * x.factor, point.y * y.factor, **points[point.label])
        point_at(panel, part[["_at", "_up"]], part["case_id"], part.get("step", LAST))
        if bounds and np.isfinite(bounds[number]["at"]):
            panel.axvline(bounds[number]["at"], **{key: value for key, value in bounds[number].items() if key != "at"})
        if _in_order(sheet) and len(axes) == 1:
            panel.set_aspect("equal", adjustable="datalim")
        if places:
            name_places(panel, sheet, places)
            panel.set_xlim(-0.5, len(places) - 0.5)
        if plot.log_y:
            panel.set_yscale("log")
            panel.minorticks_off()
            if np.divide(*panel.get_ylim()) > 0.01:  # less than two decades
                panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                panel.yaxis.set_major_formatter(lambda y, _: style.digits(y))
    if plot.y_from_zero:
        begin_at_zero(axes)
    canvas.outer_labels(axes, x.label, y.label if len(plot.y) == 1 else _common(sheet, y.unit))
    return figure


def _places(sheet: Sheet[LinesPlot]) -> list[Any]:
    """The words of the x column, which stand beside each other on the axis; empty where it holds numbers."""
    values = values_of(sheet.rows, sheet.plot.x)
    return [] if pd.api.types.is_numeric_dtype(values) else ordered(values)


def _in_order(sheet: Sheet[LinesPlot]) -> bool:
    """Whether the plot is a locus, y positions over x positions; its lines follow the order of cases instead of x."""
    return sheet.plot.x.endswith("x_m") and all(y.endswith("y_m") for y in sheet.plot.y)


def _band(sheet: Sheet[LinesPlot]) -> list[Patch]:
    """Legend entry of the bands, if several cases of one line share a value of x; else none."""
    spread = sheet.rows.groupby(["_panel", "_by", "_style", "_at"])["_up"].agg(np.ptp)
    if _in_order(sheet) or sheet.scene.sampled or not (spread > 0).any():
        return []
    return [Patch(fc=style.PALE, lw=0, label="median and range of cases that differ otherwise")]


def _line(axes: Axes, sheet: Sheet[LinesPlot], rows: pd.DataFrame, ink: Mapping[str, Any], index: int) -> None:
    """Draw one line, by rising x; several values at one x as their median and a band from the least to the greatest.

    A locus follows the order of the cases.  Sampled cases are marks without a line.  Failed cases are crosses: at their
    value if they have one, else at the lower edge; values without bound are triangles at the upper one.  `index`, the
    number of the line, shifts its marks and crosses.
    """
    curve = rows[["_at", "_up"]].rename(columns={"_up": "median"})
    if not _in_order(sheet) and not sheet.scene.sampled:
        curve = rows.groupby("_at")["_up"].agg(["median", "min", "max"]).reset_index()
        if (curve["max"] > curve["min"]).any():
            axes.fill_between(curve["_at"], curve["min"], curve["max"], color=ink["color"], alpha=0.15, lw=0)
    step = 1 if len(curve) <= 12 or sheet.scene.sampled else -(-len(curve) // 8)
    axes.plot(curve["_at"], curve["median"], markevery=(index * step // 3 % step, step), mec="white", mew=0.4, **ink)
    cross = FAILED_MARK | {"color": ink["color"]}
    failed = rows[(rows["outcome"] != "converged") & rows["_at"].notna() & ~rows["_endless"]]
    seen, edge = failed[failed["_up"].notna()], failed[failed["_up"].isna()]
    if len(seen):
        axes.plot(seen["_at"], seen["_up"], zorder=3, **cross)
    if len(edge):
        height = np.full(len(edge), 0.03 + EDGE_STEP * index)
        axes.plot(edge["_at"], height, transform=axes.get_xaxis_transform(), zorder=3, **cross)
    endless = rows[rows["_endless"] & rows["_at"].notna()]
    if len(endless):
        height, triangle = np.full(len(endless), 0.97 - EDGE_STEP * index), UNBOUNDED_MARK | {"color": ink["color"]}
        axes.plot(endless["_at"], height, transform=axes.get_xaxis_transform(), zorder=3, **triangle)


def _verticals(sheet: Sheet[LinesPlot], parts: list[pd.DataFrame], x: Shown) -> list[dict[str, Any]]:
    """Looks of the vertical line in each panel, with its place `at`; empty if the plot asks for none.

    The label has the value or, if panels differ, the lowest and the highest one.
    """
    column = sheet.plot.vertical
    if column is None or sheet.rows[column].isna().all():
        return []
    values = [float(part[column].median()) * x.factor for part in parts]
    ends = dict.fromkeys(style.with_unit(end, x.unit) for end in (np.nanmin(values), np.nanmax(values)))
    text = f"{sheet.quantity(column).title.lower()}, {' to '.join(ends)}"
    ink = {"color": style.INK, "lw": 0.8, "ls": (0, (7, 2)), "zorder": 1.5, "label": text}
    return [{**ink, "at": value} for value in values]


def _published(plot: LinesPlot) -> dict[str, dict[str, Any]]:
    """Look of published points, by their label: an open symbol for each."""
    labels = dict.fromkeys(point.label for point in plot.mark)
    common = {"color": style.INK, "ls": "", "mfc": "white", "mew": 0.9, "ms": 5.2, "zorder": 4}
    marks = itertools.cycle(style.OPEN_MARKERS)
    return {text: {**common, "marker": next(marks), "label": style.literal(text)} for text in labels}


def _fits(sheet: Sheet[LinesPlot], x: Shown, y: Shown) -> Iterator[tuple[dict[str, Any], Callable, dict[str, Any]]]:
    """For each fit that the plot shows: the factor values of its cases, its line in shown units, and its look.

    The label of the look has the law in words.
    """
    plot = sheet.plot
    fits = [fit for fit in sheet.scene.fits if fit["x"] == plot.x and fit["y"] in plot.y]
    fits = [fit for fit in fits if plot.fit and fit["slope"] is not None]
    for index, fit in enumerate(sorted(fits, key=lambda fit: plot.y.index(fit["y"]))):
        reach = dict(fit.get("where") or {}) | ({COLUMN: fit["y"]} if len(plot.y) > 1 else {})
        slope, start = fit["slope"] * y.factor / x.factor, fit["intercept"] * y.factor
        per = x.unit or _symbol(sheet.quantity(plot.x))
        text = style.law_in_words(slope, fit["largest_deviation"] * y.factor, y.unit, per)
        about = [sheet.text(column, value) for column, value in reach.items() if column not in plot.where]
        text = f"{', '.join(about)}: {text}" if about else text
        ink = {"color": style.INK, "ls": style.LINES[(index + 1) % 8], "lw": 0.9, "zorder": 1.8, "label": text}
        yield reach, lambda at, slope=slope, start=start: start + slope * at, ink


def _told_beside(axes: Axes, x: np.ndarray, y: np.ndarray, text: str) -> None:
    """Write `text` above the middle of the line between two points and along it; `x` (2,), `y` (2,) in data units."""
    above = axes.transData + ScaledTranslation(0, 5 / 72, axes.figure.dpi_scale_trans)
    along: dict[str, Any] = {"rotation": np.degrees(np.arctan2(*np.diff([y, x])[:, 0])), "transform_rotates_text": True}
    size = 0.85 * matplotlib.rcParams["font.size"]
    place: dict[str, Any] = {"ha": "center", "va": "bottom", "rotation_mode": "anchor", "transform": above}
    axes.text(x.mean(), y.mean(), text, fontsize=size, **place, **along)


def _symbol(quantity: Quantity) -> str:
    """A unit step of a dimensionless quantity in words: `unit μ`."""
    return f"unit {quantity.symbol or quantity.title.lower()}"


def _common(sheet: Sheet[LinesPlot], unit: str) -> str:
    """Label of the y axis for several columns: the words that all their titles end with, and the unit."""
    text = sheet.ending_of_stacked.capitalize() or "Value"
    return f"{text} ({unit})" if unit else text
