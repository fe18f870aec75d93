"""Results of the benchmark as a page of Markdown and as JSON."""

import json
from typing import Any

import pandas as pd

from prb3r.bench.counting import OPERATION_WEIGHTS
from prb3r.bench.measure import Measured
from prb3r.bench.methods import CONVERGED_POINTS
from prb3r.bench.prototype import PRESLIDING
from prb3r.markdown import markdown_table


def bench_page(result: Measured) -> str:
    """The whole result as a page of Markdown, goals first."""
    machine = result.machine
    git = machine["git"]
    revision = f"{git['revision'][:12]}{' with changes' if git['dirty'] else ''}" if git else "unknown"
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    lines = [
        "# Speed and accuracy",
        "",
        f"{machine['processor']}, {machine['system']}, one thread; {versions}; revision {revision}; "
        f"{machine['measured']}; medians of {machine['rounds']} interleaved rounds.",
        "",
        *_goals(result.goals),
        "",
        "20 equilibria of Table 2: cable 1 drawn in with 10 to 200 N, 14 plates, no friction unless said; loading "
        f"history: 40 steps of cables 1 and 3 with reversals, presliding {1e6 * PRESLIDING:g} um, for 20 of them.  "
        f"Errors are against an elastica with {CONVERGED_POINTS} Gauss points per plate under the same loads.",
        "",
        *_methods(result.methods),
        "",
        "The same rod in ever more plates:",
        "",
        *_scaling(result.scaling),
        "",
        "Jacobians against as many solves:",
        "",
        *_jacobians(result.jacobians),
        "",
        "The same equilibria by each way to them, friction 0.3, a processor's time; whole commands: what one more "
        "configuration takes, files included:",
        "",
        *_paths(result.paths),
        "",
        "One equilibrium of 14 plates in ever more segments, by ever more cables, and with ever fewer sequences in a "
        "call of `prb3r.solve`:",
        "",
        *_growth(result.growth),
        "",
        f"How far an equilibrium is from the arithmetic limit of the machine, in floating point operations as the "
        f"kernel's text does them: {_weights()}.  Multiply-adds that wait for nothing: {_peaks(result.peaks)}.",
        "",
        *_arithmetic(result.arithmetic),
    ]
    if result.commands is not None and result.compilation is not None:
        lines += ["", "Whole commands, each in a process of its own:", "", *_commands(result.commands), ""]
        lines.append(
            f"With an empty cache the first command takes {result.compilation['cpu_s']:.0f} s of processors more, "
            f"{result.compilation['clock_s']:.0f} s by the clock: it compiles the kernels that it needs."
        )
    if result.diagnosis is not None:
        lines += [
            "",
            "Diagnoses of recordings of 40 steps in 7 sequences, 14 disks:",
            "",
            *_diagnosis(result.diagnosis),
        ]
    return "\n".join([*lines, ""])


def bench_json(result: Measured) -> str:
    """The whole result as JSON: `machine`, `compilation`, and tables (null if not measured)."""
    names = (
        "methods",
        "scaling",
        "jacobians",
        "paths",
        "growth",
        "arithmetic",
        "peaks",
        "commands",
        "diagnosis",
        "goals",
    )
    tables = {name: getattr(result, name) for name in names}
    records = {name: None if table is None else _records(table) for name, table in tables.items()}
    return json.dumps({"machine": result.machine, "compilation": result.compilation, **records}, indent=2)


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows of a table as dictionaries for JSON, each without the cells that are NaN."""
    return [{k: v for k, v in row.items() if v == v} for row in table.to_dict("records")]


# Each of the next functions gives the lines of a Markdown table, or a part of a sentence, for a table of `Measured`.
def _goals(goals: pd.DataFrame) -> list[str]:
    rows = [
        [
            row.goal,
            f"{row.relation} {row.asked:g}",
            _plain(row.measured),
            f"{row.of_asked:.2g}",
            "met" if row.met else "**missed**",
        ]
        for row in goals.itertuples()
    ]
    return markdown_table(["goal", "asked", "measured", "of asked", ""], rows)


def _methods(methods: pd.DataFrame) -> list[str]:
    rows = [
        [
            row.method,
            _plain(row.times_engine),
            f"{row.tip_error_percent:.2g}",
            f"{1e3 * row.time_of_20_s:.3g}",
            f"{1e6 * row.time_each_s:.3g}",
        ]
        for row in methods.itertuples()
    ]
    head = ["method", "times engine", "largest tip error, % of length", "20 equilibria, ms", "one, us"]
    return markdown_table(head, rows)


def _scaling(scaling: pd.DataFrame) -> list[str]:
    rows = [
        [
            str(row.plates),
            row.loads,
            f"{row.per_plate_of_shortest:.2f}",
            f"{1e6 * row.time_per_plate_s:.3g}",
            _plain(1e6 * row.time_each_s),
        ]
        for row in scaling.itertuples()
    ]
    return markdown_table(
        ["plates", "loads", "a plate, of the shortest chain's", "a plate, us", "equilibrium, us"], rows
    )


def _jacobians(jacobians: pd.DataFrame) -> list[str]:
    rows = [
        [row.loads, str(row.parameters), f"{row.of_as_many_solves:.2f}", _plain(1e6 * row.time_each_s)]
        for row in jacobians.itertuples()
    ]
    return markdown_table(["loads", "parameters", "of as many solves", "an equilibrium, us"], rows)


def _paths(paths: pd.DataFrame) -> list[str]:
    two = paths.get("two_workers", pd.Series(float("nan"), paths.index))
    rows = [
        [path, f"{ratio:.2f}", f"{1e6 * seconds:.3g}", f"{1 / seconds:,.0f}", f"{fast:.2f}" if fast == fast else ""]
        for path, ratio, seconds, fast in zip(
            paths["path"], paths["times_kernel"], paths["time_each_s"], two, strict=True
        )
    ]
    return markdown_table(["way", "times the kernel", "one, us", "a second", "two workers, times one"], rows)


def _growth(growth: pd.DataFrame) -> list[str]:
    rows = [[r.varied, f"{r.number:,}", f"{r.of_first:.2f}", f"{1e6 * r.time_each_s:.3g}"] for r in growth.itertuples()]
    return markdown_table(["", "number", "of the first", "equilibrium, us"], rows)


def _peaks(peaks: pd.DataFrame) -> str:
    rates = (f"{row.operations_per_s / 1e9:.3g} ({row.peak})" for row in peaks.itertuples())
    return ", ".join(rates) + " x 10^9 operations a second"


def _weights() -> str:
    return ", ".join(f"{kind.replace('_', ' ')} count {weight}" for kind, weight in OPERATION_WEIGHTS.items())


def _arithmetic(arithmetic: pd.DataFrame) -> list[str]:
    rows = [
        [
            row.method,
            f"{row.operations:,.0f}",
            *(f"{getattr(row, kind):,.0f}" for kind in OPERATION_WEIGHTS),
            f"{1e6 * row.time_each_s:.3g}",
            f"{row.operations_per_s / 1e9:.2f}",
            f"{row.of_scalar_peak:.2f}",
            f"{row.of_vector_peak:.3f}",
        ]
        for row in arithmetic.itertuples()
    ]
    kinds = (kind.replace("_", " ") for kind in OPERATION_WEIGHTS)
    head = ["method", "operations", *kinds, "one, us", "10^9 a second", "of one at a time"]
    return markdown_table([*head, "of side by side"], rows)


def _commands(commands: pd.DataFrame) -> list[str]:
    rows = [
        [r.command, f"{r.configurations:,}", str(r.workers), f"{r.cpu_s:.1f}", f"{r.clock_s:.1f}", f"{r.peak_mib:.0f}"]
        for r in commands.itertuples()
    ]
    head = ["command", "configurations", "workers", "processors, s", "clock, s", "largest process, MiB"]
    return markdown_table(head, rows)


def _diagnosis(diagnosis: pd.DataFrame) -> list[str]:
    rows = [
        [row.friction, str(row.design), row.concealed or "nothing", row.verdict, f"{row.seconds:.1f}"]
        for row in diagnosis.itertuples()
    ]
    return markdown_table(["friction", "design", "concealed", "verdict", "s"], rows)


def _plain(number: float) -> str:
    """A number with three digits, from 100 on whole with thousands apart; only small ones have an exponent."""
    return f"{number:,.0f}" if number >= 100 else f"{number:.3g}"
