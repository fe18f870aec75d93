"""Parts that the figures of a diagnosis share: looks of the models, a grid of panels, an axis of load steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from prb3r.present import canvas, style
from prb3r.present.legends import legend_columns

MEASURED: dict[str, Any] = {"color": style.INK, "marker": "o", "mfc": "white", "mew": 0.8, "ms": 3.6, "ls": ""}
"""Marks of readings."""
LOOKS: dict[str, dict[str, Any]] = {
    "calibrated": {"color": style.PALETTE[2], "ls": (0, (4, 1.4)), "marker": "s", "ms": 3.0, "lw": 1.1},
    "explained": {"color": style.PALETTE[0], "ls": "-", "marker": "^", "ms": 3.2, "lw": 1.1},
}
"""Lines of the two models, which differ in dashes and marks as well as in colour."""
SAID = {"calibrated": "constants refitted alone", "explained": "with the effects named"}
"""Words of the models in legends."""
NOISE: dict[str, Any] = {"fc": "#e4e4e4", "ec": "none"}
"""Look of bands of noise."""
POSITIONS = ("x_m", "y_m")
BETWEEN_SEQUENCES = 1.8
"""Distance from the last step of a sequence to the first of the next one, where steps of a sequence stand 1 apart."""


def legend_entries(models: Sequence[str], *more: Artist, measured: bool = False) -> list[Artist]:
    """Legend entries of the readings, if they are drawn (`measured`), of the models, and `more`."""
    entries: list[Artist] = [Line2D([], [], **MEASURED, label="measured")] if measured else []
    entries += [Line2D([], [], **LOOKS[name], label=SAID[name]) for name in models]
    return [*entries, *more]


def has_positions(readings: pd.DataFrame) -> bool:
    """Whether positions are among the readings of a table."""
    return bool(readings["kind"].isin(POSITIONS).any())


def noise_patch() -> Patch:
    """Legend entry of the band that noise alone stays in."""
    return Patch(**NOISE, label="95 % of readings by noise alone")


def panel_grid(
    rows: int, columns: int, height: float, handles: Sequence[Artist], width: float = style.DOUBLE, **grid: Any
):
    """A figure with a legend of `handles` below, and the array (rows, columns) of its axes.

    Parameters
    ----------
    height, width : of the figure without its legend, mm.
    grid : options of `Figure.subplots`, and `count`: the number of panels that are drawn on, the first ones.
    """
    beside = legend_columns([str(handle.get_label()) for handle in handles], width) if handles else 1
    whole = height + 4 * -(-len(handles) // beside)
    count = grid.pop("count", rows * columns)
    figure, axes = canvas.axes_grid((width, whole), (rows, columns), count, **grid)
    canvas.close_up(figure)
    if handles:
        canvas.legend(figure, axes.ravel()[count - 1], beside, handles, labelspacing=0.35)
    return figure, axes


def breaks_between(places: np.ndarray | pd.Index) -> np.ndarray:
    """Indices in ascending `places` of steps at which a new sequence begins, so that lines are broken there.

    A gap counts as one between sequences from half-way between its width and the distance of two steps on.
    """
    return np.flatnonzero(np.diff(places) > (1 + BETWEEN_SEQUENCES) / 2) + 1


@dataclass(frozen=True)
class StepAxis:
    """An axis of load steps side by side, sequence after sequence with gaps between."""

    place: dict[tuple[str, int], float]
    """Place along the axis of each step (sequence, step)."""

    @classmethod
    def of(cls, rows: pd.DataFrame) -> "StepAxis":
        """The axis of the steps that a table has, in its order."""
        place, at, last = {}, 0.0, None
        for name, step in dict.fromkeys(zip(rows["sequence"], rows["step"], strict=True)):
            at += 0.0 if last is None else 1.0 if name == last else BETWEEN_SEQUENCES
            place[name, step], last = at, name
        return cls(place)

    def at(self, rows: pd.DataFrame) -> np.ndarray:
        """(rows,) places along the axis of the steps of a table's rows, by its columns `sequence` and `step`."""
        return np.array([self.place[key] for key in zip(rows["sequence"], rows["step"], strict=True)])

    @property
    def sequences(self) -> dict[str, tuple[float, float]]:
        """Places of the first and the last step of every sequence, by its name, in order."""
        names = dict.fromkeys(name for name, _ in self.place)
        places = {name: [at for (other, _), at in self.place.items() if other == name] for name in names}
        return {name: (min(inside), max(inside)) for name, inside in places.items()}

    def name_sequences(self, axes: Axes, width: float) -> None:
        """Label the x axis of `axes`, `width` mm wide, with the names of the sequences, tilted if they are long."""
        ends = self.sequences
        longest = max(map(len, ends), default=0)
        tilt: dict[str, Any] = {"rotation": 35, "ha": "right", "rotation_mode": "anchor"}
        tilted = tilt if 1.5 * longest * len(ends) > width else {}
        middles = [(a + b) / 2 for a, b in ends.values()]
        axes.set_xticks(middles, [_short(name) for name in ends], **tilted)
        axes.tick_params(axis="x", length=0)
        axes.grid(False, axis="x")
        axes.set_xlim(-0.9, max(self.place.values(), default=0) + 0.9)
        axes.set_xlabel("load steps in order, by sequence")


def _short(name: str, most: int = 16) -> str:
    return name if len(name) <= most else f"{name[: most - 1]}…"
