"""What the figures of a diagnosis share: the looks of the models, a grid of panels, the axis of load steps."""

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
LOOKS: dict[str, dict[str, Any]] = {
    "calibrated": {"color": style.PALETTE[2], "ls": (0, (4, 1.4)), "marker": "s", "ms": 3.0, "lw": 1.1},
    "explained": {"color": style.PALETTE[0], "ls": "-", "marker": "^", "ms": 3.2, "lw": 1.1},
}
"""Lines of the two models; dash and mark tell them apart without colour."""
SAID = {"calibrated": "constants refitted alone", "explained": "with the effects named"}
NOISE: dict[str, Any] = {"fc": "#e4e4e4", "ec": "none"}
POSITIONS = ("x_m", "y_m")
BETWEEN_SEQUENCES = 1.8
"""From the last step of a sequence to the first of the next one; steps of a sequence stand 1 apart."""


def legend_entries(models: Sequence[str], *more: Artist, measured: bool = False) -> list[Artist]:
    """Legend entries of what was measured, if it was drawn, of the models, and of what else there is."""
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
    """A figure (`width` and `height` in mm, the legend's comes on top) and its axes (rows, columns).

    `grid` may say the `count` of panels that are drawn on, the first ones, and holds what `Figure.subplots` takes.
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
    """Where lines over places of steps, ascending, begin anew: at every sequence, whatever the sums are rounded to."""
    return np.flatnonzero(np.diff(places) > (1 + BETWEEN_SEQUENCES) / 2) + 1


@dataclass(frozen=True)
class StepAxis:
    """Load steps side by side, sequence after sequence with a gap between."""

    place: dict[tuple[str, int], float]

    @classmethod
    def of(cls, rows: pd.DataFrame) -> "StepAxis":
        """Of the steps of a table, in its order."""
        place, at, last = {}, 0.0, None
        for name, step in dict.fromkeys(zip(rows["sequence"], rows["step"], strict=True)):
            at += 0.0 if last is None else 1.0 if name == last else BETWEEN_SEQUENCES
            place[name, step], last = at, name
        return cls(place)

    def at(self, rows: pd.DataFrame) -> np.ndarray:
        """(rows,) place along the axis of the step that each row of a table names by `sequence` and `step`."""
        return np.array([self.place[key] for key in zip(rows["sequence"], rows["step"], strict=True)])

    @property
    def sequences(self) -> dict[str, tuple[float, float]]:
        """Of every sequence, by name and in order, the places of its first and last step along the axis."""
        names = dict.fromkeys(name for name, _ in self.place)
        places = {name: [at for (other, _), at in self.place.items() if other == name] for name in names}
        return {name: (min(inside), max(inside)) for name, inside in places.items()}

    def name_sequences(self, axes: Axes, width: float) -> None:
        """Sequence names as ticks below `axes`, that are `width` mm wide; tilted where they are long."""
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
