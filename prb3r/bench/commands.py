"""Costs of whole commands, from files to files, in processes of their own: clock, processor time, memory, compilation.

Each command is run with few and with many configurations in turns; their difference gives the cost of one more.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from prb3r.bench.paths import kernel_in, pulls, wrist
from prb3r.model.files.toml import toml_text
from prb3r.model.manipulator import Manipulator

SOLVE_COMMAND, GRID_COMMAND, CLOUD_COMMAND = "solve, table to table", "study, grid of tensions", "study, cloud"
FEW_AND_MANY: Mapping[str, tuple[int, int]] = {
    SOLVE_COMMAND: (16_384, 147_456),
    GRID_COMMAND: (20_000, 200_000),
    CLOUD_COMMAND: (524_288, 2_097_152),
}
"""Configurations of each command, few and many: few are enough to start every worker, so that the difference contains
no start-up."""
KIB = 1 if sys.platform == "darwin" else 1024
"""Bytes in the unit of `ru_maxrss`."""
LAUNCHER = """
import resource, subprocess, sys
code = subprocess.call(sys.argv[1:])
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print()
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
sys.exit(code)
"""
"""Program that runs a command and prints its processor time (s) and peak memory (`ru_maxrss`).  It is small, as the
memory of the process that starts a command counts as the command's."""
STUDY = """name = "bench-{count}"
title = "bench"
manipulator = "wrist.toml"
"""
GRID = """
step = [{{ cable_1_n = 1, cable_3_n = 1 }}]
metric = [{{ kind = "position" }}]
[[factor]]
name = "one_n"
path = "step.1.cable_1_n"
linspace = {{ from = 1, to = 100, count = {count} }}
zip = "both"
[[factor]]
name = "three_n"
path = "step.1.cable_3_n"
linspace = {{ from = 40, to = 1, count = {count} }}
zip = "both"
"""
CLOUD = """states = "path"
state_disks = [14]
metric = [{{ kind = "workspace" }}]
plot = [{{ name = "reach", kind = "workspace" }}]
[cloud]
count = {count}
tension_n = {{ 1 = 100.0, 2 = 100.0, 3 = 100.0, 4 = 100.0 }}
"""


class Cost(NamedTuple):
    """Resources used by a process and the processes that it started."""

    cpu_s: float
    """Processor time of all of them together."""
    clock_s: float
    peak_mib: float
    """Peak resident memory of the largest of them."""


def command_tables(rounds: int, say: Callable[[str], None]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Costs of commands with few and many configurations, and the cost of one more; medians over `rounds`.

    The first table has `command, configurations, workers, cpu_s, clock_s, peak_mib`.  The second has a row for each
    command (`path`): `time_each_s`, the processor time of one more configuration, `times_kernel`, its ratio to an
    equilibrium in the kernel, and `two_workers`, how many times as fast two workers are as one.  `say` hears of rounds.
    """
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        _write_inputs(folder)
        rows: list[dict[str, Any]] = []
        kernel: list[float] = []
        for number, kernel_s in enumerate(kernel_in(rounds), 1):
            say(f"commands, round {number} of {rounds}")
            kernel.append(kernel_s)
            rows += [
                {"command": name, "configurations": count, "workers": workers, **cost._asdict(), "round": number}
                for name, counts in FEW_AND_MANY.items()
                for workers in ((1, 2) if name == CLOUD_COMMAND else (1,))
                for count in counts
                for cost in [cost_of(_words(name, count, workers), folder)]
            ]
    measured = pd.DataFrame(rows)
    told = measured.groupby(["command", "configurations", "workers"], sort=False, as_index=False)
    return told.median().drop(columns="round"), _ratios(measured, pd.Series(kernel, range(1, rounds + 1)))


def compilation() -> dict[str, float]:
    """Processor and clock time, s, that a first command with an empty cache of kernels takes more than a second one."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        _write_inputs(folder)
        words = _words(SOLVE_COMMAND, FEW_AND_MANY[SOLVE_COMMAND][0], 1)
        first, second = (cost_of(words, folder, XDG_CACHE_HOME=place) for _ in range(2))
    return {"cpu_s": first.cpu_s - second.cpu_s, "clock_s": first.clock_s - second.clock_s}


def cost_of(words: list[str], folder: Path, **environment: str) -> Cost:
    """The cost of the command `prb3r words...`, run in `folder` in a process of its own.

    Raises
    ------
    RuntimeError
        With the last line of its stderr, if it fails.
    """
    root = Path(__file__).parents[2]
    path = os.pathsep.join(filter(None, [str(root), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-m", "prb3r", *words]
    begin = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", LAUNCHER, *command],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
    )
    clock = time.perf_counter() - begin
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)}: {''.join(done.stderr.strip().splitlines()[-1:])}")
    cpu, peak = map(float, done.stdout.splitlines()[-1].split())
    return Cost(cpu, clock, peak * KIB / 2**20)


def _write_inputs(folder: Path) -> None:
    """Write the manipulator, the tables of steps and the study files of all commands."""
    rig = Manipulator.model_validate(wrist())
    (folder / "wrist.toml").write_text(toml_text(wrist()))
    for count in FEW_AND_MANY[SOLVE_COMMAND]:
        pd.DataFrame(pulls(rig, [1] * count)).to_parquet(folder / f"{count}.parquet")
    for name, text in ((GRID_COMMAND, GRID), (CLOUD_COMMAND, CLOUD)):
        for count in FEW_AND_MANY[name]:
            (folder / _study_file(name, count)).write_text((STUDY + text).format(count=count))


def _study_file(name: str, count: int) -> str:
    return f"{'grid' if name == GRID_COMMAND else 'cloud'}-{count}.toml"


def _words(name: str, count: int, workers: int) -> list[str]:
    """Arguments of `prb3r` for a command on `count` configurations."""
    if name == SOLVE_COMMAND:
        return ["solve", "wrist.toml", f"{count}.parquet", "-o", "out.parquet"]
    return ["run", _study_file(name, count), "-o", "results", "--fresh", "-j", str(workers)]


def _ratios(measured: pd.DataFrame, kernel: pd.Series) -> pd.DataFrame:
    """The second table of :func:`command_tables`; `kernel` holds s per equilibrium in the kernel by round."""
    by = measured.set_index(["command", "workers", "configurations", "round"]).sort_index()
    rows = []
    for name, (few, many) in FEW_AND_MANY.items():
        more = {
            workers: (by.loc[(name, workers, many)] - by.loc[(name, workers, few)]) / (many - few)
            for workers in measured.loc[measured["command"] == name, "workers"].unique()
        }
        two = (more[1]["clock_s"] / more[2]["clock_s"]).median() if 2 in more else float("nan")
        step_s = more[1]["cpu_s"]
        rows.append(
            {
                "path": name,
                "times_kernel": float((step_s / kernel).median()),
                "time_each_s": float(step_s.median()),
                "two_workers": float(two),
            }
        )
    return pd.DataFrame(rows)
