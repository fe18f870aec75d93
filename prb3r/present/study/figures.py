"""The figure of a plot of a study, drawn by the function for its kind from the tables of cases and states."""

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from prb3r.present import rc
from prb3r.present.study.bars import bars_figure
from prb3r.present.study.lines import lines_figure
from prb3r.present.study.loops import loops_figure
from prb3r.present.study.paths import paths_figure
from prb3r.present.study.shapes import shapes_figure
from prb3r.present.study.sheet import Scene, Sheet
from prb3r.present.study.workspace import workspace_figure
from prb3r.study.plots.base import Plot
from prb3r.study.plots.kinds import BarsPlot, LinesPlot, LoopsPlot, PathPlot, ShapesPlot, WorkspacePlot

DRAWN_BY: Mapping[type[Plot], Callable[[Sheet[Any]], Figure]] = {
    LinesPlot: lines_figure,
    BarsPlot: bars_figure,
    LoopsPlot: loops_figure,
    ShapesPlot: shapes_figure,
    WorkspacePlot: workspace_figure,
    PathPlot: paths_figure,
}
"""The function that draws each kind of plot."""


def study_figure(plot: Plot, cases: pd.DataFrame, states: pd.DataFrame | None, scene: Scene) -> Figure:
    """The figure that `plot` asks for; cases without equilibrium are marked or named in it.

    Raises
    ------
    ValueError
        If no case is selected, the tables lack a column or states that the plot needs, a unit does not fit, or the axes
        given by `drawn_on` are not as many as its panels.
    """
    with rc.in_use():
        return DRAWN_BY[type(plot)](Sheet(plot, cases, states, scene))
