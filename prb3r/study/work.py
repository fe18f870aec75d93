"""What a worker does: solve and measure the cases of one chunk.  A case that fails is a record, not an exception."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from prb3r.mechanics.equilibrium import Outcome
from prb3r.model.laws.self_consistent import NOT_CLOSED, equilibria_of
from prb3r.model.steps import loads_of
from prb3r.study.cases import Case, steps_frame
from prb3r.study.metrics.base import Metric, Solved
from prb3r.study.metrics.drive import drive_tension
from prb3r.study.metrics.reach import Workspace
from prb3r.study.spec import Cloud
from prb3r.study.workspace import cloud_loads

CASE_FAILED, CASE_CRASHED = "failed", "crashed"


@dataclass(frozen=True)
class Chunk:
    """Cases for one task of a worker, and what to measure."""

    cases: tuple[Case, ...]
    metrics: tuple[Metric, ...]
    states: str
    """`none`, `final` or `path`."""
    state_disks: tuple[int, ...] | None
    cables: tuple[str, ...]
    """Names of the cables in the table of states."""

    def single(self) -> list["Chunk"]:
        """Chunks of a single case each, for finding the one that kills its worker."""
        return [replace(self, cases=(case,)) for case in self.cases]


Row = dict[str, Any]


def solve_case(case: Case) -> Solved:
    """Equilibria of a case: its cloud, or its initial loads and steps in their order."""
    manipulator = case.manipulator()
    chain = manipulator.chain(case.settings["broken"])
    if case.settings["cloud"]:
        cloud = Cloud.model_validate(case.settings["cloud"])
        names = [name for name in cloud.tension_n if chain.reach[manipulator.cable_names.index(name)]]
        limits = {name: cloud.tension_n[name] for name in names}
        if cloud.limit == "bend":
            limits = {name: bend_limit(case, name, cloud) for name in names}
        loads = cloud_loads(manipulator, chain, limits, cloud.count)
        states = equilibria_of(chain, loads, from_rest=True, eigenvalue=True, detail=False)
        return Solved(manipulator, chain, loads, states, cloud=True)
    loads = loads_of(manipulator, chain, steps_frame(case.settings))
    initial = bool(case.settings["initial"])
    numbers = np.arange(loads.steps) + (0 if initial else 1)
    states = equilibria_of(chain, loads, eigenvalue=True, number=numbers)
    return Solved(manipulator, chain, loads, states, initial)


def bend_limit(case: Case, cable: str, cloud: Cloud) -> float:
    """Tension at which `cable` alone, nothing broken, bends the outermost segment it drives by the cloud's bend, N."""
    whole, most = case.manipulator(), 20 * cloud.tension_n[cable]
    segment = next(other.ends_at_segment for other in whole.cable if other.name == cable)
    tension = drive_tension(whole, whole.chain(), cable, segment, cloud.bend_rad or np.pi, most)
    if not np.isfinite(tension):
        raise ValueError(f"up to {most:g} N cable {cable!r} does not bend its segment by {cloud.bend_rad:g} rad")
    return tension


def outcome_columns(solved: Solved) -> Row:
    """The columns that say how the solution of a case went: outcome, reason, and numbers over all its steps."""
    states = solved.states
    failed = ~np.array([Outcome(code).solved for code in states.outcome])
    unstable = states.outcome == Outcome.UNSTABLE
    lowest = states.lowest_eigenvalue if states.lowest_eigenvalue is not None else np.array([np.nan])
    last, reason = Outcome(states.outcome[-1]), ""
    outcome = last.label
    if solved.cloud:
        outcome = Outcome.NO_EQUILIBRIUM.label if failed.all() else Outcome.CONVERGED.label
    if failed.any() or unstable.any():
        counts = [
            f"{mask.sum()} {word}"
            for mask, word in ((failed, "without equilibrium"), (unstable, "unstable"))
            if mask.any()
        ]
        reason = f"of {len(failed)} loads {' and '.join(counts)}"
        if not solved.cloud and last != Outcome.CONVERGED:
            reason = states.reason(-1) if states.closed is None or states.closed[-1] else NOT_CLOSED
    return {
        "outcome": outcome,
        "reason": reason,
        "iterations": int(states.iterations.sum()),
        "residual_n_m": float(np.nanmax(states.residual)) if not failed.all() else np.nan,
        "lowest_eigenvalue_n_m_per_rad": float(np.nanmin(lowest)) if np.isfinite(lowest).any() else np.nan,
    }


def blank_row(case: Case, metrics: tuple[Metric, ...], outcome: str, reason: str) -> Row:
    """The row of a case that could not be computed."""
    numbers = {"iterations": 0, "residual_n_m": np.nan, "lowest_eigenvalue_n_m_per_rad": np.nan}
    measured = {quantity.name: np.nan for metric in metrics for quantity in metric.quantities()}
    return {**label_columns(case), "outcome": outcome, "reason": reason, **numbers, **measured}


def label_columns(case: Case) -> Row:
    """The columns that tell a case from the others: number, factors and broken cables."""
    return {"case_id": case.number, **case.factors, "broken_cables": ",".join(case.settings["broken"])}


def case_row(case: Case, solved: Solved, metrics: tuple[Metric, ...]) -> Row:
    """Outcome and metrics of a solved case; a metric that cannot be had marks the case as failed."""
    row = blank_row(case, metrics, "", "") | outcome_columns(solved)
    if row["outcome"] in (Outcome.NO_EQUILIBRIUM.label, Outcome.LIMIT_POINT.label):
        return row
    for metric in metrics:
        try:
            if solved.cloud and not isinstance(metric, Workspace):
                raise ValueError("needs load steps, this case is a cloud of loads")
            if not solved.cloud and isinstance(metric, Workspace) and metric.tension_n is None:
                raise ValueError("needs tension_n, as the study has no cloud of loads")
            names = [quantity.name for quantity in metric.quantities()]
            row |= {name: float(value) for name, value in zip(names, metric.values(solved), strict=True)}
        except (ValueError, ArithmeticError, IndexError, np.linalg.LinAlgError) as error:
            row |= {"outcome": CASE_FAILED, "reason": f"metric {metric.kind}: {error}"}
    return row


def state_rows(case: Case, solved: Solved, chunk: Chunk) -> dict[str, np.ndarray]:
    """The states of a case that the spec keeps; step 0 is the initial configuration."""
    states, names = solved.states, solved.manipulator.cable_names
    steps = np.arange(len(states.x)) if chunk.states == "path" else np.array([len(states.x) - 1])
    disks = np.arange(states.x.shape[1])
    if chunk.state_disks is not None:
        disks = disks[np.isin(disks, chunk.state_disks)]
    pick = np.ix_(steps, disks)
    rows = {
        "case_id": np.full(len(steps) * len(disks), case.number),
        "step": np.repeat(steps + (0 if solved.initial else 1), len(disks)),
        "disk": np.tile(disks, len(steps)),
        "x_m": states.x[pick].ravel(),
        "y_m": states.y[pick].ravel(),
        "angle_rad": states.angle[pick].ravel(),
    }
    for name in chunk.cables:
        column = names.index(name)
        applied = solved.loads.tension[steps, column] * (solved.chain.reach[column] > 0)
        tension = np.broadcast_to(applied[:, None], (len(steps), len(disks)))
        if len(states.tension):
            spans = np.concatenate([applied[:, None], states.tension[steps, :, column]], axis=1)
            tension = spans[:, disks]
        rows[f"cable_{name}_n"] = tension.ravel()
    return rows


def solve_chunk(chunk: Chunk) -> tuple[list[Row], list[dict[str, np.ndarray]]]:
    """Rows of the cases and, if kept, their states."""
    rows, states = [], []
    for case in chunk.cases:
        try:
            solved = solve_case(case)
            rows.append(case_row(case, solved, chunk.metrics))
            if chunk.states != "none":
                states.append(state_rows(case, solved, chunk))
        except (ValueError, ArithmeticError, MemoryError, np.linalg.LinAlgError) as error:
            rows.append(blank_row(case, chunk.metrics, CASE_FAILED, f"{type(error).__name__}: {error}"))
    return rows, states
