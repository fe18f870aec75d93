"""Figures of a study: a table and a plot spec in, a figure out."""

import io
from pathlib import Path

import matplotlib
import pandas as pd
from matplotlib.figure import Figure

from prb3r.present import style
from prb3r.present.bars import bars
from prb3r.present.lines import lines
from prb3r.present.loops import loops
from prb3r.present.shapes import shapes
from prb3r.present.sheet import Scene, Sheet
from prb3r.present.workspace import workspace
from prb3r.study.spec import Plot
from prb3r.study.store import write_whole


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


def save(figure: Figure, folder: str | Path, name: str) -> list[Path]:
    """Write `name.png` (200 dpi) and `name.svg` whole or not at all; the same figure gives the same bytes."""
    paths = []
    for kind, metadata in (("png", {"Software": None}), ("svg", {"Date": None, "Creator": None})):
        content = io.BytesIO()
        with matplotlib.rc_context(style.RC):
            figure.savefig(content, format=kind, dpi=200, metadata=metadata)
        paths.append(write_whole(Path(folder) / f"{name}.{kind}", content.getvalue()))
    return paths
