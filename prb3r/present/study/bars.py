"""The plot `bars`: metrics as grouped bars over a column, a panel for each metric."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from prb3r.present import canvas, style
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
from prb3r.present.style import pale
from prb3r.study.compare import select
from prb3r.study.plots.kinds import BarsPlot


def bars_figure(sheet: Sheet[BarsPlot]) -> Figure:
    """Grouped bars, a panel for each metric with its own unit; whiskers span the cases that share a bar."""
    plot, rows = sheet.plot, sheet.rows
    marks = [*failures(rows), *unbounded(rows, plot.y)]
    handles = [*sheet.handles(patch=True, solid=True), *map(entry, marks)]
    shared = (_spread(_others(sheet, group, metric), metric) for metric in plot.y for _, _, group in sheet.groups(rows))
    if any((ends["max"] > ends["min"]).any() for ends in shared):
        told = "from least to greatest; bar: median"
        handles.append(Line2D([], [], color=style.INK, ls="", marker="|", ms=7.0, mew=0.7, label=told))
    units = [sheet.shown(metric, plot.y_unit) for metric in plot.y]
    figure, axes = canvas.panels([unit.label for unit in units], handles, 0.62, shared=False)
    places = ordered(values_of(rows, plot.x))
    groups = list(sheet.groups(rows))
    width = 0.8 / max(len(groups), 1)
    for panel, metric, unit in zip(axes, plot.y, units, strict=True):
        for index, (look, line, group) in enumerate(groups):
            at = np.arange(len(places)) + (index - (len(groups) - 1) / 2) * width
            ink = {"fc": pale(look.colour, 0.7), "ec": look.colour, "hatch": look.hatch, "width": 0.92 * width}
            values = _others(sheet, group, metric)
            values = values.assign(**{metric: values[metric] * unit.factor})
            _bar(panel, at, places, values, metric, ink | ({"ls": line} if sheet.style else {}))
        name_places(panel, sheet, places)
        if plot.x != "broken_cables":
            panel.set_xlabel(sheet.shown(plot.x, plot.x_unit).label)
    begin_at_zero(axes)
    return figure


def _others(sheet: Sheet[BarsPlot], group: pd.DataFrame, metric: str) -> pd.DataFrame:
    """The cases of a group with their place `_x`, without those that others are compared with where they share a bar
    with others: a difference from themselves says nothing."""
    group = group.assign(_x=values_of(group, sheet.plot.x))
    if metric not in sheet.scene.compared:
        return group
    base = group.index.isin(select(group, sheet.scene.compared[metric]).index)
    return group[~base | ~group["_x"].isin(group["_x"][~base])]


def _spread(group: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Least, median and greatest value of the cases of a group that share a bar."""
    return group.groupby("_x")[metric].agg(["min", "median", "max"])


def _bar(
    axes: Axes, at: np.ndarray, places: list[Any], group: pd.DataFrame, metric: str, ink: Mapping[str, Any]
) -> None:
    """The bars of one group: medians, with whiskers where cases share a bar, crosses where cases failed, and triangles
    where a value is without bound."""
    endless = at[np.isin(places, group["_x"][np.isinf(group[metric].astype(float))])]
    if len(endless):
        axes.plot(endless, np.full(len(endless), 0.97), transform=axes.get_xaxis_transform(), **UNBOUNDED_MARK)
    finite = group.assign(**{metric: group[metric].where(np.isfinite(group[metric].astype(float)))})
    low, middle, high = _spread(finite, metric).reindex(places).to_numpy(float).T
    axes.bar(at, middle, lw=0.7, **ink)
    if (high > low).any():
        whiskers = [middle - low, high - middle]
        axes.errorbar(at, middle, whiskers, fmt="none", ecolor=style.INK, elinewidth=0.7, capsize=1.5)
    failed = at[np.isin(places, group["_x"][group["outcome"] != "converged"])]
    if len(failed):
        axes.plot(failed, np.full(len(failed), 0.03), transform=axes.get_xaxis_transform(), **FAILED_MARK)


def name_places(axes: Axes, sheet: Sheet[Any], places: list[Any]) -> None:
    """Write the values `places` of the x column of a plot below 0, 1, 2, ... on the x axis."""
    axes.set_xticks(range(len(places)), [_tick(sheet, place) for place in places])
    axes.grid(False, axis="x")


def _tick(sheet: Sheet[Any], value: Any) -> str:
    """Label below one value of the x column."""
    column = sheet.plot.x
    if column == "broken_cables":
        return "\n".join(sheet.text(column, value).rsplit(" ", 1))
    return (
        style.literal(str(value))
        if isinstance(value, (str, bool))
        else style.digits(value * sheet.shown(column, sheet.plot.x_unit).factor)
    )
