"""What the figures of a diagnosis share: its tables, the looks of the models, the axis of load steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from prb3r.diagnosis.result import tables
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.present import style

SPREAD_95 = 1.96
DISTANCE_95 = 5.99**0.5
"""Length, in standard deviations of each coordinate, that 95 % of plane errors stay within."""
MEASURED = {"color": style.INK, "marker": "o", "mfc": "white", "mew": 0.8, "ms": 3.6, "ls": ""}
LOOKS = {
    "calibrated": {"color": style.PALETTE[2], "ls": (0, (4, 1.4)), "marker": "s", "ms": 3.0, "lw": 1.1},
    "explained": {"color": style.PALETTE[0], "ls": "-", "marker": "^", "ms": 3.2, "lw": 1.1},
}
"""Lines of the two models; dash and mark tell them apart without colour."""
SAID = {"calibrated": "constants refitted alone", "explained": "with the effects named"}
NOISE = {"fc": "#e4e4e4", "ec": "none"}


@dataclass(frozen=True)
class Evidence:
    """A diagnosis and its tables, each made once."""

    diagnosis: Diagnosis

    @cached_property
    def residuals(self) -> pd.DataFrame:
        return tables.residuals(self.diagnosis)

    @cached_property
    def moments(self) -> pd.DataFrame:
        return tables.missing_moments(self.diagnosis)

    @cached_property
    def shapes(self) -> dict[str, pd.DataFrame]:
        """All disks at all steps as seen by the camera, by model."""
        return {name: tables.shapes(self.diagnosis, getattr(self.diagnosis, name)) for name in self.models}

    @property
    def models(self) -> list[str]:
        """Both models, or the calibrated one where nothing was added to it."""
        return ["calibrated", "explained"] if self.diagnosis.explained.effects else ["calibrated"]

    @property
    def positions(self) -> bool:
        return bool(self.residuals["kind"].isin(["x_m", "y_m"]).any())

    def handles(self, *more: Artist, measured: bool = False, marks: bool = True) -> list[Artist]:
        """Legend entries of what was measured and of the models."""
        entries: list[Artist] = [Line2D([], [], **MEASURED, label="measured")] if measured else []
        for name in self.models:
            look = LOOKS[name] if marks else {**LOOKS[name], "marker": ""}
            entries.append(Line2D([], [], **look, label=SAID[name]))
        return [*entries, *more]


def noise_patch(text: str = "95 % of readings by noise alone") -> Patch:
    return Patch(**NOISE, label=text)


def sheet(rows: int, columns: int, height: float, handles: Sequence[Artist], width: float = style.DOUBLE, **grid: Any):
    """A figure (`width` and `height` in mm, the legend's comes on top) and its axes (rows, columns)."""
    beside = style.legend_columns([str(handle.get_label()) for handle in handles], width) if handles else 1
    whole = height + 4 * -(-len(handles) // beside)
    figure = Figure(figsize=(width * style.MM, whole * style.MM), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.8 * style.MM, h_pad=0.8 * style.MM, wspace=0.02, hspace=0.02)
    axes = figure.subplots(rows, columns, squeeze=False, **grid)
    if handles:
        figure.legend(handles=list(handles), loc="outside lower center", ncols=beside, labelspacing=0.35)
    return figure, axes


@dataclass(frozen=True)
class StepAxis:
    """Load steps side by side, sequence after sequence with a gap between."""

    place: dict[tuple[str, int], float]

    @classmethod
    def of(cls, rows: pd.DataFrame) -> "StepAxis":
        """Of the steps of a table, in its order."""
        place, at, last = {}, 0.0, None
        for name, step in dict.fromkeys(zip(rows["sequence"], rows["step"], strict=True)):
            at += 0.0 if last is None else 1.0 if name == last else 1.8
            place[name, step], last = at, name
        return cls(place)

    def at(self, rows: pd.DataFrame) -> np.ndarray:
        return np.array([self.place[key] for key in zip(rows["sequence"], rows["step"], strict=True)])

    @property
    def sequences(self) -> dict[str, tuple[float, float]]:
        """First and last place of each sequence."""
        names = dict.fromkeys(name for name, _ in self.place)
        own = {name: [at for (other, _), at in self.place.items() if other == name] for name in names}
        return {name: (min(places), max(places)) for name, places in own.items()}

    def name_sequences(self, axes: Axes, width: float) -> None:
        """Sequence names as ticks below `axes`, that are `width` mm wide; tilted where they are long."""
        ends = self.sequences
        longest = max(map(len, ends), default=0)
        tilted = {"rotation": 35, "ha": "right", "rotation_mode": "anchor"} if 1.5 * longest * len(ends) > width else {}
        middles = [(a + b) / 2 for a, b in ends.values()]
        axes.set_xticks(middles, [_short(name) for name in ends], **tilted)
        axes.tick_params(axis="x", length=0)
        axes.grid(False, axis="x")
        axes.set_xlim(-0.9, max(self.place.values(), default=0) + 0.9)
        axes.set_xlabel("load steps in order, by sequence")


def _short(name: str, most: int = 16) -> str:
    return name if len(name) <= most else f"{name[: most - 1]}…"
