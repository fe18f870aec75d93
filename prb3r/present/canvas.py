"""Axes to draw on: those of a new figure or, within `drawn_on`, axes that the caller gives."""

import contextlib
from collections.abc import Iterator, Sequence
from contextvars import ContextVar
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from prb3r.present import style
from prb3r.present.legends import legend_shape

Panels = Axes | Sequence[Axes] | np.ndarray | None
"""Axes to draw on: one, or as many as a plot has panels; None: a new figure."""

_GIVEN: ContextVar[tuple[Axes, ...] | None] = ContextVar("axes that are given", default=None)


ROOM_ABOVE = 1.2
"""Margin above the titles of panels with equal scales, mm."""


@contextlib.contextmanager
def drawn_on(axes: Panels) -> Iterator[None]:
    """Within the block figures are drawn on these axes, in the order of their panels; on new figures with None.

    Raises
    ------
    ValueError
        From the function that draws, if there are not as many axes as panels.
    """
    given = None if axes is None else tuple(np.ravel(np.asarray(axes, object)))
    token = _GIVEN.set(given)
    try:
        yield
    finally:
        _GIVEN.reset(token)


def axes_grid(
    size: tuple[float, float], shape: tuple[int, int], count: int, **options: Any
) -> tuple[Figure, np.ndarray]:
    """A figure and an array (rows, columns) of axes: new ones or, within `drawn_on`, the given ones, then None.

    Parameters
    ----------
    size : width and height of a new figure, mm.
    shape : rows and columns of axes.
    count : number of axes that are drawn on, the first ones; spare new ones are removed from the figure.
    options : as `Figure.subplots` takes them.

    Raises
    ------
    ValueError
        If there are not `count` given axes.
    """
    given = _GIVEN.get()
    if given is not None:
        if len(given) != count:
            raise ValueError(f"this plot has {count} panel{'s' * (count != 1)}: give as many axes, not {len(given)}")
        figure, axes = given[0].figure, np.array([*given, *[None] * (shape[0] * shape[1] - count)], object)
        assert isinstance(figure, Figure)
        return figure, axes.reshape(shape)
    figure = Figure(figsize=(size[0] * style.MM, size[1] * style.MM), layout="constrained")
    axes = figure.subplots(*shape, squeeze=False, **options)
    for spare in axes.ravel()[count:]:
        spare.remove()
    return figure, axes


def close_up(figure: Figure) -> None:
    """Set narrow gaps between the panels of a new figure; a figure of given axes is left as it is."""
    engine = figure.get_layout_engine()
    if _GIVEN.get() is None and engine is not None:
        engine.set(w_pad=0.8 * style.MM, h_pad=0.8 * style.MM, wspace=0.02, hspace=0.02)  # type: ignore[call-arg]


def leave_room_above(figure: Figure | SubFigure) -> None:
    """Leave a margin above the panels of a new figure: axes of equal scales grow after their titles were measured."""
    engine = figure.get_layout_engine()
    if _GIVEN.get() is None and engine is not None and isinstance(figure, Figure):
        share = ROOM_ABOVE * style.MM / figure.get_figheight()
        engine.set(rect=(0, 0, 1, 1 - share))  # type: ignore[call-arg]


def legend(figure: Figure, axes: Axes, columns: int, handles: Sequence[Artist] | None = None, **ink: Any) -> None:
    """Add a legend in `columns` below a new figure or, on given axes, into `axes`; without `handles` of all labels."""
    known = {} if handles is None else {"handles": list(handles)}
    if _GIVEN.get() is None:
        figure.legend(loc="outside lower center", ncols=columns, **known, **ink)
    else:
        axes.legend(**known, **ink)


def panels_in_row(axes: Sequence[Axes]) -> int:
    """Number of these panels that stand side by side; 1 for given axes, as their arrangement is the caller's."""
    grid = axes[0].get_gridspec()
    return 1 if _GIVEN.get() is not None or grid is None else grid.ncols


def panels(
    titles: Sequence[str],
    handles: Sequence[Artist],
    ratio: float,
    shared: bool | Literal["row"] = True,
    columns: int | None = None,
) -> tuple[Figure, list[Axes]]:
    """A figure with a panel for each title, and these axes; one legend of `handles` stands below.

    A single panel has the width of one text column, several have that of two.  On given axes the legend is in the last.

    Parameters
    ----------
    ratio : height of a panel over its width.
    shared : whether all panels (`row`: those of a row) have the same range, with numbers at outer panels only.
    columns : panels in a row; by default up to three, two of four panels, and four of more than twelve.
    """
    count = max(len(titles), 1)
    width = style.SINGLE if count == 1 else style.DOUBLE
    columns = columns or (count if count <= 3 else 2 if count == 4 else 3 if count <= 12 else 4)
    rows = -(-count // columns)
    beside, long = legend_shape([str(handle.get_label()) for handle in handles], width)
    inner = (width - (14 if shared else 14 * columns)) / columns
    labels = (9 if shared else 9 * rows) + 4 * -(-len(handles) // beside)
    height = rows * (ratio * inner + (4 if any(titles) else 1)) + labels + 1
    figure, grid = axes_grid((width, height), (rows, columns), count, sharex=bool(shared), sharey=shared)
    close_up(figure)
    used = list(grid.ravel()[:count])
    for index, (axes, text) in enumerate(zip(used, titles, strict=False)):
        if _GIVEN.get() is None:
            left, bottom = index % columns == 0, index + columns >= count
            axes.tick_params(labelleft=left or not shared, labelbottom=bottom or not shared)
        if text or _GIVEN.get() is None:
            axes.set_title(text, pad=3)
    if handles:
        legend(figure, used[-1], beside, handles, labelspacing=0.35, handlelength=long)
    return figure, used


def outer_labels(axes: Sequence[Axes], x: str, y: str) -> None:
    """Label the left and lowest panels of a grid with shared axes."""
    columns = panels_in_row(axes)
    for index, panel in enumerate(axes):
        if index % columns == 0:
            panel.set_ylabel(y)
        if index + columns >= len(axes):
            panel.set_xlabel(x)
