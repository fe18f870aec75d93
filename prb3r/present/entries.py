"""Results of studies, comparisons, diagnoses and proofs as entries of an index, read from their folders."""

import contextlib
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from html.parser import HTMLParser
from pathlib import Path

from prb3r.markdown import listed, quoted
from prb3r.model.files.cells import count
from prb3r.runs.provenance import read_manifest
from prb3r.study.phrases import failures_in_words


@dataclass(frozen=True)
class Entry:
    """A result, as the index shows it."""

    title: str
    question: str
    """Empty if the result states none."""
    answer: str
    date: str
    """Day and time when the result was written, UTC: `2026-11-22 16:05`."""
    folder: Path
    page: str
    """Name of the file in the folder that a reader should open."""
    figure: Path | None = None
    """PNG file for the thumbnail, if there is one."""

    @property
    def sort_key(self) -> tuple[str, str]:
        """Key that sorts entries by folder, then by page."""
        return self.folder.as_posix(), self.page


# Each of the next five functions reads one kind of result from its folder, None if the file that marks it is unusable.
def _study(folder: Path) -> Entry | None:
    manifest = read_manifest(folder)
    study = (manifest or {}).get("study", {})
    if manifest is None or "title" not in study:
        return None
    counts = manifest.get("outcomes") or {}
    cases = count(manifest.get("cases", 0), "case", ",")
    plain = f"{cases}, {failures_in_words(counts, 'of them ') or 'all in equilibrium'}."
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


def _together(folder: Path) -> Entry | None:
    known = _json(folder / "together.json")
    if not isinstance(known.get("recordings"), list):
        return None
    answer = " ".join(map(str, known.get("statements") or []))
    page, named = _first(folder, "report.html", "together.json"), listed(quoted(list(map(str, known["recordings"]))))
    date = _written(folder / "together.json")
    return Entry(f"Diagnosed together: {named}", "", answer, date, folder, page, _figure(folder, ["shared"]))


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
    recordings = count(known.get("recordings", 0), "recording", ",")
    answer = f"{met} of {count(len(scores), 'goal')} are met, over {recordings} with concealed effects."
    date = _day(known.get("environment", {}).get("written", "")) or _written(folder / "proof.json")
    page = _first(folder, "report.html", "proof.md", "proof.json")
    asked = "Does the diagnosis find effects that are concealed from it?"
    return Entry("Concealed effects", asked, answer, date, folder, page, _figure(folder, ["confusion"]))


RESULT_KINDS: tuple[tuple[str, str, Callable[[Path], Entry | None]], ...] = (
    ("Studies", "manifest.json", _study),
    ("Comparisons", "comparison.md", _comparison),
    ("Diagnoses", "diagnosis.json", _diagnosis),
    ("Diagnoses of several recordings", "together.json", _together),
    ("Proofs", "proof.json", _proof),
)
"""For each kind of result its heading, the file that marks its folder, and the function that reads the folder."""
ONE_OF = {
    "Studies": "study",
    "Comparisons": "comparison",
    "Diagnoses": "diagnosis",
    "Diagnoses of several recordings": "diagnosis of several recordings",
    "Proofs": "proof",
}
"""Singular of each heading."""


def _json(path: Path) -> dict:
    """The JSON object in a file; empty if the file is missing, damaged or holds anything else."""
    try:
        known = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    return known if isinstance(known, dict) else {}


def _first(folder: Path, *names: str) -> str:
    """The first of these names that is a file in the folder; if none is, the last name."""
    return next((name for name in names if name and (folder / name).is_file()), names[-1])


def _figure(folder: Path, names: list[str]) -> Path | None:
    """The first of these figures whose PNG file is in the folder."""
    return next((path for name in names if (path := folder / f"{name}.png").is_file()), None)


def _day(stamp: str) -> str:
    """Day and minute of a time stamp: `2026-11-22T16:05:24Z` as `2026-11-22 16:05`."""
    return re.sub(r"T(\d\d:\d\d).*", r" \1", stamp)


def _written(path: Path) -> str:
    """Day and minute of a file's last change, UTC."""
    return f"{datetime.fromtimestamp(path.stat().st_mtime, UTC):%Y-%m-%d %H:%M}"


class _Head(HTMLParser):
    """Title and answer in the head of a page (`<title>` and the description); empty if they are absent."""

    title, answer = "", ""
    inside = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep the content of the description, and note whether a title begins."""
        named = dict(attrs)
        self.inside = tag == "title"
        if tag == "meta" and named.get("name") == "description":
            self.answer = (named.get("content") or "").strip()

    def handle_data(self, data: str) -> None:
        """Add text to the title while the parser is inside of it; all other text is passed over."""
        if self.inside:
            self.title += data.strip()


def _head(page: Path) -> _Head:
    """Title and answer of a page; only the text before its style sheet is parsed."""
    head = _Head()
    with contextlib.suppress(OSError):
        head.feed(page.read_text("utf-8", errors="replace").partition("<style>")[0])
    return head
