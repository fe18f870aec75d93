"""Provenance of results: versions, git revision, platform, hash of the program text; and the manifest of a run."""

import hashlib
import json
import os
import platform
import subprocess
import time
from importlib import metadata
from pathlib import Path
from typing import Any

from prb3r.runs.files import write_whole

MANIFEST = "manifest.json"
PACKAGE = Path(__file__).parents[1]
KINDS = {"study": dict, "manipulator": dict, "run": dict, "timing": list, "key": str, "engine": str, "file": str}
"""Entries of a manifest that later runs read, and the type that each must have."""
STUDY_ROOMS = ("inverse", "mechanics", "model", "runs", "study")
"""Sub-packages whose program text is hashed into the keys of the results of a study."""
PACKAGES = ("prb3r", "numpy", "scipy", "numba", "pandas", "pyarrow", "joblib", "pydantic", "matplotlib")


def environment(spec: Path) -> dict[str, Any]:
    """Entries of a manifest: name of the file `spec`, versions of packages, platform, git revision, current time."""
    return {
        "spec": spec.name,
        "versions": {name: metadata.version(name) for name in PACKAGES} | {"python": platform.python_version()},
        "platform": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "git": git_state(Path(__file__).parent),
        "written": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def git_state(folder: Path) -> dict[str, Any] | None:
    """Git revision of the checkout around `folder` and whether it has uncommitted changes; None outside a checkout."""

    def git(*words: str) -> str:
        return subprocess.run(
            ["git", *words], cwd=folder, capture_output=True, text=True, check=True, timeout=10
        ).stdout

    try:
        return {"revision": git("rev-parse", "HEAD").strip(), "dirty": bool(git("status", "--porcelain").strip())}
    except (OSError, subprocess.SubprocessError):
        return None


def fingerprint(*more: str) -> str:
    """Hash of the program text of `STUDY_ROOMS` and of `more` sub-packages: 16 hexadecimal digits."""
    return text_hash(*(PACKAGE / room for room in (*STUDY_ROOMS, *more)))


def text_hash(*folders: Path) -> str:
    """Hash of the relative paths and the text of all Python files below some folders: 16 hexadecimal digits."""
    sources = {path.relative_to(folder.parent).as_posix(): path for folder in folders for path in folder.rglob("*.py")}
    content = b"\0".join(place.encode() + b"\0" + sources[place].read_bytes() for place in sorted(sources))
    return hashlib.sha256(content).hexdigest()[:16]


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """The manifest of an earlier run; None if there is none or it is damaged.

    Entries of another type than a run writes are left out.
    """
    try:
        manifest = json.loads((folder / MANIFEST).read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(manifest, dict):
        return None
    return {name: part for name, part in manifest.items() if isinstance(part, KINDS.get(name, object))}


def write_manifest(folder: Path, manifest: dict[str, Any]) -> None:
    """Write the manifest into `folder`, whole or not at all; raises what `write_whole` raises."""
    write_whole(folder / MANIFEST, (json.dumps(manifest, indent=1, default=str) + "\n").encode())
