"""One page over all results in a folder: studies, comparisons, diagnoses and proofs, each with its answer."""

import io
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import quote

from matplotlib.image import imread, imsave

from prb3r.errors import Problem, SpecError
from prb3r.present.entries import ONE_OF, RESULT_KINDS, Entry
from prb3r.present.page import data_address, templates
from prb3r.runs.files import ensure_writable, write_whole

INDEX_PAGE = "index.html"
THUMBNAIL = 4
"""A thumbnail is smaller than its figure by this factor, along width and height."""
SHORT = 280
"""Letters of a question or an answer that are shown; longer ones are cut off."""


def write_index(folder: Path) -> tuple[Path, int]:
    """Write `index.html` over all results in `folder` and the folders below; its path and the number of results.

    Raises
    ------
    SpecError
        If there is no such folder, or no result in it.
    """
    if not folder.is_dir():
        raise SpecError(
            Problem(str(folder), "is a file; give a folder of results" if folder.exists() else "no such folder")
        )
    rooms = [
        (heading, sorted(_found(folder, mark, read), key=lambda e: e.sort_key)) for heading, mark, read in RESULT_KINDS
    ]
    total = sum(len(entries) for _, entries in rooms)
    if not total:
        what = "holds no study, comparison, diagnosis or proof; `prb3r run STUDY.toml` writes one into results/"
        raise SpecError(Problem(str(folder), what))
    ensure_writable(folder)
    counts = [
        f"{len(entries)} {ONE_OF.get(heading, heading) if len(entries) == 1 else heading}"
        for heading, entries in rooms
        if entries
    ]
    page = (
        templates()
        .get_template("index.html.j2")
        .render(
            title=f"Results in {folder.resolve().name}",
            count=f"{', '.join(counts).lower()}.",
            rooms=[(heading, [_card(entry, folder) for entry in entries]) for heading, entries in rooms if entries],
        )
    )
    return write_whole(folder / INDEX_PAGE, page.encode()), total


def _found(folder: Path, mark: str, read: Callable[[Path], Entry | None]) -> Iterator[Entry]:
    """Entries of the folders that hold the file `mark`, as `read` reads them; hidden folders are passed over."""
    for place, inside, files in os.walk(folder):
        inside[:] = [name for name in inside if not name.startswith(".")]
        if mark in files and (entry := read(Path(place))) is not None:
            yield entry


def _card(entry: Entry, folder: Path) -> dict[str, str]:
    """An entry as the template of the index in `folder` takes it: texts, link and thumbnail."""
    inner = entry.folder.relative_to(folder).as_posix()
    return {
        "title": entry.title,
        "question": _short(entry.question),
        "answer": _short(entry.answer),
        "date": entry.date,
        "where": inner if inner != "." else "this folder",
        "link": quote((entry.folder / entry.page).relative_to(folder).as_posix()),
        "thumbnail": _thumbnail(entry.figure),
    }


def _short(text: str) -> str:
    text = " ".join(text.replace("`", "").split())
    return text if len(text) <= SHORT else f"{text[:SHORT].rsplit(' ', 1)[0]} …"


def _thumbnail(figure: Path | None) -> str:
    """A small copy of a figure as a data address; empty without a figure, or if the file is no picture."""
    if figure is None:
        return ""
    content = io.BytesIO()
    try:
        pixels = imread(figure)[:, :, :3]
        height, width = (size // THUMBNAIL for size in pixels.shape[:2])
        blocks = pixels[: height * THUMBNAIL, : width * THUMBNAIL].reshape(height, THUMBNAIL, width, THUMBNAIL, 3)
        imsave(content, blocks.mean((1, 3)), format="png", metadata={"Software": None})  # type: ignore[dict-item]
    except (OSError, SyntaxError, ValueError, IndexError):
        return ""
    return data_address("image/png", content.getvalue())
