"""`prb3r.plot`: a manipulator drawn to scale, straight or as loads bend it."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from prb3r.errors import Problem, SpecError
from prb3r.model.given import Given, manipulator_of
from prb3r.model.solve import solve
from prb3r.present import canvas, rc, style
from prb3r.present.framing import to_scale, view_of
from prb3r.present.study.shapes import GHOST, body, draw_body, draw_ghost, straight


def plot(manipulator: Given, table: pd.DataFrame | str | Path | None = None, *, axes: Axes | None = None) -> Figure:
    """The manipulator to scale in the last equilibrium of every load sequence, and pale as it is straight.

    Parameters
    ----------
    table : steps, as a table or the file that holds it, which are solved, or the table that `solve` returns; without
        it the manipulator is drawn straight.
    axes : to draw on, in mm; without them on a new figure.

    Raises
    ------
    SpecError
        With everything that is wrong with the table, or if no sequence ends in an equilibrium.

    Examples
    --------
    >>> import prb3r
    >>> figure = prb3r.plot("studies/manipulators/two-segment.toml")
    >>> figure.axes[0].get_xlabel()
    '$x$ (mm)'
    """
    manipulator = manipulator_of(manipulator)
    rest, drawn = straight(manipulator), {}
    if table is not None:
        if isinstance(table, pd.DataFrame) and {"disk", "x_m", "y_m", "angle_rad"} <= set(table):
            states = table
        else:
            states = solve(manipulator, table)
        drawn = {
            str(name): body(manipulator, rows[rows["step"] == rows["step"].max()])
            for name, rows in states.dropna(subset=["x_m"]).groupby("sequence", sort=False)
        }
        if not drawn:
            raise SpecError(Problem("table", "no sequence ends in an equilibrium that could be drawn"))
    bodies = drawn or {"straight": rest}
    looks = style.looks(list(bodies))
    corners = np.concatenate([part.disks.reshape(-1, 2) for part in (rest, *bodies.values())])
    strongest = max((tension.max() for part in bodies.values() for tension in part.tensions), default=0.0)
    with rc.in_use():
        marks = [Line2D([], [], color=look.colour, marker=look.marker, label=name) for name, look in looks.items()]
        named = [Line2D([], [], color=GHOST.colour, label="straight"), *marks] if drawn else []
        if axes is None:
            (axes,) = canvas.panels([""], named, view_of(corners)[2])[1]
        elif named:
            axes.legend(handles=named)
        if drawn:
            draw_ghost(axes, rest)
        for name, part in bodies.items():
            draw_body(axes, part, looks[name], "-", strongest)
        to_scale(axes, corners)
        axes.set(xlabel="$x$ (mm)", ylabel="$y$ (mm)")
    figure = axes.figure
    assert isinstance(figure, Figure)
    return figure
