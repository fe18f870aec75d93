"""Results that stand already: what is unchanged is not made again.

Figures and report are made anew if they were made from something else; of a study of which nothing at all has changed,
neither its file, its results nor the program, the last run's closing words are told again, and little is loaded for it.
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
"""In the folder of results: from what its figures and its report were made, and the hash of each file."""
ENDED = ".ended.json"
"""Beside it: how the last run of the command ended, with the hash of every file that it read and of those it left."""
OF_THE_RUN = ("written", "changed")
"""Parts of a manifest that differ from run to run and ask for no new report."""
UNREADABLE = (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError)
"""What reading a record leads to that is not there, damaged or edited by hand."""


@dataclass(frozen=True)
class Ended:
    """What a run of a study closed with."""

    said: str
    failed: bool
    """Whether a case had no stable equilibrium."""


def record_end(result: "Result", ended: Ended) -> None:
    """Write into the folder of results how a run ended, with hashes of what it read and left there: by these
    :func:`still_standing` knows whether another run would come to the same."""
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
    """How the last run of a study file into a folder ended, if another run would come to the same; else None."""
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
    """Figures and report of a study, made anew unless all of them are there, whole and from the same; their files.

    They are made from the manifest, whose key stands for the tables, by the text of the program and of its pages.

    Raises
    ------
    SpecError
        For plots that cannot be drawn from the tables, after everything else has been written.
    """
    made_from = _made_from(result)
    if files := _standing(result.folder, made_from):
        return files
    from prb3r.present.study.publish import publish  # loads matplotlib

    (result.folder / RECORD).unlink(missing_ok=True)
    files = publish(result)
    record = {"made_from": made_from, "files": {path.name: _hash(path) for path in files}}
    write_json(result.folder / RECORD, record)
    return files


def _made_from(result: "Result") -> str:
    told = {name: part for name, part in result.manifest.items() if name not in OF_THE_RUN}
    return _digest([told, _pages(), text_hash(PACKAGE), _own_style()])


def _under(path: Path) -> str:
    """What decides, beside the files of a study, what a run of it comes to."""
    told = {name: part for name, part in environment(path).items() if name not in OF_THE_RUN}
    return _digest([told, _pages(), text_hash(PACKAGE), _own_style()])


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()


def _pages() -> dict[str, str]:
    return {path.name: _hash(path) for path in sorted((PACKAGE / "present" / "templates").iterdir())}


def _visible(folder: Path) -> list[Path]:
    """The files of results in a folder, without the records of the program."""
    return [path for path in sorted(folder.iterdir()) if path.is_file() and not path.name.startswith(".")]


def _hashes(paths: Iterable[Path], folder: Path) -> dict[str, str]:
    """Hash of each file by its way from the folder."""
    return {os.path.relpath(path, folder): _hash(path) for path in paths}


def _own_style() -> list[Any]:
    """What the user says of the looks of figures: `matplotlibrc` files, and settings changed in this process.

    Matplotlib is not loaded for it, which takes longer than all else that an unchanged study needs.
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
    """The files on record, if they were made from the same and are as they were written; else none."""
    try:
        record: dict[str, Any] = json.loads((folder / RECORD).read_bytes())
        files: dict[str, str] = dict(record["files"]) if record["made_from"] == made_from else {}
        whole = all(_hash(folder / name) == known for name, known in files.items())
    except UNREADABLE:
        return []
    return [folder / name for name in files] if whole else []


def _hash(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
