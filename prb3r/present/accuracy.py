"""The figure of the benchmark: tip error of each method over the time that it takes for an equilibrium."""

from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from prb3r.present import rc, style
from prb3r.present.figure_files import save_figure

NAME = "error-against-time"
WIDTH, HEIGHT = 130 * style.MM, 75 * style.MM
LEAST_PERCENT = 1e-9
"""Smaller errors are drawn at this one, as the reference itself is not exact to more digits."""


def accuracy_figure(methods: pd.DataFrame) -> Figure:
    """Largest tip error over the time of an equilibrium, a mark for each method; down and to the left is better.

    Parameters
    ----------
    methods : with `method, time_each_s, tip_error_percent`, as the bench measures them.
    """
    with rc.in_use():
        figure = Figure((WIDTH, HEIGHT), layout="constrained")
        axes = figure.subplots()
        for row, look in zip(methods.itertuples(), style.looks(list(methods["method"])).values(), strict=True):
            place = 1e6 * row.time_each_s, max(row.tip_error_percent, LEAST_PERCENT)
            axes.plot(*place, look.marker, color=look.colour, ms=6, mec="white", mew=0.6)
            slow = row.time_each_s**2 > methods["time_each_s"].min() * methods["time_each_s"].max()
            axes.annotate(
                style.literal(row.method),
                place,
                xytext=(-6 if slow else 6, 5),
                textcoords="offset points",
                ha="right" if slow else "left",
                color=style.INK,
            )
        axes.set(xscale="log", yscale="log", xlabel="time of an equilibrium (µs)")
        axes.set_ylabel("largest tip error (% of the length)")
        axes.margins(x=0.08, y=0.12)
    return figure


def publish_accuracy(methods: pd.DataFrame, folder: Path) -> list[Path]:
    """Write the figure as PNG and SVG into a folder and return both paths."""
    return save_figure(accuracy_figure(methods), folder, NAME)
