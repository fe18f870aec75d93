"""What a worker does: solve and measure the cases of one chunk.  A case that fails is a row, not an exception."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from prb3r.inverse.reach import limits, pulls_along
from prb3r.inverse.target import chain_targets
from prb3r.mechanics.chain import Chain, Loads, loads
from prb3r.mechanics.equilibrium import Equilibria, Outcome
from prb3r.model.laws.self_consistent import NOT_CLOSED, equilibria_of
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import disk_tension
from prb3r.model.steps import loads_of
from prb3r.runs.parts import Columns
from prb3r.study.cases import Family
from prb3r.study.loading import Cloud
from prb3r.study.loads import load_columns, load_rows
from prb3r.study.metrics.base import Metric, Solved
from prb3r.study.metrics.drive import drive_tension
from prb3r.study.tree import Tree
from prb3r.study.workspace import cloud_loads

CASE_FAILED, CASE_CRASHED = "failed", "crashed"
MOST_DISKS = 2**18
"""Disks of all steps that are solved in one call: about 50 MB of states."""
FAILURES = (ValueError, ArithmeticError, MemoryError, IndexError, np.linalg.LinAlgError)
"""What makes a case or a metric fail, instead of the run."""


@dataclass(frozen=True)
class Chunk:
    """Cases for one task of a worker, and what to measure."""

    families: tuple[Family, ...]
    metrics: tuple[Metric, ...]
    states: str
    """`none`, `final` or `path`."""
    state_disks: tuple[int, ...] | None
    cables: tuple[str, ...]
    """Names of the cables in the table of states."""
    items: tuple[str, ...] = ()
    """What is asked for, as parts name it."""

    @property
    def numbers(self) -> np.ndarray:
        """Numbers of its cases, ascending."""
        return np.sort(np.concatenate([family.numbers for family in self.families]))

    def single(self) -> list["Chunk"]:
        """Chunks of a single case each, in their order, for finding the one that kills its worker."""
        cases = [case for family in self.families for case in family.single()]
        return [replace(self, families=(case,)) for case in sorted(cases, key=lambda case: case.numbers[0])]


def solve_chunk(chunk: Chunk) -> tuple[Columns, Columns]:
    """Columns of the cases, in their order, and of the states that are kept."""
    tables = [table for family in chunk.families for table in _family_tables(family, chunk)]
    cases, states = (_joined(kind) for kind in zip(*tables, strict=True))
    return cases, states


def blank_columns(numbers: np.ndarray, metrics: Sequence[Metric], outcome: str, reason: str) -> Columns:
    """The columns of cases that could not be computed."""
    count = len(numbers)
    measured = [quantity.name for metric in metrics for quantity in metric.quantities()]
    reasons = {reason_column(metric): np.full(count, "", object) for metric in metrics}
    return reasons | {
        "case_id": np.asarray(numbers),
        "outcome": np.full(count, outcome, object),
        "reason": np.full(count, reason, object),
        "iterations": np.zeros(count, np.int64),
        **{name: np.full(count, np.nan) for name in ("residual_n_m", "lowest_eigenvalue_n_m_per_rad", *measured)},
    }


def reason_column(metric: Metric) -> str:
    """The column that says why a metric could not be had; empty where it could."""
    return f"reason of {metric.quantities()[0].name}"


def state_columns(cables: Sequence[str]) -> Columns:
    """The columns of a table of states without rows."""
    numbers = {name: np.zeros(0, np.int64) for name in ("case_id", "step", "disk")}
    return numbers | {name: np.zeros(0) for name in ("x_m", "y_m", "angle_rad", *(f"cable_{c}_n" for c in cables))}


# Solving --------------------------------------------------------------------------------------------------------------


def solve_cases(family: Family, manipulator: Manipulator, chain: Chain) -> Solved:
    """Equilibria of cases that share a manipulator: of their initial loads and steps in their order, or of a cloud."""
    settings, count = family.settings, len(family)
    if settings["cloud"]:
        many = _cloud(Cloud.model_validate(settings["cloud"]), manipulator, chain)
        states = equilibria_of(chain, many, from_rest=True, eigenvalue=True, detail=False)
        return Solved(manipulator, chain, many, states, cloud=True)
    if settings["reach"]:
        return _followed(settings["reach"], manipulator, chain)
    columns = load_columns(settings, count)
    steps = next(iter(columns.values())).shape[1]
    path = loads_of(manipulator, chain, {name: values.ravel() for name, values in columns.items()})
    initial = bool(settings["initial"])
    numbers = np.tile(np.arange(steps) + (0 if initial else 1), count)
    begins = np.arange(count * steps) % steps == 0
    states = equilibria_of(chain, path, from_rest=begins, eigenvalue=True, number=numbers)
    return Solved(manipulator, chain, path, states, initial, count=count)


def _parts(family: Family, chain: Chain) -> Iterator[Family]:
    """Cases that are solved in one call: few enough for the memory, single ones under moments that follow the state."""
    alone = bool(family.settings["cloud"] or family.settings["reach"] or chain.closure)
    most = 1 if alone else max(1, MOST_DISKS // (len(load_rows(family.settings)) * (chain.plates + 1)))
    return (family.part(slice(start, start + most)) for start in range(0, len(family), most))


def _cloud(cloud: Cloud, manipulator: Manipulator, chain: Chain) -> Loads:
    names = [name for name in cloud.tension_n if chain.reach[manipulator.cable_names.index(name)]]
    limits = {name: cloud.tension_n[name] for name in names}
    if cloud.limit == "bend":
        limits = {name: bend_limit(manipulator, name, cloud) for name in names}
    return cloud_loads(manipulator, chain, limits, cloud.count)


def _followed(reach: Tree, manipulator: Manipulator, chain: Chain) -> Solved:
    """A disk brought from target to target, a step each; where nothing leads to one, the step before is kept."""
    targets = chain_targets(chain, chain.plates if reach["disk"] == "tip" else reach["disk"], reach["target"])
    cables = len(manipulator.cable)
    tension, slip = np.zeros((len(targets), cables)), -np.ones((len(targets), cables))
    for step, found in enumerate(pulls_along(chain, targets, limits(chain, reach.get("most_n")))):
        tension[step], slip[step] = (
            (tension[step - 1], slip[step - 1]) if found is None else (found.tension, found.slip)
        )
    steps = loads(chain, tension, slip)
    begins = np.arange(len(targets)) == 0
    states = equilibria_of(chain, steps, from_rest=begins, eigenvalue=True, number=np.arange(1, len(targets) + 1))
    return Solved(manipulator, chain, steps, states, targets=tuple(targets))


def bend_limit(manipulator: Manipulator, cable: str, cloud: Cloud) -> float:
    """Tension at which `cable` alone, nothing broken, bends the outermost segment it drives by the cloud's bend, N."""
    most = 20 * cloud.tension_n[cable]
    segment = next(other.ends_at_segment for other in manipulator.cable if other.name == cable)
    tension = drive_tension(manipulator, manipulator.chain(), cable, segment, cloud.bend_rad or np.pi, most)
    if not np.isfinite(tension):
        raise ValueError(f"up to {most:g} N cable {cable!r} does not bend its segment by {cloud.bend_rad:g} rad")
    return tension


# Measuring ------------------------------------------------------------------------------------------------------------


def _family_tables(family: Family, chunk: Chunk) -> list[tuple[Columns, Columns]]:
    """Cases and states of a family, part by part."""
    try:
        manipulator = family.manipulator()
        chain = manipulator.chain(family.settings["broken"])
    except FAILURES as error:
        return [_failed(family, chunk, error)]
    tables = []
    parts = list(_parts(family, chain))[::-1]
    while parts:
        part = parts.pop()
        try:
            solved = solve_cases(part, manipulator, chain)
        except FAILURES as error:
            if len(part) > 1:  # one by one
                parts += list(part.single())[::-1]
            else:
                tables.append(_failed(part, chunk, error))
            continue
        states = kept_states(part.numbers, solved, chunk) if chunk.states != "none" else state_columns(chunk.cables)
        tables.append((measured_columns(part.numbers, solved, chunk.metrics), states))
    return tables


def _failed(family: Family, chunk: Chunk, error: Exception) -> tuple[Columns, Columns]:
    reason = f"{type(error).__name__}: {error}"
    return blank_columns(family.numbers, chunk.metrics, CASE_FAILED, reason), state_columns(chunk.cables)


def measured_columns(numbers: np.ndarray, solved: Solved, metrics: Sequence[Metric]) -> Columns:
    """Outcome and metrics of solved cases, and why a metric could not be had."""
    columns = blank_columns(numbers, metrics, "", "") | outcome_columns(solved)
    lost = [Outcome.NO_EQUILIBRIUM.label, Outcome.LIMIT_POINT.label]
    good = ~np.isin(columns["outcome"].astype(str), lost)
    for metric in metrics if good.any() else ():
        names = [quantity.name for quantity in metric.quantities()]
        for rows, cases in _asked(metric, solved, good):
            try:
                for name, values in zip(names, metric.values(cases), strict=True):
                    columns[name][rows] = values
            except FAILURES as error:
                columns[reason_column(metric)][rows] = f"metric {metric.kind}: {error}"
    return columns


def _asked(metric: Metric, solved: Solved, good: np.ndarray) -> Iterator[tuple[np.ndarray, Solved]]:
    """The cases that a metric is asked about, all at once or one after the other, with their rows."""
    if metric.together or solved.count == 1:
        yield np.flatnonzero(good), solved.part(good)
        return
    for row in np.flatnonzero(good):
        yield np.array([row]), solved.part(np.arange(solved.count) == row)


def outcome_columns(solved: Solved) -> Columns:
    """How the solution of each case went: outcome, reason, and numbers over all its steps."""
    states = solved.states
    code = solved.by_case(states.outcome)
    failed, unstable = np.isin(code, [o for o in Outcome if not o.solved]), code == Outcome.UNSTABLE
    labels = np.array([outcome.label for outcome in Outcome], object)
    outcome = labels[code[:, -1]]
    if solved.cloud:
        outcome = np.where(failed.all(1), Outcome.NO_EQUILIBRIUM.label, Outcome.CONVERGED.label).astype(object)
    reason = np.full(solved.count, "", object)
    for case in np.flatnonzero((failed | unstable).any(1)).tolist():
        reason[case] = _reason(solved, case, failed[case], unstable[case])
    return {
        "outcome": outcome,
        "reason": reason,
        "iterations": solved.by_case(states.iterations).sum(1).astype(np.int64),
        "residual_n_m": _highest(solved.by_case(states.residual)),
        "lowest_eigenvalue_n_m_per_rad": -_highest(-solved.by_case(_eigenvalues(states))),
    }


def _eigenvalues(states: Equilibria) -> np.ndarray:
    lowest = states.lowest_eigenvalue
    return np.full(len(states.x), np.nan) if lowest is None else np.where(np.isinf(lowest), np.nan, lowest)


def _highest(values: np.ndarray) -> np.ndarray:
    """(c,) largest number of each row, NaN where there is none."""
    highest = np.where(np.isnan(values), -np.inf, values).max(1)
    return np.where(np.isneginf(highest), np.nan, highest)


def _reason(solved: Solved, case: int, failed: np.ndarray, unstable: np.ndarray) -> str:
    states, end = solved.states, int(solved.ends[case])
    if not solved.cloud and states.outcome[end] != Outcome.CONVERGED:
        return states.reason(end) if states.closed is None or states.closed[end] else NOT_CLOSED
    counts = [
        f"{mask.sum()} {word}" for mask, word in ((failed, "without equilibrium"), (unstable, "unstable")) if mask.any()
    ]
    return f"of {len(failed)} loads {' and '.join(counts)}"


def kept_states(numbers: np.ndarray, solved: Solved, chunk: Chunk) -> Columns:
    """The states of cases that the spec keeps; step 0 is the initial configuration."""
    states, names = solved.states, solved.manipulator.cable_names
    steps = np.arange(solved.steps) if chunk.states == "path" else np.array([solved.steps - 1])
    disks = np.arange(states.x.shape[1])
    if chunk.state_disks is not None:
        disks = disks[np.isin(disks, chunk.state_disks)]
    tension = disk_tension(solved.chain, solved.loads, states)
    shape = solved.count, len(steps), len(disks)

    def kept(values: np.ndarray) -> np.ndarray:
        """Of every step and disk (c s, n + 1): those of the table, one after the other."""
        return solved.by_case(values)[:, steps[:, None], disks].ravel()

    return {
        "case_id": np.repeat(numbers, len(steps) * len(disks)),
        "step": np.broadcast_to(steps[:, None] + (0 if solved.initial else 1), shape).ravel(),
        "disk": np.broadcast_to(disks, shape).ravel(),
        "x_m": kept(states.x),
        "y_m": kept(states.y),
        "angle_rad": kept(states.angle),
        **{f"cable_{name}_n": kept(tension[:, :, names.index(name)]) for name in chunk.cables},
    }


def _joined(tables: Sequence[Mapping[str, np.ndarray]]) -> Columns:
    """Tables of different cases as one, in the order of the cases."""
    columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    if (np.diff(columns["case_id"]) >= 0).all():
        return columns
    order = np.argsort(columns["case_id"], kind="stable")
    return {name: values[order] for name, values in columns.items()}
