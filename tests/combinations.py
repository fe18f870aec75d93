"""`make combinations`: the suite under every Python that is here, with the newest and the oldest dependencies allowed.

Says which combinations were run, with which versions, and what they gave: a table as Markdown, on stdout and in
`results/combinations.md`.  What cannot be installed is told with the reason, and no reason to stop.
"""

import argparse
import contextlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PROJECT = ROOT / "pyproject.toml"
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
ENDS = ("newest", "oldest")
TOLD = ("numpy", "scipy", "numba", "pandas", "pyarrow", "pydantic", "matplotlib", "distributed")
"""Packages whose versions stand in the table."""
OLD_WARNINGS = ("-o", "filterwarnings=default")
"""Old libraries warn of their own newer dependencies."""


class Outcome(NamedTuple):
    """What came of a combination."""

    python: str
    dependencies: str
    versions: str
    gave: str

    @property
    def bad(self) -> bool:
        """Whether tests failed; what cannot be had here is not bad."""
        return "failed" in self.gave or "error" in self.gave


def oldest(requirement: str) -> str:
    """The series that a lower bound begins: `numpy>=2.1` allows `numpy==2.1.*` at the least."""
    name, _, bound = requirement.partition(">=")
    return f"{name}=={bound}.*"


def bounds(pyproject: Path) -> list[str]:
    """The dependencies of the project and of its development, without those on itself."""
    project = tomllib.loads(pyproject.read_text())["project"]
    optional = [name for names in project["optional-dependencies"].values() for name in names]
    return [name for name in [*project["dependencies"], *optional] if not name.startswith("prb3r")]


def combination(python: str, end: str, words: list[str], folder: Path) -> Outcome:
    """Install one combination in a folder of its own and run tests there."""
    interpreter = interpreter_of(python)
    if interpreter is None:
        return Outcome(python, end, "", "no such Python here")
    home, constraints = (folder / f"{python}-{end}").absolute(), (folder / f"{end}.txt").absolute()
    folder.mkdir(parents=True, exist_ok=True)
    constraints.write_text("\n".join(map(oldest, bounds(PROJECT))) if end == "oldest" else "")
    own = home / "bin/python"
    if reason := installed(interpreter, home, constraints):
        return Outcome(python, end, "", f"cannot be installed: {reason}")
    more = OLD_WARNINGS if end == "oldest" else ()
    begin = time.monotonic()
    done = subprocess.run(
        [str(own), "-m", "pytest", "-v", "-m", "", *more, *words],  # not as in pyproject.toml: all, counted
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "XDG_CACHE_HOME": str(home / "cache")},  # kernels of its own libraries
    )
    lines = done.stdout.strip().splitlines() or [f"error: {_reason(done.stderr)}"]
    (folder / f"{python}-{end}.log").write_text(done.stdout + done.stderr)
    end_line = re.sub(r"\s*in [\d.]+s.*", "", lines[-1].strip("= "))
    return Outcome(python, end, _versions(own), f"{end_line} ({(time.monotonic() - begin) / 60:.0f} min)")


def installed(interpreter: str, home: Path, constraints: Path) -> str:
    """Make an environment in the folder `home` unless it is there whole; what keeps it from being made, or nothing."""
    own, whole = home / "bin/python", home / ".whole"
    commands = (
        [interpreter, "-m", "venv", home],
        [own, "-m", "pip", "install", "-q", "--only-binary=:all:", "-c", constraints, *bounds(PROJECT)],
        [own, "-m", "pip", "install", "-q", "--no-deps", "-e", ROOT],
    )
    for command in () if whole.exists() else commands:
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
        if done.returncode:
            return _reason(done.stderr)
    whole.touch()
    return ""


def interpreter_of(python: str) -> str | None:
    """A Python of that version that runs, on the path or among those of pyenv."""
    found = sorted(Path.home().glob(f".pyenv/versions/{python}.*/bin/python"))
    for candidate in filter(None, [shutil.which(f"python{python}"), *map(str, found)]):
        said = subprocess.run([candidate, "--version"], capture_output=True, text=True).stdout
        if said.startswith(f"Python {python}."):
            return candidate
    return None


def _versions(python: Path) -> str:
    code = f"from importlib.metadata import version\nfor n in {TOLD!r}: print(n, version(n))"
    return ", ".join(subprocess.run([str(python), "-c", code], capture_output=True, text=True).stdout.splitlines())


def _reason(said: str) -> str:
    errors = [line for line in said.splitlines() if "error" in line.lower()]
    return (errors or said.strip().splitlines() or ["no reason given"])[-1].removeprefix("ERROR: ")


def table(outcomes: list[Outcome]) -> Iterator[str]:
    """The outcomes as Markdown."""
    yield "| Python | dependencies | versions | tests |"
    yield "|---|---|---|---|"
    yield from (f"| {o.python} | {o.dependencies} | {o.versions} | {o.gave} |" for o in outcomes)


def main() -> int:
    """Run what is asked for; the number of combinations whose tests failed."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--python", action="append", choices=PYTHONS, help="these alone; may be repeated")
    asked.add_argument("--dependencies", action="append", choices=ENDS)
    asked.add_argument("-o", "--output", default=ROOT / "results/combinations.md", type=Path)
    asked.add_argument("--keep", type=Path, help="folder that keeps what is installed for the next time")
    asked.add_argument("tests", nargs="*", help="words for pytest, after -- [default: the whole suite]")
    given = asked.parse_args()
    outcomes = []
    with contextlib.nullcontext(given.keep) if given.keep else tempfile.TemporaryDirectory() as folder:
        for python in given.python or PYTHONS:
            for end in given.dependencies or ENDS:
                outcomes.append(combination(python, end, given.tests, Path(folder)))
                print(f"{python}, {end}: {outcomes[-1].gave}", file=sys.stderr, flush=True)
                given.output.parent.mkdir(parents=True, exist_ok=True)
                given.output.write_text("\n".join([*table(outcomes), ""]))
    print("\n".join(table(outcomes)))
    return sum(outcome.bad for outcome in outcomes)


if __name__ == "__main__":
    sys.exit(main() > 0)
