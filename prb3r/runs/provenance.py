"""Under what a run was made: versions, revision, platform, the text of the program; and the manifest that says so."""

import hashlib
import json
import os
import platform
import subprocess
import time
from importlib import metadata
from pathlib import Path
from typing import Any

MANIFEST = "manifest.json"
PACKAGE = Path(__file__).parents[1]
PACKAGES = ("prb3r", "numpy", "scipy", "numba", "pandas", "pyarrow", "joblib", "pydantic", "matplotlib")


def environment(spec: Path) -> dict[str, Any]:
    """Versions, platform and git revision under which a study ran."""
    return {
        "spec": spec.name,
        "versions": {name: metadata.version(name) for name in PACKAGES} | {"python": platform.python_version()},
        "platform": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "git": git_state(Path(__file__).parent),
        "written": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def git_state(folder: Path) -> dict[str, Any] | None:
    """Revision of the program and whether it has uncommitted changes; None outside a checkout."""

    def git(*words: str) -> str:
        return subprocess.run(
            ["git", *words], cwd=folder, capture_output=True, text=True, check=True, timeout=10
        ).stdout

    try:
        return {"revision": git("rev-parse", "HEAD").strip(), "dirty": bool(git("status", "--porcelain").strip())}
    except (OSError, subprocess.SubprocessError):
        return None


def fingerprint(*more: str) -> str:
    """Hash of the program text that tables depend on, and of `more` parts of the package."""
    return text_hash(*(PACKAGE / part for part in ("mechanics", "model", "runs", "study", *more)))


def text_hash(*folders: Path) -> str:
    """Hash of the names and the text of all Python files in folders and their sub-folders."""
    sources = sorted(path for folder in folders for path in folder.rglob("*.py"))
    content = b"\0".join(source.name.encode() + b"\0" + source.read_bytes() for source in sources)
    return hashlib.sha256(content).hexdigest()[:16]


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """The manifest of an earlier run; None if there is none or it is damaged."""
    try:
        found = json.loads((folder / MANIFEST).read_text())
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def write_manifest(folder: Path, manifest: dict[str, Any]) -> None:
    """Write the manifest whole or not at all."""
    temporary = folder / f"{MANIFEST}.tmp"
    temporary.write_text(json.dumps(manifest, indent=1, default=str) + "\n")
    os.replace(temporary, folder / MANIFEST)
