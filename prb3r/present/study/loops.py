"""The plot `loops`: positions of disks over a cable tension that rises, falls and rises again."""

import itertools

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from prb3r.present import canvas, style
from prb3r.present.spots import point_at
from prb3r.present.study.sheet import Sheet, begin_at_zero, entry, failures
from prb3r.study.metrics.response import last_loop
from prb3r.study.plots.kinds import LoopsPlot, disk_of

ARROW = {"arrowstyle": "->", "color": style.INK, "lw": 1.0, "mutation_scale": 10, "shrinkA": 0, "shrinkB": 0}


def loops_figure(sheet: Sheet[LoopsPlot]) -> Figure:
    """Positions of disks over a tension along the path of each case: a row of panels for each position.

    The last fall and rise are drawn in full, what came before is thin and dotted; falls of a panel's first group have
    an arrow.
    """
    plot, (titles, parts) = sheet.plot, sheet.panels()
    rows = [(column, part) for column in plot.y for part in parts]
    panels = [
        ", ".join(filter(None, (sheet.quantity(column).title if number % len(parts) == 0 else "", title)))
        for number, ((column, _), title) in enumerate(zip(rows, itertools.cycle(titles), strict=False))
    ]
    handles = [*sheet.handles(solid=True), *map(entry, failures(sheet.rows))]
    figure, axes = canvas.panels(panels, handles, 0.85, "row", len(parts))
    tension = sheet.shown(str(plot.x), plot.x_unit)
    for number, (panel, (column, part)) in enumerate(zip(axes, rows, strict=True)):
        position = sheet.shown(column, plot.y_unit)
        for index, (look, _, group) in enumerate(sheet.groups(part)):
            for case in group["case_id"]:
                pull, way, steps = _path(sheet, case, column)
                point_at(panel, np.stack([pull * tension.factor, way * position.factor], 1), case, steps)
                ink = {"color": look.colour, "lw": 1.0, "marker": look.marker, "mec": "white", "mew": 0.4}
                _loop(panel, pull * tension.factor, way * position.factor, ink, directed=index == 0)
        if number % len(parts) == 0:
            panel.set_ylabel(position.label)
        if number >= len(axes) - len(parts):
            panel.set_xlabel(tension.label)
    if plot.y_from_zero:
        begin_at_zero(axes)
    return figure


def _path(sheet: Sheet[LoopsPlot], case: int, column: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(s,) each: tension at the base (N), the position `column` of a disk, and the number of every step of a case."""
    states = sheet.states if sheet.states is not None else pd.DataFrame()
    states = states[states["case_id"] == case].sort_values("step", kind="stable")
    last = int(sheet.scene.manipulator(case).plates)
    at = {disk: states[states["disk"] == disk] for disk in (0, disk_of(column, last))}
    pull, moved = at.values()
    return pull[sheet.plot.x].to_numpy(float), moved[column.partition("_")[2]].to_numpy(float), moved["step"].to_numpy()


def _loop(axes: Axes, pull: np.ndarray, way: np.ndarray, ink: dict, directed: bool) -> None:
    """Draw a position `way` over a tension `pull`, both (s,) in shown units; `directed`: with an arrow."""
    top, bottom, end = last_loop(pull)
    axes.plot(pull[: top + 1], way[: top + 1], color=ink["color"], lw=0.6, ls=":")
    middle = (top + bottom) // 2
    axes.plot(pull[top : end + 1], way[top : end + 1], markevery=[(bottom - top) // 3], **ink)
    if directed and bottom > top and np.isfinite(way[middle : middle + 2]).all():
        (x, y), ahead = zip(pull[middle : middle + 2], way[middle : middle + 2], strict=True)
        axes.annotate("", ahead, (x, y), arrowprops=ARROW)
