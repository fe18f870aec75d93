"""Spots: places in a figure that stand for cases, so that a page can tell which case a reader points at."""

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Transform

MOST_SPOTS = 1200
"""Spots that a figure keeps at most; of more, evenly spaced ones."""
BEYOND_PANEL = 1e-3
"""Share of a figure's size by which a spot may lie outside of its panel, for rounding."""
LAST = -1
"""Stands for the number of the last step of a case."""


class Spots(Artist):
    """Spots of a panel, as an artist that draws nothing: `at` (n, 2) in data coordinates, `cases` and `steps` (n,).

    `to_scale`: whether the panel shows the plane in mm.
    """

    def __init__(self, at: np.ndarray, cases: np.ndarray, steps: np.ndarray, to_scale: bool) -> None:
        super().__init__()
        self.at, self.cases, self.steps, self.to_scale = at, cases, steps, to_scale
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
    case, step = (np.broadcast_to(np.asarray(each, np.int64), len(at)) for each in (cases, steps))
    axes.add_artist(Spots(at, case, step, to_scale))


def spots_of(figure: Figure) -> dict[str, Any] | None:
    """The spots of a figure whose layout is done (it has been drawn or saved); None if it has none.

    Returns
    -------
    `points`: rows (x, y, panel, case, step), x and y in shares of the figure's width and height from its upper left
    corner; `scales`: for each panel, if it is to scale, the x and y of the data point (0, 0) and the lengths of a
    millimetre along x and y, in the same shares, else None; `ratio`: height over width of the figure; `all`: number of
    spots before those beyond `MOST_SPOTS` were left out.
    """
    inside: list[tuple[int, Spots, Transform, np.ndarray]] = []
    scales: list[list[float] | None] = []
    for axes in figure.axes:
        artists = [artist for artist in axes.get_children() if isinstance(artist, Spots)]
        shares = axes.transData - figure.transFigure
        corners = axes.get_position().get_points() + BEYOND_PANEL * np.array([[-1], [1]])
        low, high = np.sort(shares.inverted().transform(corners), axis=0)
        for spots in artists:
            seen = np.flatnonzero(((spots.at >= low) & (spots.at <= high)).all(1))
            inside.append((len(scales), spots, shares, seen))
        if artists:
            scales.append(_scale(shares) if artists[0].to_scale else None)
    total = sum(len(seen) for *_, seen in inside)
    if not total:
        return None
    some, first, listed = np.linspace(0, total - 1, min(total, MOST_SPOTS)).round().astype(int), 0, []
    for panel, spots, shares, seen in inside:
        chosen = seen[some[(some >= first) & (some < first + len(seen))] - first]
        first += len(seen)
        numbers = zip(spots.cases[chosen].tolist(), spots.steps[chosen].tolist(), strict=True)
        places = shares.transform(spots.at[chosen]).tolist() if len(chosen) else []
        for (x, y), (case, step) in zip(places, numbers, strict=True):
            listed.append([round(x, 4), round(1 - y, 4), panel, case, step])
    width, height = figure.get_size_inches()
    return {"points": listed, "scales": scales, "ratio": round(float(height / width), 5), "all": total}


def _scale(shares: Transform) -> list[float]:
    """The data point (0, 0), and the lengths along x and y of a millimetre, in shares from the upper left corner."""
    corner, far = shares.transform([(0.0, 0.0), (1.0, 1.0)])
    return [round(float(part), 7) for part in (corner[0], 1 - corner[1], far[0] - corner[0], far[1] - corner[1])]
