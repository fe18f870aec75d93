"""Spots: places in a figure that stand for cases, so that a page can tell which case a reader points at."""

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

MOST_SPOTS = 1200
"""Spots that a figure keeps at most; of more, evenly spaced ones."""
BEYOND_PANEL = 1e-3
"""Share of a figure's size by which a spot may lie outside of its panel, for rounding."""
LAST = -1
"""Stands for the number of the last step of a case."""


class Spots(Artist):
    """Spots of a panel, as an artist that draws nothing: `at` (n, 2) in data coordinates, `keys` (n, 2) case and step.

    `to_scale`: whether the panel shows the plane in mm.
    """

    def __init__(self, at: np.ndarray, keys: np.ndarray, to_scale: bool) -> None:
        super().__init__()
        self.at, self.keys, self.to_scale = at, keys, to_scale
        self.set_in_layout(False)


def point_at(axes: Axes, at: np.ndarray, cases: Any, steps: Any = LAST, to_scale: bool = False) -> None:
    """Add spots to a panel.

    Parameters
    ----------
    at : (n, 2) data coordinates; places that are not finite are left out.
    cases : (n,) number of the case, or of the design, at each place; or one for all.
    steps : (n,) number of the step at each place, or one for all.
    to_scale : the panel shows the plane in mm, so that a page can draw a manipulator in it.
    """
    at = np.asarray(at, float).reshape(-1, 2)
    keys = np.empty((len(at), 2), np.int64)
    keys[:, 0], keys[:, 1] = cases, steps
    seen = np.isfinite(at).all(1)
    axes.add_artist(Spots(at[seen], keys[seen], to_scale))


def spots_of(figure: Figure) -> dict[str, Any] | None:
    """The spots of a figure whose layout is done (it has been drawn or saved); None if it has none.

    Returns
    -------
    `points`: rows (x, y, panel, case, step), x and y in shares of the figure's width and height from its upper left
    corner; `scales`: for each panel, if it is to scale, the x and y of the data point (0, 0) and the lengths of a
    millimetre along x and y, in the same shares, else None; `ratio`: height over width of the figure; `all`: number of
    spots before those beyond `MOST_SPOTS` were left out.
    """
    points: list[np.ndarray] = []
    scales: list[list[float] | None] = []
    for axes in figure.axes:
        artists = [artist for artist in axes.get_children() if isinstance(artist, Spots)]
        shares = axes.transData - figure.transFigure
        corner, far = (
            shares.transform([(0.0, 0.0), (1.0, 1.0)]) if artists and artists[0].to_scale else ((0, 0), (0, 0))
        )
        for spots in artists:
            place = shares.transform(spots.at) if len(spots.at) else spots.at
            low, high = axes.get_position().get_points()
            inside = ((place >= low - BEYOND_PANEL) & (place <= high + BEYOND_PANEL)).all(1)
            panel = np.full(inside.sum(), len(scales))
            points.append(np.column_stack([place[inside, 0], 1 - place[inside, 1], panel, spots.keys[inside]]))
        if artists:
            scale = [corner[0], 1 - corner[1], far[0] - corner[0], far[1] - corner[1]]
            scales.append([round(float(part), 7) for part in scale] if artists[0].to_scale else None)
    rows = np.concatenate(points) if points else np.zeros((0, 5))
    if not len(rows):
        return None
    some = rows[np.linspace(0, len(rows) - 1, min(len(rows), MOST_SPOTS)).round().astype(int)]
    listed = [[round(x, 4), round(y, 4), int(panel), int(case), int(step)] for x, y, panel, case, step in some.tolist()]
    width, height = figure.get_size_inches()
    return {"points": listed, "scales": scales, "ratio": round(float(height / width), 5), "all": len(rows)}
