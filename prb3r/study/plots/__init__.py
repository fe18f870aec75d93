"""Spec of the plots of a study: one class for each kind, with its fields and the tables that it needs.

To add one, write a class in `kinds.py`, name it in `AnyPlot`, and say in `present/study/figures.py` how it is drawn.
"""

from typing import Annotated

from pydantic import Field

from prb3r.study.plots.kinds import BarsPlot, LinesPlot, LoopsPlot, PathPlot, ShapesPlot, WorkspacePlot

AnyPlot = Annotated[
    LinesPlot | BarsPlot | LoopsPlot | ShapesPlot | WorkspacePlot | PathPlot, Field(discriminator="kind")
]
