r"""Speed and accuracy against the seed's method and the integral model, measured in one run.

The task is that of Table 2: 20 equilibria of the paper's prototype, cable 1 drawn in with 10 to 200 N.  The engine
solves the 20 loads over and over in one call; the references solve them once, each load from the last solution.
All methods take turns, so that a busy machine disturbs all alike; times are medians over the rounds, ratios medians
of the ratios within a round.  Results are written and printed elsewhere.
"""

import json
import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from prb3r.markdown import markdown_table
from prb3r.mechanics.chain import Chain, Loads, loads, pose
from prb3r.mechanics.equilibrium import Outcome, solve
from prb3r.mechanics.plate import PlateModel, gauss_collocation, plate_model
from prb3r.mechanics.reference import integral_fsolve, seed_fsolve
from prb3r.mechanics.sensitivity import direction, sensitivities
from prb3r.runs.provenance import git_state

TENSIONS = np.linspace(10, 200, 20)
"""Table 2, N."""
TIP_LOAD = (0.0, -5.0)
"""N."""
CONVERGED_POINTS = 6
"""Gauss points per plate of the elastica that counts as exact."""
PRESLIDING = 3e-5
"""Of the loading history, m."""
ENGINE, ELASTICA, TIP = "engine, PRB 3R", "engine, elastica", "engine, PRB 3R, tip load 5 N"
HISTORY = "engine, PRB 3R, mu 0.3, loading history"
SEED, INTEGRAL = "reference: fsolve on Eq. 12", "reference: integral model"
PLATES = (14, 140, 1400)
PARAMETERS = 10
"""Of the Jacobians that are timed against as many solves."""
LOOP = np.outer([100, 60, 80, 20], [1.0, 0, 0, 0]) + np.outer([0, 0, 40, 70], [0, 0, 1.0, 0])
"""Tensions of a loading history, N: cable 1 let go and pulled again, then cable 3."""
LINEAR = 1.25
"""Growth counts as linear as long as a plate of a long chain costs no more than this many plates of the short one."""


@dataclass(frozen=True)
class Bench:
    """What one run measured."""

    machine: dict[str, Any]
    """Machine, versions and revision."""
    methods: pd.DataFrame
    """One row a method: time of the 20 equilibria of Table 2, ratio to the engine, tip error."""
    scaling: pd.DataFrame
    """One row a number of plates, with and without a tip load."""
    goals: pd.DataFrame
    """One row a goal: what was asked, what was measured, whether it was met."""


class Task(NamedTuple):
    """Something to time: `run` solves `equilibria` equilibria and returns the centres of the tip disk, m."""

    name: str
    equilibria: int
    run: Callable[[], np.ndarray]


def prototype(plate: PlateModel, mu: float = 0.0, finer: int = 1) -> Chain:
    """The paper's prototype (Table 3, Section IV) with E = 187 GPa; `finer` divides each of its 14 plates and disks."""
    plates, arc, bending = 14 * finer, 0.014 / finer, 187e9 * 0.030 * 0.0008**3 / 12
    return Chain(
        plate=plate,
        arc=np.full(plates, arc),
        clamp=np.full(plates, 0.008 / finer),
        disk=0.004 / finer,
        stiffness=np.tile(bending / arc * plate.stiffness, (plates, 1)),
        rest=np.zeros((plates, len(plate.stiffness))),
        offset=np.tile([0.0255, 0.021, -0.021, -0.0255], (plates, 1)),
        reach=np.array([2, 1, 1, 2]) * plates // 2,
        friction=np.full((plates, 4), mu),
        segment=np.repeat([0, 1], plates // 2),
    )


def table_2(chain: Chain, times: int = 1, tip: tuple[float, float] = (0.0, 0.0)) -> Loads:
    """The loads of Table 2, `times` over, optionally with a tip load (N)."""
    return loads(chain, np.tile(TENSIONS, times)[:, None] * [1.0, 0, 0, 0], tip=tip)


def reversals(chain: Chain) -> Loads:
    """40 steps in which cables 1 and 3 are drawn in and let go again and again, out of step with each other."""
    step, tension = np.arange(1, 41), np.zeros((40, 4))
    tension[:, 0] = 50 + 50 * np.sin(2 * np.pi * step / 16)
    tension[:, 2] = 40 * np.abs(np.sin(2 * np.pi * step / 23))
    return loads(chain, tension)


def measure(equilibria: int = 4000, rounds: int = 7, plates: tuple[int, ...] = PLATES) -> Bench:
    """Measure everything, `rounds` times.

    Parameters
    ----------
    equilibria : solved by the engine in one call; a chain ten times as long solves a tenth of them.
    rounds : repetitions of every task.
    plates : lengths of chains for the scaling, multiples of 14, shortest first.
    """
    with threadpool_limits(1):
        tasks, errors = zip(*_methods(max(1, equilibria // 20)), strict=True)
        chains = [_scaled(number, tip, equilibria) for number in plates for tip in ((0.0, 0.0), TIP_LOAD)]
        jacobians = list(_jacobians(max(1, equilibria // 400)))
        seconds = _take_turns([*tasks, *chains, *jacobians], rounds)
    methods = _methods_table(tasks, errors, seconds[:, : len(tasks)])
    scaling = _scaling_table(plates, chains, seconds[:, len(tasks) : len(tasks) + len(chains)])
    each = seconds[:, len(tasks) + len(chains) :]
    shares = np.median(each[:, 1::2] / (PARAMETERS * each[:, ::2]), axis=0)
    named = {task.name: share for task, share in zip(jacobians[1::2], shares, strict=True)}
    return Bench(_machine(rounds), methods, scaling, _goals(methods, scaling, named))


def _engine(name: str, chain: Chain, steps: Loads) -> Task:
    def run() -> np.ndarray:
        states = solve(chain, steps, detail=False)
        if (states.outcome != Outcome.CONVERGED).any():
            raise RuntimeError(f"{name}: not all equilibria were found")
        return states.x[:, -1] + 1j * states.y[:, -1]

    return Task(name, steps.steps, run)


def _methods(times: int):
    """Tasks with their tip errors in % of length, against the elastica under the same loads."""
    springs, elastica = plate_model("prb3r"), gauss_collocation()
    exact_plate = gauss_collocation(CONVERGED_POINTS)
    bare = prototype(springs)
    cases = [
        (ENGINE, bare, (0.0, 0.0)),
        (ELASTICA, prototype(elastica), (0.0, 0.0)),
        ("engine, PRB 3R, mu 0.3", prototype(springs, 0.3), (0.0, 0.0)),
        ("engine, elastica, mu 0.3", prototype(elastica, 0.3), (0.0, 0.0)),
        (TIP, bare, TIP_LOAD),
        ("engine, elastica, tip load 5 N", prototype(elastica), TIP_LOAD),
        ("engine, constant curvature", prototype(elastica)._replace(tied=True), (0.0, 0.0)),
    ]

    def error(task: Task, mu: float = 0.0, tip: tuple[float, float] = (0.0, 0.0)) -> float:
        exact = prototype(exact_plate, mu)
        converged = _engine("converged elastica", exact, table_2(exact, tip=tip)).run()
        return float(100 * np.abs(task.run()[:20] - converged).max() / exact.length)

    for name, chain, tip in cases:
        task = _engine(name, chain, table_2(chain, times, tip))
        yield task, error(task, float(chain.friction[0, 0]), tip)
    for name, plate in ((HISTORY, springs), ("engine, elastica, mu 0.3, loading history", elastica)):
        chain, exact = (prototype(p, 0.3)._replace(presliding=PRESLIDING) for p in (plate, exact_plate))
        task = _engine(name, chain, reversals(chain))
        converged = _engine("converged elastica", exact, reversals(exact)).run()
        yield task, float(100 * np.abs(task.run() - converged).max() / exact.length)
    once = table_2(bare)

    def by_seed() -> np.ndarray:
        shape = pose(bare, seed_fsolve(bare, once)[0])
        return shape.x[:, -1] + 1j * shape.y[:, -1]

    def by_integrals() -> np.ndarray:
        shape = integral_fsolve(bare, once)[1]
        return shape.x[:, -1] + 1j * shape.y[:, -1]

    for task in (Task(SEED, 20, by_seed), Task(INTEGRAL, 20, by_integrals)):
        yield task, error(task)


def _scaled(plates: int, tip: tuple[float, float], equilibria: int) -> Task:
    """Finer and finer parts of the same rod: the bend under each load stays the same."""
    finer, name = plates // 14, "tip load 5 N" if any(tip) else "no dead load"
    chain = prototype(plate_model("prb3r"), finer=finer)
    task = _engine(name, chain, table_2(chain, max(1, equilibria // 20 // finer), tip))
    task.run()  # fills caches
    return task


def _jacobians(times: int):
    """A solve and a Jacobian by turns."""
    bare = prototype(plate_model("prb3r"), 0.3)
    history = bare._replace(presliding=3e-5)
    cases = [
        ("no dead load", bare, table_2(bare, times)),
        ("tip load 5 N", bare, table_2(bare, times, TIP_LOAD)),
        ("history", history, loads(history, LOOP)),
    ]
    for name, chain, steps in cases:
        few = [
            lambda v, c=chain, s=steps: (c._replace(stiffness=v * c.stiffness), s),
            lambda v, c=chain, s=steps: (c._replace(friction=v * c.friction), s),
            lambda v, c=chain, s=steps: (c._replace(offset=v * c.offset), s),
            lambda v, c=chain, s=steps: (c._replace(rest=c.rest + v - 1), s),
            lambda v, c=chain, s=steps: (c, s._replace(tension=v * s.tension)),
        ]
        directions = [direction(few[k % len(few)], 1.0, 1e-5) for k in range(PARAMETERS)]

        def solved(chain=chain, steps=steps) -> np.ndarray:
            return solve(chain, steps).x

        def differentiated(chain=chain, steps=steps, directions=directions) -> np.ndarray:
            return sensitivities(chain, steps, directions).dx

        for task in (Task(name, steps.steps, solved), Task(name, steps.steps, differentiated)):
            task.run()  # fills caches
            yield task


def _take_turns(tasks: list[Task], rounds: int) -> np.ndarray:
    """Seconds (rounds, tasks) per equilibrium."""
    seconds = np.empty((rounds, len(tasks)))
    for r in range(rounds):
        for t, task in enumerate(tasks):
            start = time.perf_counter()
            task.run()
            seconds[r, t] = (time.perf_counter() - start) / task.equilibria
    return seconds


def _methods_table(tasks, errors, seconds: np.ndarray) -> pd.DataFrame:
    each = np.median(seconds, axis=0)
    return pd.DataFrame(
        {
            "method": [task.name for task in tasks],
            "equilibria_per_call": [task.equilibria for task in tasks],
            "time_of_20_s": 20 * each,
            "time_each_s": each,
            "times_engine": np.median(seconds / seconds[:, :1], axis=0),
            "tip_error_percent": errors,
        }
    )


def _scaling_table(plates, chains, seconds: np.ndarray) -> pd.DataFrame:
    number = np.repeat(plates, 2)
    per_plate = seconds / number
    shortest = np.tile(per_plate[:, :2], len(plates))
    return pd.DataFrame(
        {
            "plates": number,
            "loads": [task.name for task in chains],
            "equilibria_per_call": [task.equilibria for task in chains],
            "time_each_s": np.median(seconds, axis=0),
            "time_per_plate_s": np.median(per_plate, axis=0),
            "per_plate_of_shortest": np.median(per_plate / shortest, axis=0),
        }
    )


def _goals(methods: pd.DataFrame, scaling: pd.DataFrame, jacobians: dict[str, float]) -> pd.DataFrame:
    by = methods.set_index("method")
    longest = scaling["plates"].max()
    growth = scaling.loc[scaling["plates"] == longest, "per_plate_of_shortest"].max()
    rows = [
        ("times faster than fsolve on Eq. 12", ">=", 400, by["times_engine"][SEED]),
        ("times faster than the integral model", ">=", 5000, by["times_engine"][INTEGRAL]),
        ("PRB 3R, 14 plates, us per equilibrium", "<=", 10, 1e6 * by["time_each_s"][ENGINE]),
        ("with a tip load, us per equilibrium", "<=", 60, 1e6 * by["time_each_s"][TIP]),
        ("40 steps of loading history with reversals, ms", "<=", 200, 40e3 * by["time_each_s"][HISTORY]),
        ("elastica, times the time of PRB 3R", "<=", 2, by["times_engine"][ELASTICA]),
        ("elastica, tip error in % of length", "<=", 1e-4, by["tip_error_percent"][ELASTICA]),
        (f"a plate of {longest}, times one of {scaling['plates'].min()} (linear growth)", "<=", LINEAR, growth),
        *(
            (f"Jacobian by {PARAMETERS} parameters, {name}, of {PARAMETERS} solves", "<=", 1, share)
            for name, share in jacobians.items()
        ),
    ]
    table = pd.DataFrame(rows, columns=["goal", "relation", "asked", "measured"])
    at_least = table["relation"] == ">="
    table["met"] = np.where(at_least, table["measured"] >= table["asked"], table["measured"] <= table["asked"])
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


def markdown(result: Bench) -> str:
    """The whole result as a page of Markdown."""
    machine = result.machine
    git = machine["git"]
    revision = f"{git['revision'][:12]}{' with changes' if git['dirty'] else ''}" if git else "unknown"
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    methods, scaling, goals = (table.to_dict("records") for table in (result.methods, result.scaling, result.goals))
    return "\n".join(
        [
            "# Speed and accuracy",
            "",
            f"{machine['processor']}, {machine['system']}, one thread; {versions}; revision {revision}; "
            f"{machine['measured']}; medians of {machine['rounds']} interleaved rounds.",
            "",
            "20 equilibria of Table 2: cable 1 drawn in with 10 to 200 N, 14 plates, no friction unless said; loading "
            f"history: 40 steps of cables 1 and 3 with reversals, presliding {1e6 * PRESLIDING:g} um, for 20 of them.  "
            f"Errors are against an elastica with {CONVERGED_POINTS} Gauss points per plate under the same loads.",
            "",
            *markdown_table(
                ("method", "20 equilibria, ms", "each, us", "times engine", "largest tip error, % of length"),
                (
                    (
                        row["method"],
                        f"{1e3 * row['time_of_20_s']:.3g}",
                        f"{1e6 * row['time_each_s']:.3g}",
                        _plain(row["times_engine"]),
                        f"{row['tip_error_percent']:.2g}",
                    )
                    for row in methods
                ),
            ),
            "",
            "The same rod in ever more plates:",
            "",
            *markdown_table(
                ("plates", "loads", "each, us", "per plate, us", "of the shortest chain's"),
                (
                    (
                        str(row["plates"]),
                        row["loads"],
                        _plain(1e6 * row["time_each_s"]),
                        f"{1e6 * row['time_per_plate_s']:.3g}",
                        f"{row['per_plate_of_shortest']:.2f}",
                    )
                    for row in scaling
                ),
            ),
            "",
            *markdown_table(
                ("goal", "asked", "measured", ""),
                (
                    (
                        row["goal"],
                        f"{row['relation']} {row['asked']:g}",
                        _plain(row["measured"]),
                        "met" if row["met"] else "**missed**",
                    )
                    for row in goals
                ),
            ),
            "",
        ]
    )


def to_json(result: Bench) -> str:
    """The whole result as JSON: `machine`, `methods`, `scaling`, `goals`."""
    tables = {name: getattr(result, name).to_dict("records") for name in ("methods", "scaling", "goals")}
    return json.dumps({"machine": result.machine, **tables}, indent=2)


def _plain(number: float) -> str:
    """Three digits without an exponent; small numbers keep theirs."""
    return f"{number:,.0f}" if number >= 100 else f"{number:.3g}"
