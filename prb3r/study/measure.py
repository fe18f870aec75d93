"""Columns of solved cases: their outcome, their metrics, and the states that are kept."""

from collections.abc import Iterator, Sequence

import numpy as np

from prb3r.mechanics.equilibrium import Equilibria, Outcome
from prb3r.model.files.cells import count
from prb3r.model.laws.self_consistent import NOT_CLOSED
from prb3r.model.solve import disk_tension
from prb3r.runs.states import Columns
from prb3r.study.chunk import FAILURES, Chunk, blank_columns, reason_column
from prb3r.study.metrics.base import Metric, Solved, largest


def measured_columns(numbers: np.ndarray, solved: Solved, metrics: Sequence[Metric]) -> Columns:
    """Columns of the outcome and metrics of solved cases, and the reason where a metric failed.

    Metrics are NaN for a case without equilibrium at its last step, and for a cloud with none under any of its loads.

    Parameters
    ----------
    numbers : (c,) numbers of the cases in the study.
    """
    columns = blank_columns(numbers, metrics, "", "") | outcome_columns(solved)
    lost = [outcome.label for outcome in Outcome if not outcome.solved]
    good = ~np.isin(columns["outcome"].astype(str), lost)
    for metric in metrics if good.any() else ():
        names = [quantity.name for quantity in metric.quantities()]
        about = solved.unloaded if solved.cloud and metric.from_rest else solved
        for rows, cases in _asked(metric, about, good):
            try:
                for name, values in zip(names, metric.values(cases), strict=True):
                    columns[name][rows] = values
            except FAILURES as error:
                columns[reason_column(metric)][rows] = f"metric {metric.kind}: {error}"
    return columns


def _asked(metric: Metric, solved: Solved, good: np.ndarray) -> Iterator[tuple[np.ndarray, Solved]]:
    """The good cases as a metric takes them, all at once or one by one, with their rows; `good` is a mask (c,)."""
    if metric.together or solved.count == 1:
        yield np.flatnonzero(good), solved.part(good)
        return
    for row in np.flatnonzero(good):
        yield np.array([row]), solved.part(np.arange(solved.count) == row)


def outcome_columns(solved: Solved) -> Columns:
    """Columns on how the solution of each case went: its outcome and reason, and sums and extremes over its steps."""
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
        "residual_n_m": largest(solved.by_case(states.residual)),
        "lowest_eigenvalue_n_m_per_rad": -largest(-solved.by_case(_eigenvalues(states))),
    }


def _eigenvalues(states: Equilibria) -> np.ndarray:
    """Lowest eigenvalue of each step, N m/rad; NaN where it was not computed or is infinite."""
    lowest = states.lowest_eigenvalue
    return np.full(len(states.x), np.nan) if lowest is None else np.where(np.isinf(lowest), np.nan, lowest)


def _reason(solved: Solved, case: int, failed: np.ndarray, unstable: np.ndarray) -> str:
    """Why a case is not simply converged: the reason of its last step, or the number of such steps; masks are (s,)."""
    states, end = solved.states, int(solved.ends[case])
    if not solved.cloud and states.outcome[end] != Outcome.CONVERGED:
        in_balance = states.closed is None or states.closed[end] or states.outcome[end] == Outcome.GAVE_UP
        return states.reason(end) if in_balance else NOT_CLOSED
    counts = [
        f"{mask.sum()} {word}" for mask, word in ((failed, "without equilibrium"), (unstable, "unstable")) if mask.any()
    ]
    return f"of {count(len(failed), 'load')} {' and '.join(counts)}"


def kept_states(numbers: np.ndarray, solved: Solved, chunk: Chunk, before: int = 0) -> Columns:
    """Columns of the states that the spec keeps; step 0 is the initial configuration.

    The tension of a cable that other cases have, but the manipulator of these has not, is NaN.

    Parameters
    ----------
    numbers : (c,) numbers of the cases in the study.
    before : number of loads of the cloud that come before those of `solved`.
    """
    states, names = solved.states, solved.manipulator.cable_names
    last_steps = slice(None) if chunk.states == "path" else slice(-1, None)
    some_disks = slice(None) if chunk.state_disks is None else np.isin(np.arange(states.x.shape[1]), chunk.state_disks)
    steps, disks = np.arange(solved.steps)[last_steps], np.arange(states.x.shape[1])[some_disks]
    tension = disk_tension(solved.chain, solved.loads, states)
    of_cable, absent = dict(zip(names, np.moveaxis(tension, 2, 0), strict=True)), np.full(states.x.shape, np.nan)
    shape = solved.count, len(steps), len(disks)

    def kept(values: np.ndarray) -> np.ndarray:
        """Values (c s, n + 1) of all steps and disks, reduced to those that are kept, flat."""
        return solved.by_case(values)[:, last_steps][:, :, some_disks].ravel()

    return {
        "case_id": np.repeat(numbers, len(steps) * len(disks)),
        "step": np.broadcast_to(before + steps[:, None] + (0 if solved.initial else 1), shape).ravel(),
        "disk": np.broadcast_to(disks, shape).ravel(),
        "x_m": kept(states.x),
        "y_m": kept(states.y),
        "angle_rad": kept(states.angle),
        **{f"cable_{name}_n": kept(of_cable.get(name, absent)) for name in chunk.cables},
    }
