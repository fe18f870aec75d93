"""PNG and SVG files of figures."""

import io
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from prb3r.present import rc
from prb3r.present.page import DPI
from prb3r.runs.files import write_whole


def save_figure(figure: Figure, folder: str | Path, name: str) -> list[Path]:
    """Write `name.png` (200 dpi) and `name.svg`, each whole or not at all; the same figure gives the same bytes.

    Returns
    -------
    The paths of both files.  Raises what `write_whole` raises.
    """
    paths, layout, dpi, canvas = [], figure.get_layout_engine(), figure.dpi, figure.canvas
    figure.set_dpi(DPI)
    for kind, written_by, metadata in (
        ("png", FigureCanvasAgg, {"Software": None}),
        ("svg", FigureCanvasSVG, {"Date": None, "Creator": None}),
    ):
        content = io.BytesIO()
        with rc.in_use():  # `savefig` draws every figure once more, to no effect on what is written
            getattr(written_by(figure), f"print_{kind}")(content, metadata=metadata)
        figure.set_layout_engine("none")  # the second file has the layout of the first
        paths.append(write_whole(Path(folder) / f"{name}.{kind}", content.getvalue()))
    figure.set_layout_engine(layout)
    figure.set_dpi(dpi)
    figure.set_canvas(canvas)
    return paths
