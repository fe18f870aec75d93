"""The plot `shapes`, and how manipulators are drawn to scale: plates, disks and cables."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from prb3r.model.manipulator import Manipulator
from prb3r.present import canvas, style
from prb3r.present.framing import to_scale, view_of
from prb3r.present.legends import MOST_WORDS
from prb3r.present.spots import LAST, point_at
from prb3r.present.study.sheet import FAILED_MARK, Sheet, entry, values_of
from prb3r.present.style import Look, pale
from prb3r.study.compare import select
from prb3r.study.plots.kinds import ShapesPlot

MOST_SHAPES = 48
"""Manipulators that a figure draws at most, so that they can be told apart and it stays below 2 MB; of more, evenly
spaced ones."""
HIDDEN, SLIMMER = 0.01, 0.45
"""If two manipulators are nowhere farther apart than the share `HIDDEN` of the length, the second is drawn slimmer by
the factor `SLIMMER`, so that the first is seen on both sides of it."""
GHOST = Look(style.PALE, "", "-", "")
"""Look of manipulators that others are compared with."""


@dataclass(frozen=True)
class Body:
    """A manipulator in one state as curves to draw, m."""

    disks: np.ndarray
    """(n + 1, 4, 2) corners of the disks."""
    plates: np.ndarray
    """(n, points, 2) each plate: clamps as straight ends, the arc between as a cubic with the tangents of its disks."""
    cables: tuple[np.ndarray, ...]
    """Each (2k + 2, 2), of a cable that crosses k plates: the proximal face of the base disk, where it leaves one disk
    and enters the next at each plate, and the distal face of its last disk."""
    tensions: tuple[np.ndarray, ...]
    """Each (2k + 1,) tension of a cable between these points, N."""


def body(manipulator: Manipulator, state: pd.DataFrame) -> Body:
    """Curves of one state: rows of disks 0..n with `x_m, y_m, angle_rad` and tensions `cable_<name>_n`.

    Raises
    ------
    ValueError
        If disks are missing.
    """
    state = state.sort_values("disk")
    if len(state) != manipulator.plates + 1:
        raise ValueError(f"drawing {manipulator.name!r} takes the states of all its disks, 0 to {manipulator.plates}")
    centre, angle = state[["x_m", "y_m"]].to_numpy(float), state["angle_rad"].to_numpy(float)
    along = np.stack([np.cos(angle), np.sin(angle)], -1)
    across = np.stack([-along[:, 1], along[:, 0]], -1)
    half = manipulator.disk.thickness_m / 2
    near, far = centre - half * along, centre + half * along
    offsets = np.array([[cable.offset(k) for k in range(len(manipulator.segment))] for cable in manipulator.cable])
    height = 1.1 * np.abs(offsets).max() if offsets.size else 0.5 * manipulator.segment[0].length_m
    disks = np.stack([near - height * across, far - height * across, far + height * across, near + height * across], 1)
    clamp = manipulator.per_plate(segment.clamp_m for segment in manipulator.segment)[:, None]
    arc = manipulator.per_plate(segment.length_m for segment in manipulator.segment)[:, None] - 2 * clamp
    start, end = far[:-1] + clamp * along[:-1], near[1:] - clamp * along[1:]
    s = np.linspace(0, 1, 9)[:, None, None]
    curve = (1 + 2 * s) * (1 - s) ** 2 * start + s**2 * (3 - 2 * s) * end
    curve = curve + arc * (s * (1 - s) ** 2 * along[:-1] - s**2 * (1 - s) * along[1:])
    plates = np.moveaxis(np.concatenate([far[None, :-1], curve, near[None, 1:]]), 0, 1)
    cables, tensions = [], []
    for cable in manipulator.cable:
        reach = manipulator.segment_ends[cable.ends_at_segment - 1]
        offset = manipulator.per_plate(cable.offset(k) for k in range(len(manipulator.segment)))[:reach, None]
        leaves, enters = far[:reach] + offset * across[:reach], near[1 : reach + 1] + offset * across[1 : reach + 1]
        behind, last = near[0] + offset[0] * across[0], far[reach] + offset[-1] * across[reach]
        holes = np.stack([leaves, enters], 1).reshape(-1, 2)
        cables.append(np.concatenate([behind[None], holes, last[None]]))
        name = f"cable_{cable.name}_n"
        tension = np.nan_to_num(state[name].to_numpy(float)) if name in state else np.zeros(reach + 1)
        tensions.append(np.repeat(tension[: reach + 1], 2)[1:])
    return Body(disks, plates, tuple(cables), tuple(tensions))


def shapes_figure(sheet: Sheet[ShapesPlot]) -> Figure:
    """Manipulators to scale: plates, disks, cables (as thick as they are tensioned), a mark at each tip."""
    some = sheet.rows
    if len(some) > MOST_SHAPES:
        some = some.iloc[np.linspace(0, len(some) - 1, MOST_SHAPES).round().astype(int)]
    drawn = _bodies(sheet, some)
    reference = _reference(sheet)
    behind = _bodies(sheet, reference)
    corners = np.concatenate(
        [[[-0.016, 0.0]], *(body_drawn.disks.reshape(-1, 2) for body_drawn in (*drawn.values(), *behind.values()))]
    )
    strongest = max((tension.max() for body_drawn in drawn.values() for tension in body_drawn.tensions), default=0.0)
    missing = some[~some.index.isin(list(drawn))]
    failed = [f"{len(some)} of {len(sheet.rows)} drawn"] if len(some) < len(sheet.rows) else []
    failed += [not_drawn(sheet, row, str(row["outcome"])) for _, row in missing.iterrows()]
    sheet, alike = _told_apart(sheet)
    titles, parts = sheet.panels()
    handles = sheet.handles(solid=True) + notes(failed) + notes(alike, mark={"ls": ""})
    if behind:
        text = ", ".join(sheet.text(column, value) for column, value in sheet.plot.reference.items())
        handles.append(Line2D([], [], color=GHOST.colour, lw=1.5, label=text))
    figure, axes = canvas.panels(titles, handles, view_of(corners)[2])
    for panel, part in zip(axes, parts, strict=True):
        below: list[Body] = []
        for index in _of_panel(sheet, reference, part).intersection(list(behind)):
            draw_ghost(panel, behind[index])
        for look, line, group in sheet.groups(part):
            for index in group.index.intersection(list(drawn)):
                covered = sum(_coincide(drawn[index], other) for other in below)
                draw_body(panel, drawn[index], look, line if sheet.style else "-", strongest, SLIMMER**covered)
                below.append(drawn[index])
        seen = part.loc[part.index.intersection(list(drawn))]
        tips = np.array([1e3 * drawn[index].disks[-1].mean(0) for index in seen.index])
        point_at(panel, tips, seen["case_id"], seen.get("step", LAST), to_scale=True)
        _ground(panel, drawn)
        to_scale(panel, corners)
    canvas.outer_labels(axes, "$x$ (mm)", "$y$ (mm)")
    return figure


def _coincide(first: Body, other: Body) -> bool:
    """Whether two manipulators coincide, so that the one drawn later would hide the other."""
    if first.plates.shape != other.plates.shape:
        return False
    length = np.linalg.norm(np.diff(first.plates.reshape(-1, 2), axis=0), axis=1).sum()
    return bool(np.abs(first.plates - other.plates).max() < HIDDEN * length)


def _told_apart(sheet: Sheet[ShapesPlot]) -> tuple[Sheet[ShapesPlot], list[str]]:
    """The sheet with colour and line style, where the plot leaves them free, given to factors that tell cases apart.

    Such factors differ between cases that would look alike otherwise.  For each one that has too many values, or for
    which neither colour nor style is left, there is a note.
    """
    plot, rows = sheet.plot, sheet.rows
    free = [key for key in ("by", "style") if getattr(plot, key) is None]
    alike = []
    for factor in [name for name in sheet.scene.factors if name in rows]:
        if (rows.groupby(["_panel", "_by", "_style"])[factor].nunique() < 2).all():
            continue
        if free and rows[factor].nunique() <= MOST_WORDS:
            sheet = replace(sheet, plot=sheet.plot.model_copy(update={free.pop(0): factor}))
            rows = sheet.rows
        else:
            alike.append(f"alike whatever the {sheet.quantity(factor).title.lower()}")
    return sheet, alike


def _reference(sheet: Sheet[ShapesPlot]) -> pd.DataFrame:
    """Rows of the cases that the plot draws pale, behind all others."""
    return select(sheet.cases, sheet.plot.reference) if sheet.plot.reference else sheet.cases[:0]


def _of_panel(sheet: Sheet[ShapesPlot], reference: pd.DataFrame, part: pd.DataFrame) -> pd.Index:
    """Index of the rows of the `reference` that belong into the panel of the rows `part`: all if the plot names the
    column of the panels among what makes them the reference, else those with its value."""
    if sheet.panel not in reference or sheet.panel in (sheet.plot.reference or {}):
        return reference.index
    return reference.index[values_of(reference, sheet.panel).isin(part["_panel"])]


def _bodies(sheet: Sheet[ShapesPlot], rows: pd.DataFrame) -> dict[int, Body]:
    """Curves of the manipulator for each of `rows`, by its index, where the state is an equilibrium.

    The state is that of the row's step or, without a column `step`, the last one of its case.
    """
    if sheet.states is None:
        raise ValueError(f"plot {sheet.plot.name!r} draws shapes and needs states")
    by_case = dict(iter(sheet.states.groupby("case_id")))
    drawn: dict[int, Body] = {}
    for index, row in rows.iterrows():
        state = by_case.get(row["case_id"], sheet.states[:0])
        state = state[state["step"] == (row["step"] if "step" in rows else state["step"].max())]
        if len(state) and np.isfinite(state[["x_m", "y_m", "angle_rad"]].to_numpy(float)).all():
            drawn[index] = body(sheet.scene.manipulator(int(row["case_id"])), state)
    return drawn


def not_drawn(sheet: Sheet[Any], row: pd.Series, what: str) -> str:
    """A sentence that names a case by what tells it from the others, and says why it is not drawn."""
    keys = {sheet.panel: "_panel", sheet.by: "_by", sheet.style: "_style"}
    names = [sheet.text(column, row[key]) for column, key in keys.items() if column]
    return f"{', '.join(names)}: {what}" if names else what


def notes(texts: list[str], most: int = 6, mark: Mapping[str, Any] = FAILED_MARK) -> list[Line2D]:
    """Legend entries for what is not drawn: the first `most` texts behind a `mark`, and how many more there are."""
    more = [f"and {len(texts) - most} more"] if len(texts) > most else []
    return [entry({**mark, "label": text}) for text in texts[:most] + more]


def _ground(axes: Axes, drawn: Mapping[int, Body]) -> None:
    """Draw the hatched wall, 9 mm thick, behind the base disk that all manipulators drawn have in common."""
    if drawn:
        base = 1e3 * next(iter(drawn.values())).disks[0]
        back, low, high = base[:, 0].min(), base[:, 1].min(), base[:, 1].max()
        wall = [(back, low), (back - 9, low), (back - 9, high), (back, high)]
        axes.add_patch(Polygon(wall, facecolor="none", edgecolor=style.QUIET, hatch="/////", lw=0))


def straight(manipulator: Manipulator) -> Body:
    """Curves of the straight manipulator at rest, its cables without tension, m."""
    pitch = manipulator.per_plate(segment.length_m for segment in manipulator.segment) + manipulator.disk.thickness_m
    x = np.concatenate([[0.0], np.cumsum(pitch)]) - manipulator.disk.thickness_m / 2
    return body(manipulator, pd.DataFrame({"disk": range(len(x)), "x_m": x, "y_m": 0.0, "angle_rad": 0.0}))


def draw_body(axes: Axes, drawn: Body, look: Look, line: Any, strongest: float, slim: float = 1.0) -> None:
    """Draw one manipulator: slack cables grey, others in its colour, the thicker the more tension they have.

    Parameters
    ----------
    line : line style; other than solid it is drawn as white gaps in the backbone.
    strongest : tension of the thickest cable, N.
    slim : factor on the width of the backbone and on the mark at the tip.
    """
    for cable, tension in zip(drawn.cables, drawn.tensions, strict=True):
        spans = 1e3 * np.stack([cable[:-1], cable[1:]], 1)
        if strongest > 0 and tension[0] > 1e-9 * strongest:
            widths = 0.35 + 1.1 * tension / strongest
            axes.add_collection(LineCollection(list(spans), colors=[look.colour], linewidths=widths, zorder=2.4))
        else:
            axes.add_collection(LineCollection(list(spans), colors=[style.PALE], linewidths=0.4, zorder=2.0))
    axes.add_collection(
        LineCollection(list(1e3 * drawn.plates), colors=[look.colour], linewidths=1.5 * slim, zorder=2.6)
    )
    fill: dict[str, Any] = {"facecolors": [pale(look.colour)], "edgecolors": [look.colour], "linewidths": 0.5}
    axes.add_collection(PolyCollection(list(1e3 * drawn.disks), zorder=2.5, **fill))
    tip = 1e3 * drawn.disks[-1].mean(0)
    if line != "-":
        axes.plot(*1e3 * drawn.plates.reshape(-1, 2).T, color="white", ls=line, lw=0.8, zorder=2.7)
    size = 5 * slim**0.5
    axes.plot(*tip, marker=look.marker, color=look.colour, mec="white", mew=0.5 * slim, ms=size, zorder=3)


def draw_ghost(axes: Axes, drawn: Body) -> None:
    """Draw a manipulator that others are compared with: pale, plates and disks alone."""
    axes.add_collection(LineCollection(list(1e3 * drawn.plates), colors=[GHOST.colour], linewidths=1.5, zorder=1.9))
    axes.add_collection(PolyCollection(list(1e3 * drawn.disks), facecolors=[GHOST.colour], linewidths=0, zorder=1.9))
