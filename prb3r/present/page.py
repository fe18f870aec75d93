"""Parts that all pages share: templates, tables as text, pictures in pages.  Matplotlib is not loaded for them."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jinja2

from prb3r.markdown import markdown_table

DPI = 200
"""Resolution of PNG files."""
PAGE_SCALE = 4.4
"""Pixels of a page per millimetre of a figure."""


class Cell(str):
    """The text of a table cell with the number by which a page sorts its column, where the text is not that number."""

    __slots__ = ("key",)
    key: str
    """The number as text."""

    def __new__(cls, text: str, key: float) -> "Cell":
        """A cell that reads `text` and sorts by the number `key`, which is kept to twelve digits."""
        cell = super().__new__(cls, text)
        cell.key = f"{key:.12g}"
        return cell


@dataclass(frozen=True)
class Table:
    """A table whose cells are text already, for pages in Markdown and HTML."""

    head: list[str]
    rows: list[list[str]]
    words: Sequence[int] = (0,)
    """Numbers of the columns of words, from 0; the others hold numbers and are set to the right."""
    sortable: bool = False
    """Whether pages let a reader sort the rows by any column and filter them."""

    @property
    def markdown(self) -> str:
        """The table in Markdown, columns of numbers set to the right, with a line end after each line."""
        numbers = set(range(len(self.head))) - set(self.words)
        rows = [[str(cell) for cell in row] for row in self.rows]
        return "".join(f"{line}\n" for line in markdown_table(self.head, rows, numbers))


@dataclass(frozen=True)
class Picture:
    """A figure of the folder of results, as a page holds it."""

    name: str
    caption: str
    data: str
    """The smaller one of its PNG and SVG files as a data address; of a workspace the PNG."""
    width: int = 0
    """Width in pixels of the page; 0 if there is no PNG to tell it."""
    spots: Mapping[str, Any] | None = None
    """Places in it that stand for cases, as `spots_of` gives them."""


def templates() -> jinja2.Environment:
    """The templates of all pages; a name that a template uses and is not given raises an error."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("prb3r.present"),
        undefined=jinja2.StrictUndefined,
        autoescape=jinja2.select_autoescape(["html.j2"]),
        trim_blocks=True,
        lstrip_blocks=True,
    )


def briefly(title: str, sentences: Sequence[str], table: Table | None = None) -> str:
    """A result as a piece of HTML for notebooks, without pictures: title, sentences, and a table without sorting."""
    plain = None if table is None else replace(table, sortable=False)
    return templates().get_template("brief.html.j2").render(title=title, sentences=sentences, rows=plain)


def picture(folder: Path, name: str, caption: str, kind: str = "", spots: Mapping | None = None) -> Picture:
    """The figure `name`, whose files are in `folder` already; `kind` is that of its plot, `spots` as in `Picture`.

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
    """A data address (RFC 2397) that holds the content of a file; `kind` is its media type, such as `image/png`."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _page_width(path: Path) -> int:
    """Width of a PNG file in pixels of a page, 0 for other files; the scale is the same for all figures, so that all
    letters have one size."""
    head = path.read_bytes()[:24]
    return round(int.from_bytes(head[16:20], "big") / DPI * 25.4 * PAGE_SCALE) if head[:4] == b"\x89PNG" else 0
