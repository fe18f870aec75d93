"""What a study may draw: each kind of plot one class, with its own fields and what it needs of the tables.

To add one, write a class in `kinds.py`, name it in `AnyPlot`, and say in `present/study/figures.py` how it is drawn.
"""

from typing import Annotated

from pydantic import Field

from prb3r.study.plots.kinds import BarsPlot, LinesPlot, LoopsPlot, PathPlot, ShapesPlot, WorkspacePlot

AnyPlot = Annotated[
    LinesPlot | BarsPlot | LoopsPlot | ShapesPlot | WorkspacePlot | PathPlot, Field(discriminator="kind")
]
