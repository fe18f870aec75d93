"""Figures and report of a study that stand beside its tables already: what is unchanged is not made again."""

import hashlib
import json
import os
import sys
from pathlib import Path
from typing import Any

from prb3r.runs.files import write_json
from prb3r.runs.provenance import PACKAGE, text_hash
from prb3r.study.run import Result

RECORD = ".published.json"
"""In the folder of results: from what its figures and its report were made, and the hash of each file."""
OF_THE_RUN = ("written", "changed")
"""Parts of a manifest that differ from run to run and ask for no new report."""


def publish_what_changed(result: Result) -> list[Path]:
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


def _made_from(result: Result) -> str:
    told = {name: part for name, part in result.manifest.items() if name not in OF_THE_RUN}
    pages = {path.name: _hash(path) for path in sorted((PACKAGE / "present" / "templates").iterdir())}
    content = json.dumps([told, pages, text_hash(PACKAGE), _own_style()], sort_keys=True, default=str)
    return hashlib.sha256(content.encode()).hexdigest()


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
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return []
    return [folder / name for name in files] if whole else []


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
