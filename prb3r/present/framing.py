"""Limits of the axes of a drawing to scale."""

import numpy as np
from matplotlib.axes import Axes

from prb3r.present import canvas


def extremes(points: np.ndarray) -> np.ndarray:
    """(2, 2) least and greatest coordinates of `points` (n, 2), at least one; nan counts for nothing."""
    x, y = points.T
    return np.array([(np.nanmin(x), np.nanmin(y)), (np.nanmax(x), np.nanmax(y))])


def view_of(points: np.ndarray) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Limits along x and y, mm, that show `points` (n, 2), m, with a margin; and the ratio of height to width."""
    low, high = 1e3 * extremes(points)
    margin = 0.04 * np.max(high - low) + 1e-9
    x, y = (low[0] - margin, high[0] + margin), (low[1] - margin, high[1] + margin)
    return x, y, (y[1] - y[0]) / (x[1] - x[0])


def to_scale(axes: Axes, points: np.ndarray) -> None:
    """Set the limits of `axes`, in mm, to show `points` (n, 2), m, with equal scales along x and y."""
    x, y, _ = view_of(points)
    axes.set(xlim=x, ylim=y)
    axes.set_aspect("equal")
    axes.locator_params(nbins=6, steps=[1, 2, 5, 10])
    canvas.leave_room_above(axes.figure)
