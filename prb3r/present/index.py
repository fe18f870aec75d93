"""One page over all results in a folder: studies, comparisons, diagnoses and proofs, each with its answer."""

import contextlib
import io
import json
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import quote

from matplotlib.image import imread, imsave

from prb3r.errors import Problem, SpecError
from prb3r.present.page import data_address, templates
from prb3r.runs.files import ensure_writable, write_whole
from prb3r.runs.provenance import read_manifest

INDEX_PAGE = "index.html"
THUMBNAIL = 4
"""So many pixels of a figure to either side are one of its thumbnail."""
SHORT = 280
"""So many letters of a question or an answer are shown."""


@dataclass(frozen=True)
class Entry:
    """A result, as the index shows it."""

    title: str
    question: str
    answer: str
    date: str
    """Day and time when it was written, UTC."""
    folder: Path
    page: str
    """The file to read, in the folder."""
    figure: Path | None = None

    @property
    def sort_key(self) -> tuple[str, str]:
        """Entries stand in the order of their folders."""
        return self.folder.as_posix(), self.page


def write_index(folder: Path) -> tuple[Path, int]:
    """Write `index.html` over everything in `folder` and the folders below; its path and how much it lists.

    Raises
    ------
    SpecError
        If there is no such folder, or no result in it.
    """
    if not folder.is_dir():
        raise SpecError(Problem(str(folder), "no such folder"))
    rooms = [
        (heading, sorted(_found(folder, mark, read), key=lambda e: e.sort_key)) for heading, mark, read in RESULT_KINDS
    ]
    total = sum(len(entries) for _, entries in rooms)
    if not total:
        what = "holds no study, comparison, diagnosis or proof; `prb3r run STUDY.toml` writes one into results/"
        raise SpecError(Problem(str(folder), what))
    ensure_writable(folder)
    counts = [
        f"{len(entries)} {_ONE.get(heading, heading) if len(entries) == 1 else heading}"
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
    """Entries of the folders that hold the file `mark`; hidden folders are passed over."""
    for place, inside, files in os.walk(folder):
        inside[:] = [name for name in inside if not name.startswith(".")]
        if mark in files and (entry := read(Path(place))) is not None:
            yield entry


def _card(entry: Entry, folder: Path) -> dict[str, str]:
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
    text = " ".join(text.split())
    return text if len(text) <= SHORT else f"{text[:SHORT].rsplit(' ', 1)[0]} …"


def _thumbnail(figure: Path | None) -> str:
    """A small copy of a figure as a data address; empty without one, or where the file is no picture."""
    if figure is None:
        return ""
    content = io.BytesIO()
    try:
        pixels = imread(figure)[:, :, :3]
        height, width = (size // THUMBNAIL for size in pixels.shape[:2])
        blocks = pixels[: height * THUMBNAIL, : width * THUMBNAIL].reshape(height, THUMBNAIL, width, THUMBNAIL, 3)
        imsave(content, blocks.mean((1, 3)), format="png", metadata={"Software": None})  # type: ignore[dict-item]
    except (OSError, SyntaxError, ValueError):
        return ""
    return data_address("image/png", content.getvalue())


def _study(folder: Path) -> Entry | None:
    manifest = read_manifest(folder)
    study = (manifest or {}).get("study", {})
    if manifest is None or "title" not in study:
        return None
    counts = manifest.get("outcomes") or {}
    total, failed = manifest.get("cases", 0), manifest.get("cases", 0) - counts.get("converged", 0)
    plain = (
        f"{total:,} cases, {f'{failed:,} of them without a stable equilibrium' if failed else 'all in equilibrium'}."
    )
    names = ["decision", *(plot["name"] for plot in study.get("plot", [])), "rigs"]
    answer = _head(folder / "report.html").answer or plain
    date = _day(manifest.get("written", ""))
    page = _first(folder, "report.html", "summary.md", "cases.parquet")
    return Entry(study["title"], study.get("question", ""), answer, date, folder, page, _figure(folder, names))


def _diagnosis(folder: Path) -> Entry | None:
    known = _json(folder / "diagnosis.json")
    if "verdict" not in known:
        return None
    statements = [effect["statement"] for effect in known.get("effects", []) if "statement" in effect]
    named = known.get("name") or folder.name
    answer = _head(folder / "report.html").answer or f"{known['verdict'].capitalize()}. {' '.join(statements)}"
    page = _first(folder, "report.html", "diagnosis.json")
    figure = _figure(folder, ["shapes", "missing-moment"])
    date = _written(folder / "diagnosis.json")
    return Entry(f"Diagnosis: {named}", "", answer, date, folder, page, figure)


def _comparison(folder: Path) -> Entry | None:
    text = (folder / "comparison.md").read_text("utf-8", errors="replace")
    page = _first(
        folder, "comparison.html", "report.html" if not (folder / "manifest.json").exists() else "", "comparison.md"
    )
    answer = next((line for line in text.splitlines() if line.strip()), "").replace("**", "")
    figure = _figure(folder, ["comparison", "comparison-front"])
    return Entry(
        _head(folder / page).title or f"Comparison in {folder.name}",
        "",
        answer,
        _written(folder / "comparison.md"),
        folder,
        page,
        figure,
    )


def _proof(folder: Path) -> Entry | None:
    known = _json(folder / "proof.json")
    if "scores" not in known:
        return None
    scores: list[dict] = next(iter(known["scores"].values()), [])
    met = sum(bool(score.get("met")) for score in scores)
    answer = (
        f"{met} of {len(scores)} goals are met, over {known.get('recordings', 0):,} recordings with concealed effects."
    )
    date = _day(known.get("environment", {}).get("written", "")) or _written(folder / "proof.json")
    page = _first(folder, "report.html", "proof.md", "proof.json")
    asked = "Does the diagnosis find effects that are concealed from it?"
    return Entry("Concealed effects", asked, answer, date, folder, page, _figure(folder, ["confusion"]))


RESULT_KINDS: tuple[tuple[str, str, Callable[[Path], Entry | None]], ...] = (
    ("Studies", "manifest.json", _study),
    ("Comparisons", "comparison.md", _comparison),
    ("Diagnoses", "diagnosis.json", _diagnosis),
    ("Proofs", "proof.json", _proof),
)
"""Of each kind of result its heading, the file by which it is known, and how it is read."""
_ONE = {"Studies": "study", "Comparisons": "comparison", "Diagnoses": "diagnosis", "Proofs": "proof"}


def _json(path: Path) -> dict:
    """A file's table; empty where it is damaged."""
    try:
        known = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    return known if isinstance(known, dict) else {}


def _first(folder: Path, *names: str) -> str:
    """The first of some files that is there, or the last name."""
    return next((name for name in names if name and (folder / name).is_file()), names[-1])


def _figure(folder: Path, names: list[str]) -> Path | None:
    return next((path for name in names if (path := folder / f"{name}.png").is_file()), None)


def _day(stamp: str) -> str:
    """`2026-11-22T16:05:24Z` as `2026-11-22 16:05`."""
    return re.sub(r"T(\d\d:\d\d).*", r" \1", stamp)


def _written(path: Path) -> str:
    return f"{datetime.fromtimestamp(path.stat().st_mtime, UTC):%Y-%m-%d %H:%M}"


class _Head(HTMLParser):
    """Title and answer that a page gives of itself; empty where it gives none."""

    title, answer = "", ""
    inside = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep what the tag of the description holds."""
        named = dict(attrs)
        self.inside = tag == "title"
        if tag == "meta" and named.get("name") == "description":
            self.answer = (named.get("content") or "").strip()

    def handle_data(self, data: str) -> None:
        """Keep the words of the title."""
        if self.inside:
            self.title += data.strip()


def _head(page: Path) -> _Head:
    """What a page says of itself, before its style begins."""
    head = _Head()
    with contextlib.suppress(OSError):
        head.feed(page.read_text("utf-8", errors="replace").partition("<style>")[0])
    return head
