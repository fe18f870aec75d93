"""The plot `bars`: metrics as grouped bars over a column, a panel for each metric."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from prb3r.present import canvas, style
from prb3r.present.study.sheet import FAILED_MARK, Sheet, begin_at_zero, entry, failures, ordered, values_of
from prb3r.present.style import pale
from prb3r.study.plots.kinds import BarsPlot


def bars_figure(sheet: Sheet[BarsPlot]) -> Figure:
    """Grouped bars, a panel for each metric with its own unit; whiskers span the cases that share a bar."""
    plot, rows = sheet.plot, sheet.rows
    handles = [*sheet.handles(patch=True, solid=True), *(entry(ink) for ink in failures(rows))]
    units = [sheet.shown(metric, plot.y_unit) for metric in plot.y]
    figure, axes = canvas.panels([unit.label for unit in units], handles, 0.62, shared=False)
    places = ordered(values_of(rows, plot.x))
    groups = list(sheet.groups(rows))
    width = 0.8 / max(len(groups), 1)
    for panel, metric, unit in zip(axes, plot.y, units, strict=True):
        for index, (look, line, group) in enumerate(groups):
            at = np.arange(len(places)) + (index - (len(groups) - 1) / 2) * width
            ink = {"fc": pale(look.colour, 0.7), "ec": look.colour, "hatch": look.hatch, "width": 0.92 * width}
            values = group.assign(_x=values_of(group, plot.x), _v=group[metric] * unit.factor)
            _bar(panel, at, places, values, ink | ({"ls": line} if sheet.style else {}))
        name_places(panel, sheet, places)
        if plot.x != "broken_cables":
            panel.set_xlabel(sheet.shown(plot.x, plot.x_unit).label)
    begin_at_zero(axes)
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
