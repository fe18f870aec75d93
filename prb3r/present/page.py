"""What every page and every figure file is made with: templates, tables as text, pictures, PNG and SVG."""

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jinja2
from matplotlib.figure import Figure

from prb3r.markdown import markdown_table
from prb3r.present import rc
from prb3r.runs.files import write_whole

DPI = 200
"""Of PNG files."""
PAGE_SCALE = 4.4
"""Pixels of a page for a millimetre of a figure."""


class Cell(str):
    """The text of a cell, and the number by which a page sorts its column where texts alone would not tell."""

    __slots__ = ("key",)
    key: str

    def __new__(cls, text: str, key: float) -> "Cell":
        """A cell that reads `text` and is sorted by the number `key`, kept to twelve digits."""
        cell = super().__new__(cls, text)
        cell.key = f"{key:.12g}"
        return cell


@dataclass(frozen=True)
class Table:
    """A table whose cells are text already, for pages in Markdown and HTML."""

    head: list[str]
    rows: list[list[str]]
    words: Sequence[int] = (0,)
    """Columns of words; the others hold numbers."""
    sortable: bool = False
    """Whether its rows are things of one kind, which pages sort by any column and filter."""

    @property
    def markdown(self) -> str:
        """The table in Markdown, with columns of numbers set to the right and a line end after each line."""
        numbers = set(range(len(self.head))) - set(self.words)
        rows = [[str(cell) for cell in row] for row in self.rows]
        return "".join(f"{line}\n" for line in markdown_table(self.head, rows, numbers))


@dataclass(frozen=True)
class Picture:
    """A figure in the folder of results, ready to stand in a page."""

    name: str
    caption: str
    data: str
    """The smaller of its files as a data address; of a workspace the PNG."""
    width: int = 0
    """Pixels of a page that it takes where there is room; 0 if its files do not tell."""
    spots: Mapping[str, Any] | None = None
    """Places that stand for cases, as `spots_of` gives them."""


def templates() -> jinja2.Environment:
    """The pages of reports; what they do not know is an error."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("prb3r.present"),
        undefined=jinja2.StrictUndefined,
        autoescape=jinja2.select_autoescape(["html.j2"]),
        trim_blocks=True,
        lstrip_blocks=True,
    )


def briefly(title: str, sentences: Sequence[str], table: Table | None = None) -> str:
    """A result as a piece of HTML without pictures, for notebooks: title, sentences, a table that is not sorted."""
    plain = None if table is None else replace(table, sortable=False)
    return templates().get_template("brief.html.j2").render(title=title, sentences=sentences, rows=plain)


def picture(folder: Path, name: str, caption: str, kind: str = "", spots: Mapping | None = None) -> Picture:
    """A figure whose files are in `folder` already; `kind` is that of its plot, `spots` are what can be pointed at.

    Raises
    ------
    FileNotFoundError
        If it has neither PNG nor SVG.
    """
    types = {".png": "image/png", ".svg": "image/svg+xml"}
    files = [path for path in (folder / f"{name}.png", folder / f"{name}.svg") if path.exists()]
    if not files:
        raise FileNotFoundError(f"{folder / name}.png: the figure of plot {name!r} is missing")
    chosen = files[0] if kind == "workspace" else min(files, key=lambda path: path.stat().st_size)
    data = data_address(types[chosen.suffix], chosen.read_bytes())
    return Picture(name, caption, data, _page_width(files[0]), spots)


def data_address(kind: str, content: bytes) -> str:
    """A file as an address that holds all of it; `kind` is such as `image/png`."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _page_width(path: Path) -> int:
    """Pixels of a page for a PNG: as many for a millimetre in every figure, so that all letters are of one size."""
    head = path.read_bytes()[:24]
    return round(int.from_bytes(head[16:20], "big") / DPI * 25.4 * PAGE_SCALE) if head[:4] == b"\x89PNG" else 0


def save_figure(figure: Figure, folder: str | Path, name: str) -> list[Path]:
    """Write `name.png` (200 dpi) and `name.svg` whole or not at all; the same figure gives the same bytes.

    Returns
    -------
    The paths of both files.  Raises what `write_whole` raises.
    """
    paths, layout = [], figure.get_layout_engine()
    for kind, metadata in (("png", {"Software": None}), ("svg", {"Date": None, "Creator": None})):
        content = io.BytesIO()
        with rc.in_use():
            figure.savefig(content, format=kind, dpi=DPI, metadata=metadata)
        figure.set_layout_engine("none")  # what stands where in one file, stands there in the other
        paths.append(write_whole(Path(folder) / f"{name}.{kind}", content.getvalue()))
    figure.set_layout_engine(layout)
    return paths
