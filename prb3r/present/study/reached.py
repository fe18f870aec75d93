"""Figure and table of the result of `prb3r.reach`."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from prb3r.model.manipulator import Manipulator
from prb3r.present import canvas, style
from prb3r.present.framing import to_scale, view_of
from prb3r.present.page import Table
from prb3r.present.study.paths import DRAWN_STATES, MISSED, REACHED
from prb3r.present.study.shapes import body, draw_body, draw_ghost, straight


def reached_figure(manipulator: Manipulator, targets: pd.DataFrame, states: pd.DataFrame) -> Figure:
    """The way of a disk past its targets, with the manipulator at some of them; missed targets are crosses.

    Parameters
    ----------
    targets : the table `Reached.table`.
    states : the table that `solve` returns for `Reached.steps`.
    """
    rest, (look,) = straight(manipulator), style.looks([""]).values()
    steps = states["step"].unique()
    some = steps[np.linspace(0, len(steps) - 1, DRAWN_STATES).round().astype(int)] if len(steps) else steps
    shown = [states[states["step"] == step] for step in dict.fromkeys(some.tolist())]
    bodies = [body(manipulator, state) for state in shown if state["x_m"].notna().all()]
    places, wanted = (1e3 * targets[[f"{mark}x_m", f"{mark}y_m"]].to_numpy(float) for mark in ("", "wanted_"))
    wanted = np.where(np.isfinite(wanted), wanted, places)
    corners = np.concatenate([part.disks.reshape(-1, 2) for part in (rest, *bodies)] + [1e-3 * wanted, 1e-3 * places])
    corners = corners[np.isfinite(corners).all(1)]
    missed = ~targets["reached"].to_numpy(bool)
    marks = [Line2D([], [], **REACHED, label="target")] * bool((~missed).any())
    marks += [Line2D([], [], **MISSED, label="not reached, and the way to it")] * bool(missed.any())
    figure, (axes,) = canvas.panels([""], marks, view_of(corners)[2])
    draw_ghost(axes, rest)
    strongest = max((tension.max() for drawn in bodies for tension in drawn.tensions), default=0.0)
    for drawn in bodies:
        draw_body(axes, drawn, look, "-", strongest)
    axes.plot(*places.T, color=look.colour, lw=1.2, zorder=3.2)
    for place, target, off in zip(places, wanted, missed, strict=True):
        axes.plot(*target, **(MISSED if off else REACHED), zorder=3.4)
        if off:
            axes.plot(*np.stack([target, place], 1), color=style.ALARM, lw=0.5, zorder=3.1)
    to_scale(axes, corners)
    axes.set(xlabel="$x$ (mm)", ylabel="$y$ (mm)")
    return figure


def reached_table(steps: pd.DataFrame, targets: pd.DataFrame) -> Table:
    """A row for each target: tension of every cable, their sum, safety factor and outcome.

    `steps` and `targets` are the tables `Reached.steps` and `Reached.table`.
    """
    names = [name for name in steps if name.startswith("cable_")]
    heads = [f"cable {name.removeprefix('cable_').removesuffix('_n')} (N)" for name in names]
    known = steps.set_index("step")
    rows = []
    for target in targets.to_dict("records"):
        pulls = known.loc[target["step"], names] if target["step"] in known.index else [np.nan] * len(names)
        cells = [style.digits(float(value)) for value in (*pulls, target["total_n"], target["safety_factor"])]
        rows.append([str(target["step"]), *cells, str(target["outcome"])])
    return Table(["target", *heads, "sum (N)", "safety factor", "outcome"], rows, (0, len(names) + 3))
