"""Figures of a study: a table and a plot spec in, a figure out."""

import matplotlib
import pandas as pd
from matplotlib.figure import Figure

from prb3r.present import style
from prb3r.present.study.bars import bars
from prb3r.present.study.lines import lines
from prb3r.present.study.loops import loops
from prb3r.present.study.shapes import shapes
from prb3r.present.study.sheet import Scene, Sheet
from prb3r.present.study.workspace import workspace
from prb3r.study.spec import Plot


def draw(plot: Plot, cases: pd.DataFrame, states: pd.DataFrame | None, scene: Scene) -> Figure:
    """The figure that `plot` asks for; cases without equilibrium are marked or named in it.

    Raises
    ------
    ValueError
        If no case is selected, the tables lack a column or states that the plot needs, or a unit does not fit.
    """
    kinds = {"lines": lines, "shapes": shapes, "workspace": workspace, "bars": bars, "loops": loops}
    with matplotlib.rc_context(style.RC):
        return kinds[plot.kind](Sheet(plot, cases, states, scene))
