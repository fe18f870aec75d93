r"""Speed and accuracy against the seed's method and the integral model, measured in one run.

The task is that of Table 2: 20 equilibria of the paper's prototype, cable 1 drawn in with 10 to 200 N.  The engine
solves the 20 loads over and over in one call; the references solve them once.  Times are medians over the rounds,
ratios medians of the ratios within a round.
"""

import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from prb3r.bench.arithmetic import arithmetic_table, operation_counts, peak_table, peak_tasks
from prb3r.bench.commands import command_tables, compilation
from prb3r.bench.diagnosis import diagnosis_goals, diagnosis_table
from prb3r.bench.jacobians import jacobian_table, jacobian_tasks
from prb3r.bench.methods import (
    ELASTICA_ENGINE,
    FSOLVE,
    HISTORY_ENGINE,
    INTEGRAL,
    PRB_ENGINE,
    SIDE_BY_SIDE,
    TIP_ENGINE,
    method_table,
    method_tasks,
)
from prb3r.bench.paths import growth_table, growth_tasks, path_table, path_tasks
from prb3r.bench.prototype import seconds_in_turns
from prb3r.bench.scaling import LENGTHS, LINEAR_GROWTH, scaling_table, scaling_tasks
from prb3r.runs.provenance import git_state

MOST_TIMES_KERNEL = 4.0
"""Goal: an equilibrium costs at most this many times what it does in the kernel, whatever interface is used."""


@dataclass(frozen=True)
class Measured:
    """Results of one run of the benchmark."""

    machine: dict[str, Any]
    """Processor, system, versions, git revision, date, and number of rounds and threads."""
    methods: pd.DataFrame
    """One row a method: time of the 20 equilibria of Table 2, ratio to the engine (PRB 3R), tip error."""
    scaling: pd.DataFrame
    """One row for each number of plates, with and without a tip load: time of an equilibrium and of a plate."""
    jacobians: pd.DataFrame
    """One row a kind of load: the time of a Jacobian over that of as many solves."""
    paths: pd.DataFrame
    """One row an interface (Python function or command): the time of an equilibrium over that in the kernel."""
    growth: pd.DataFrame
    """One row for each number of segments, cables or cases: time of an equilibrium over that of the first number."""
    arithmetic: pd.DataFrame
    """One row a method: operations of an equilibrium, their rate, and its shares of the machine's peaks."""
    peaks: pd.DataFrame
    """One row a kind of multiply-adds: the peak of the machine, operations per second."""
    commands: pd.DataFrame | None
    """One row for each command, number of configurations and workers: its cost; None if no command was run."""
    compilation: dict[str, float] | None
    """Processor and clock time, s, that compiling takes with an empty cache; None if no command was run."""
    diagnosis: pd.DataFrame | None
    """One row a recording: the time of its diagnosis; None if none was diagnosed."""
    goals: pd.DataFrame
    """One row a goal: what was asked, what was measured, their ratio, whether it was met."""


def measure(
    equilibria: int = 4000,
    rounds: int = 7,
    lengths: Sequence[int] = LENGTHS,
    designs: int = 0,
    commands: int = 0,
    say: Callable[[str], None] = lambda text: None,
) -> Measured:
    """Measure everything, `rounds` times.

    Parameters
    ----------
    equilibria : solved by the engine in one call; a chain ten times as long solves a tenth of them.
    rounds : repetitions of every task but the commands and the diagnoses.
    lengths : plates of the chains for the scaling, multiples of 14, shortest first.
    designs : recordings to diagnose for each kind of friction, minutes each.
    commands : rounds of whole commands, each in a process of its own, a minute each.
    say : hears which command or diagnosis is under way.
    """
    with threadpool_limits(1):
        methods, errors = zip(*method_tasks(max(1, equilibria // 20)), strict=True)
        chains = scaling_tasks(lengths, equilibria)
        jacobians = list(jacobian_tasks(max(1, equilibria // 400)))
        ways, numbers = path_tasks(5 * equilibria // 2, max(1, equilibria // 40)), growth_tasks(equilibria)
        peaks = peak_tasks()
        kinds = [methods, chains, jacobians, ways, numbers, peaks]
        seconds = seconds_in_turns([task for kind in kinds for task in kind], rounds)
    parts = np.split(seconds, np.cumsum([len(kind) for kind in kinds])[:-1], axis=1)
    by_method = method_table(methods, errors, parts[0])
    by_length = scaling_table(lengths, chains, parts[1])
    by_load = jacobian_table(jacobians, parts[2])
    by_way, by_number = path_table(ways, parts[3]), growth_table(numbers, parts[4], equilibria)
    arithmetic, most = arithmetic_table(operation_counts(), methods, parts[0], parts[5]), peak_table(peaks, parts[5])
    run, compiled = None, None
    if commands:
        say("compiling with an empty cache")
        compiled = compilation()
        run, ratios = command_tables(commands, say)
        by_way = pd.concat([by_way, ratios], ignore_index=True)
    diagnosed = diagnosis_table(designs, say) if designs else None
    goals = _goals(by_method, by_length, by_load, by_way, diagnosed)
    tables = (by_method, by_length, by_load, by_way, by_number, arithmetic, most, run, compiled, diagnosed, goals)
    return Measured(_machine(rounds), *tables)


def _goals(
    methods: pd.DataFrame,
    scaling: pd.DataFrame,
    jacobians: pd.DataFrame,
    ways: pd.DataFrame,
    diagnosed: pd.DataFrame | None,
) -> pd.DataFrame:
    """The goals and what was measured of them, the table `Measured.goals`; ratios first, as they depend on the machine
    least."""
    by = methods.set_index("method")
    longest = scaling["plates"].max()
    growth = scaling.loc[scaling["plates"] == longest, "per_plate_of_shortest"].max()
    rows = [
        ("times faster than fsolve on Eq. 12", ">=", 400, by["times_engine"][FSOLVE]),
        ("times faster than the integral model", ">=", 5000, by["times_engine"][INTEGRAL]),
        ("elastica, times the time of PRB 3R", "<=", 2, by["times_engine"][ELASTICA_ENGINE]),
        (f"a plate of {longest}, times one of {scaling['plates'].min()} (linear growth)", "<=", LINEAR_GROWTH, growth),
        *(
            (f"Jacobian by {row.parameters} parameters, {row.loads}, of as many solves", "<=", 1, row.of_as_many_solves)
            for row in jacobians.itertuples()
        ),
        *((f"{way.path}, times the kernel", "<=", MOST_TIMES_KERNEL, way.times_kernel) for way in ways.itertuples()),
        *(("two workers, times as fast as one", ">=", 1.8, way.two_workers) for way in ways.itertuples() if _told(way)),
        ("elastica, tip error in % of length", "<=", 1e-4, by["tip_error_percent"][ELASTICA_ENGINE]),
        ("PRB 3R, 14 plates, us per equilibrium", "<=", 10, 1e6 * by["time_each_s"][PRB_ENGINE]),
        *(
            (f"{name.removeprefix('engine, ')}, us per equilibrium", "<=", asked, 1e6 * by["time_each_s"][name])
            for name, asked in zip(SIDE_BY_SIDE, (2, 3), strict=True)
        ),
        ("with a tip load, us per equilibrium", "<=", 60, 1e6 * by["time_each_s"][TIP_ENGINE]),
        ("loading history with reversals, us per step", "<=", 300, 1e6 * by["time_each_s"][HISTORY_ENGINE]),
        *(diagnosis_goals(diagnosed) if diagnosed is not None else ()),
    ]
    table = pd.DataFrame(rows, columns=["goal", "relation", "asked", "measured"])
    at_least = table["relation"] == ">="
    table["of_asked"] = table["measured"] / table["asked"]
    table["met"] = np.where(at_least, table["of_asked"] >= 1, table["of_asked"] <= 1)
    return table


def _told(way: Any) -> bool:
    """Whether an interface was timed with two workers too."""
    return bool(np.isfinite(getattr(way, "two_workers", np.nan)))


def _machine(rounds: int) -> dict[str, Any]:
    packages = ("prb3r", "numpy", "scipy", "numba")
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "versions": {"python": platform.python_version()} | {name: metadata.version(name) for name in packages},
        "git": git_state(Path(__file__).parent),
        "measured": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "rounds": rounds,
        "threads": 1,
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown")
