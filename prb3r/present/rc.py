"""The matplotlib settings of all figures, and how they give way to the user's own style."""

import contextlib
from collections.abc import Iterator
from typing import Any

import matplotlib

from prb3r.present.style import INK

RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 7.5,
    "axes.titlesize": 7.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 7.5,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "grid.color": "#e2e2e2",
    "grid.linewidth": 0.45,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.2,
    "hatch.linewidth": 0.5,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "legend.handlelength": 3.4,
    "legend.columnspacing": 1.4,
    "legend.handletextpad": 0.6,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "prb3r",
}
FONT_SIZES = tuple(name for name in RC if name.endswith(("labelsize", "titlesize", "fontsize")))
"""Settings that give way together with `font.size`: a user who changes that one wants all sizes to follow."""


@contextlib.contextmanager
def in_use() -> Iterator[None]:
    """Use the settings `RC` within a block, except those that the user has changed.

    A setting counts as changed if a `matplotlibrc` file, `matplotlib.style.use` or `matplotlib.rcParams` set it to
    another value than the default of matplotlib.
    """
    theirs = {name for name in RC if matplotlib.rcParams[name] != matplotlib.rcParamsDefault[name]}
    if "font.size" in theirs:
        theirs |= set(FONT_SIZES)
    with matplotlib.rc_context({name: value for name, value in RC.items() if name not in theirs}):
        yield
