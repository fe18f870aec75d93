"""The plot `workspace`: the regions that tips reach under clouds of loads, filled and outlined."""

from typing import Any

import numpy as np
import scipy
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from prb3r.model.files.cells import count
from prb3r.present import canvas, style
from prb3r.present.framing import extremes, to_scale, view_of
from prb3r.present.spots import point_at
from prb3r.present.study.shapes import draw_body, not_drawn, notes, straight
from prb3r.present.study.sheet import Sheet
from prb3r.present.style import Look, pale
from prb3r.study.plots.kinds import WorkspacePlot

THIN = 0.75
"""Value of cells that hold points and that smoothing would empty, as where a region is one cell wide; the outline is at
0.5."""
MOST_THIN = 0.25
"""Share of such cells beyond which the region is as good as a curve: its points are drawn instead of an outline."""


def workspace_figure(sheet: Sheet[WorkspacePlot]) -> Figure:
    """Regions that tips reach: several in a panel differ in colour, hatch and line, a single one shows its density."""
    if sheet.states is None:
        raise ValueError(f"plot {sheet.plot.name!r} draws workspaces and needs states")
    tips = sheet.states[sheet.states["disk"] == sheet.states.groupby("case_id")["disk"].transform("max")]
    of_case = dict(iter(tips.groupby("case_id")))
    clouds = {number: cloud[["x_m", "y_m"]].to_numpy(float) for number, cloud in of_case.items()}
    steps = {number: cloud["step"].to_numpy() for number, cloud in of_case.items()}
    clouds = {number: clouds.get(number, np.zeros((0, 2))) for number in sheet.rows["case_id"].unique()}
    reached = {number: cloud[np.isfinite(cloud).all(1)] for number, cloud in clouds.items()}
    failed = []
    for _, row in sheet.rows.iterrows():
        tried, good = len(clouds[row["case_id"]]), len(reached[row["case_id"]])
        drawn = np.max(steps.get(row["case_id"], 0), initial=0)  # steps of loads beyond yield are left out
        if good < tried or not tried:
            shown = f"{'the first ' if sheet.scene.loads is not None else ''}{count(tried, 'load', ',')}"
            what = f"{tried - good:,} of {shown} without equilibrium" if tried else str(row["outcome"])
            failed.append(not_drawn(sheet, row, what))
        if tried < drawn:
            share = style.digits(float(f"{100 * (1 - tried / drawn):.2g}"))
            failed.append(not_drawn(sheet, row, f"{share} % of the loads left out, plates would yield"))
    titles, parts = sheet.panels()
    rests = [straight(sheet.scene.manipulator(int(part["case_id"].iloc[0]))) for part in parts]
    shapes = [rest.disks.reshape(-1, 2) for rest in rests] + [cloud for cloud in reached.values() if len(cloud)]
    corners = np.concatenate([extremes(points) for points in shapes])
    figure, axes = canvas.panels(titles, sheet.handles(patch=True) + notes(failed), view_of(corners)[2])
    for panel, part, rest in zip(axes, parts, rests, strict=True):
        draw_body(panel, rest, Look(style.PALE, "", "-", ""), "-", 0.0)
        groups = list(sheet.groups(part))
        for look, line, group in groups:
            points = np.concatenate([reached[number] for number in group["case_id"]])
            if len(points) > 2:
                _region(panel, points, look, line, lone=len(groups) == 1)
        for number in part["case_id"].unique():
            if len(clouds[number]):
                point_at(panel, 1e3 * clouds[number], number, steps[number], to_scale=True)
        to_scale(panel, corners)
    canvas.outer_labels(axes, "tip $x$ (mm)", "tip $y$ (mm)")
    return figure


def occupancy(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Square cells over `points` (n, 2), m: x (a,) and y (b,) of their centres, m, points in each, and the region.

    The region (a, b) is a smoothed mask, inside above one half, with every cell that holds a point.  Cells are as small
    as the points allow: about eight points in each on average.
    """
    low, high = extremes(points)
    size = max(*(high - low), 1e-9)
    coarse = size / np.clip(np.sqrt(len(points)) / 4, 8, 60)
    column, row = np.floor((points - low) / coarse).astype(int).T
    taken = np.count_nonzero(np.bincount(column * (row.max() + 1) + row))
    side = np.clip(coarse * np.sqrt(8 * taken / len(points)), size / 200, size / 8)
    counts = np.ceil((high - low) / side).astype(int) + 9
    edges = [start + side * (np.arange(count + 1) - 4) for start, count in zip(low, counts, strict=True)]
    filled, *_ = np.histogram2d(points[:, 0], points[:, 1], bins=edges)
    mask = scipy.ndimage.binary_closing(
        filled > 0, scipy.ndimage.iterate_structure(scipy.ndimage.generate_binary_structure(2, 1), 3)
    )
    x, y = (edge[:-1] + side / 2 for edge in edges)
    inside = scipy.ndimage.gaussian_filter(mask.astype(float), 1.0)
    thin = _side_by_side(mask & (inside <= 0.5), mask)
    return x, y, filled, np.where(thin, np.maximum(inside, THIN), inside)


def _side_by_side(cells: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """`cells` (a, b) and those that link them to cells of `mask` that they touch at a corner alone."""
    linked = cells.copy()
    for turned in (1, -1):
        one, out, full = linked[:, ::turned], cells[:, ::turned], mask[:, ::turned]
        corner = (out[:-1, :-1] & full[1:, 1:]) | (full[:-1, :-1] & out[1:, 1:])
        corner &= ~full[1:, :-1] & ~full[:-1, 1:]
        one[1:, :-1] |= corner
    return linked


def _region(axes: Axes, points: np.ndarray, look: Look, line: Any, lone: bool) -> None:
    """Draw the region that `points` (n, 2), m, fill, with its outline; `lone`: with the density of the points.

    Every point is within the outline, or drawn where they lie along a curve, as where cables bend a single segment.
    """
    x, y, filled, inside = occupancy(points)
    if np.mean(inside[filled > 0] == THIN) > MOST_THIN:
        axes.plot(*1e3 * points.T, ls="", marker=".", ms=1.6, mew=0, color=look.colour, rasterized=True, zorder=1.5)
        return
    at = 1e3 * x, 1e3 * y, inside.T
    if lone:
        density = np.where(inside > 0.5, scipy.ndimage.gaussian_filter(filled, 1.0), np.nan)
        shades = LinearSegmentedColormap.from_list("", [pale(look.colour, 0.12), pale(look.colour, 0.75)])
        axes.pcolormesh(*at[:2], np.log1p(density).T, cmap=shades, rasterized=True, zorder=1.1)
    else:
        fills = [axes.contourf(*at, levels=[0.5, 2.0], colors=[look.colour], alpha=0.10, zorder=1.1)]
        if look.hatch:
            fills.append(axes.contourf(*at, levels=[0.5, 2.0], colors="none", hatches=[look.hatch], zorder=1.2))
            fills[1].set(edgecolor=pale(look.colour, 0.55), linewidth=0.0)
        for fill in fills:
            fill.set_rasterized(True)
    axes.contour(*at, levels=[0.5], colors=[look.colour], linestyles=[line], linewidths=1.0, zorder=1.6)
