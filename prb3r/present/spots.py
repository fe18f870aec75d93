"""Places in a figure that stand for cases, so that a page can say which case a reader points at."""

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

MOST_SPOTS = 1200
"""So many places of a figure can be pointed at; of more, evenly spaced ones."""
BEYOND_PANEL = 1e-3
"""Share of a figure by which a place at the edge of its panel may lie beyond it."""
LAST = -1
"""In place of a step: the last one of its case."""


class Spots(Artist):
    """Places in a panel, in its own coordinates, each with the number of a case and a step; nothing is drawn."""

    def __init__(self, at: np.ndarray, keys: np.ndarray, to_scale: bool) -> None:
        super().__init__()
        self.at, self.keys, self.to_scale = at, keys, to_scale
        self.set_in_layout(False)


def point_at(axes: Axes, at: np.ndarray, cases: Any, steps: Any = LAST, to_scale: bool = False) -> None:
    """Let readers point at places of a panel.

    Parameters
    ----------
    at : (n, 2) in the panel's coordinates; those that are not finite are left out.
    cases : (n,) number of the case, or of the design, at each place.
    steps : (n,) number of the step, or one for all.
    to_scale : the panel shows the plane in mm, so that a manipulator can be drawn in it.
    """
    at = np.asarray(at, float).reshape(-1, 2)
    keys = np.empty((len(at), 2), np.int64)
    keys[:, 0], keys[:, 1] = cases, steps
    seen = np.isfinite(at).all(1)
    axes.add_artist(Spots(at[seen], keys[seen], to_scale))


def spots_of(figure: Figure) -> dict[str, Any] | None:
    """The places of a figure that has been drawn; None without any.

    Returns
    -------
    `points`: rows of place in shares of width and height from the upper left corner, panel, case and step;
    `scales`: of each panel that is to scale the place of (0, 0) and the lengths of a millimetre along x and y, in the
    same shares, else None; `ratio`: height over width; `all`: how many places there were.
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
