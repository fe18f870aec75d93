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

from prb3r.bench.diagnosis import diagnosis_goals, diagnosis_table
from prb3r.bench.jacobians import jacobian_table, jacobian_tasks
from prb3r.bench.methods import (
    ELASTICA_ENGINE,
    FSOLVE,
    HISTORY_ENGINE,
    INTEGRAL,
    PRB_ENGINE,
    TIP_ENGINE,
    method_table,
    method_tasks,
)
from prb3r.bench.prototype import seconds_in_turns
from prb3r.bench.scaling import LENGTHS, LINEAR_GROWTH, scaling_table, scaling_tasks
from prb3r.runs.provenance import git_state


@dataclass(frozen=True)
class Measured:
    """What one run measured: machine, versions and revision, and tables."""

    machine: dict[str, Any]
    methods: pd.DataFrame
    """One row a method: time of the 20 equilibria of Table 2, ratio to the engine, tip error."""
    scaling: pd.DataFrame
    """One row a number of plates, with and without a tip load."""
    jacobians: pd.DataFrame
    """One row a kind of load: the time of a Jacobian over that of as many solves."""
    diagnosis: pd.DataFrame | None
    """One row a recording, if any was diagnosed."""
    goals: pd.DataFrame
    """One row a goal: what was asked, what was measured, their ratio, whether it was met."""


def measure(
    equilibria: int = 4000,
    rounds: int = 7,
    lengths: Sequence[int] = LENGTHS,
    designs: int = 0,
    say: Callable[[str], None] = lambda text: None,
) -> Measured:
    """Measure everything, `rounds` times.

    Parameters
    ----------
    equilibria : solved by the engine in one call; a chain ten times as long solves a tenth of them.
    rounds : repetitions of every task but the diagnoses.
    lengths : plates of the chains for the scaling, multiples of 14, shortest first.
    designs : recordings to diagnose for each kind of friction, minutes each.
    say : hears which diagnosis is under way.
    """
    with threadpool_limits(1):
        methods, errors = zip(*method_tasks(max(1, equilibria // 20)), strict=True)
        chains = scaling_tasks(lengths, equilibria)
        jacobians = list(jacobian_tasks(max(1, equilibria // 400)))
        seconds = seconds_in_turns([*methods, *chains, *jacobians], rounds)
    parts = np.split(seconds, np.cumsum([len(methods), len(chains)]), axis=1)
    by_method = method_table(methods, errors, parts[0])
    by_length = scaling_table(lengths, chains, parts[1])
    by_load = jacobian_table(jacobians, parts[2])
    diagnosed = diagnosis_table(designs, say) if designs else None
    goals = _goals(by_method, by_length, by_load, diagnosed)
    return Measured(_machine(rounds), by_method, by_length, by_load, diagnosed, goals)


def _goals(
    methods: pd.DataFrame, scaling: pd.DataFrame, jacobians: pd.DataFrame, diagnosed: pd.DataFrame | None
) -> pd.DataFrame:
    """Ratios first, as they depend on the machine least."""
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
        ("elastica, tip error in % of length", "<=", 1e-4, by["tip_error_percent"][ELASTICA_ENGINE]),
        ("PRB 3R, 14 plates, us per equilibrium", "<=", 10, 1e6 * by["time_each_s"][PRB_ENGINE]),
        ("with a tip load, us per equilibrium", "<=", 60, 1e6 * by["time_each_s"][TIP_ENGINE]),
        ("loading history with reversals, us per step", "<=", 300, 1e6 * by["time_each_s"][HISTORY_ENGINE]),
        *(diagnosis_goals(diagnosed) if diagnosed is not None else ()),
    ]
    table = pd.DataFrame(rows, columns=["goal", "relation", "asked", "measured"])
    at_least = table["relation"] == ">="
    table["of_asked"] = table["measured"] / table["asked"]
    table["met"] = np.where(at_least, table["of_asked"] >= 1, table["of_asked"] <= 1)
    return table


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
