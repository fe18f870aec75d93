"""Records in the folder of results by which figures, report and whole runs are not made again if nothing has changed.

Figures and report are made anew if anything that they are made from has changed.  If neither the files of a study, its
results nor the program have changed, a run only repeats the closing words of the last one, and loads few libraries.
"""

import hashlib
import json
import os
import sys
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from prb3r.runs.files import write_json
from prb3r.runs.provenance import PACKAGE, environment, text_hash

if TYPE_CHECKING:
    from prb3r.study.run import Result

RECORD = ".published.json"
"""File in the folder of results: a hash of what figures and report were made from, and the hash of each such file."""
ENDED = ".ended.json"
"""File beside it: how the last run ended, with the hashes of all files that it read and left."""
OF_THE_RUN = ("written", "changed")
"""Parts of a manifest that differ from run to run and ask for no new report."""
UNREADABLE = (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError)
"""Errors on reading a record that is missing, damaged or edited by hand."""


@dataclass(frozen=True)
class Ended:
    """How a run of a study ended."""

    said: str
    """Its closing words."""
    failed: bool
    """Whether a case failed."""
    broken: bool = False
    """Whether its page could not be made, for an error of the program."""


def record_end(result: "Result", ended: Ended) -> None:
    """Write `ENDED` into the folder of results: how a run ended, with hashes of the files that it read and left there.

    By these :func:`still_standing` knows whether another run would end in the same way.
    """
    plan, folder = result.plan, result.folder
    read = [plan.path, plan.path.parent / plan.study.manipulator]
    if plan.study.reach is not None and plan.study.reach.path is not None:
        read.append(plan.path.parent / plan.study.reach.path)
    record = {
        "as": [str(folder), os.path.relpath(plan.path, folder)],
        "under": _under(plan.path),
        "files": _hashes([*read, *_visible(folder)], folder),
        **vars(ended),
    }
    write_json(folder / ENDED, record)


def still_standing(path: str | Path, output: str | Path) -> Ended | None:
    """How the last run of the study file `path` into the folder `output` ended; None if anything has changed since."""
    try:
        folder = Path(output) / tomllib.loads(Path(path).read_text("utf-8-sig"))["name"]
        record = json.loads((folder / ENDED).read_bytes())
        known: dict[str, str] = dict(record["files"])
        there = {path.name for path in _visible(folder)}
        same = (
            record["as"] == [str(folder), os.path.relpath(path, folder)]
            and there <= known.keys()
            and _hashes((folder / name for name in known), folder) == known
            and record["under"] == _under(Path(path))
        )
        return Ended(str(record["said"]), bool(record["failed"])) if same else None
    except UNREADABLE:
        return None


def publish_what_changed(result: "Result") -> list[Path]:
    """Draw the figures and write the report of a study unless they stand already, unchanged; their files.

    They follow from the manifest, whose key stands for the tables, the text of the program and of its page templates,
    and the user's own style of matplotlib.

    Raises
    ------
    SpecError
        For plots that cannot be drawn from the tables, after everything else has been written.
    """
    made_from = _made_from(result)
    if files := _standing(result.folder, made_from):
        return files
    from prb3r.present.study.publish import publish  # loads pandas

    before = _written(result.folder)
    (result.folder / RECORD).unlink(missing_ok=True)
    files = publish(result)
    for name in before - {path.name for path in files}:
        (result.folder / name).unlink(missing_ok=True)  # of a plot that the study has no more
    record = {"made_from": made_from, "files": {path.name: _hash(path) for path in files}}
    write_json(result.folder / RECORD, record)
    return files


def _written(folder: Path) -> set[str]:
    """Names of the files in a folder that were written with the last figures and report; empty where no record says."""
    try:
        names = json.loads((folder / RECORD).read_bytes())["files"]
        return {name for name in names if Path(name).name == name}
    except UNREADABLE:
        return set()


def _made_from(result: "Result") -> str:
    """Hash of everything that figures and report are made from."""
    told = {name: part for name, part in result.manifest.items() if name not in OF_THE_RUN}
    return _digest([told, _pages(), text_hash(PACKAGE), _own_style()])


def _under(path: Path) -> str:
    """Hash of all that a run depends on beside the study's files: program, versions, platform, style of figures."""
    told = {name: part for name, part in environment(path).items() if name not in OF_THE_RUN}
    return _digest([told, _pages(), text_hash(PACKAGE), _own_style()])


def _digest(content: Any) -> str:
    """SHA-256 of plain data, in hexadecimal digits."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()


def _pages() -> dict[str, str]:
    """Hash of each template of a page."""
    return {path.name: _hash(path) for path in sorted((PACKAGE / "present" / "templates").iterdir())}


def _visible(folder: Path) -> list[Path]:
    """The files in a folder of results but hidden ones, which are records of the program."""
    return [path for path in sorted(folder.iterdir()) if path.is_file() and not path.name.startswith(".")]


def _hashes(paths: Iterable[Path], folder: Path) -> dict[str, str]:
    """Hash of each file by its path relative to `folder`."""
    return {os.path.relpath(path, folder): _hash(path) for path in paths}


def _own_style() -> list[Any]:
    """The user's own style of figures: hashes of `matplotlibrc` files, and settings changed in this process.

    Matplotlib is not loaded to find out, as that takes longer than all else that an unchanged study needs.
    """
    folders = [Path.home() / ".config" / "matplotlib", Path.home() / ".matplotlib"]
    folders += [Path(os.environ["XDG_CONFIG_HOME"]) / "matplotlib"] if os.environ.get("XDG_CONFIG_HOME") else []
    folders += [Path(os.environ[name]) for name in ("MATPLOTLIBRC", "MPLCONFIGDIR") if os.environ.get(name)]
    files = {file for folder in (Path(), *folders) for file in (folder, folder / "matplotlibrc")}
    said: list[Any] = sorted(_hash(file) for file in files if file.is_file())
    if loaded := sys.modules.get("matplotlib"):
        names = loaded.rcParams.keys() - {"backend"}
        said += sorted((n, str(loaded.rcParams[n])) for n in names if loaded.rcParams[n] != loaded.rcParamsOrig[n])
    return said


def _standing(folder: Path, made_from: str) -> list[Path]:
    """The recorded files of figures and report if they have the hash `made_from` and are as written; else none."""
    try:
        record: dict[str, Any] = json.loads((folder / RECORD).read_bytes())
        files: dict[str, str] = dict(record["files"]) if record["made_from"] == made_from else {}
        whole = all(_hash(folder / name) == known for name, known in files.items())
    except UNREADABLE:
        return []
    return [folder / name for name in files] if whole else []


def _hash(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
