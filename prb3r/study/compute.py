"""Bring the cases of a plan among the parts: from other studies, or from workers."""

from collections.abc import Sequence

import numpy as np

from prb3r.runs.engine import run_tasks
from prb3r.runs.parts import Columns, Parts, States
from prb3r.runs.tasks import Piece, Workers
from prb3r.study.plan import Plan, Progress
from prb3r.study.work import CASE_CRASHED, CASE_FAILED, Chunk, blank_columns, reason_column, solve_chunk


def brought(plan: Plan, parts: Parts, workers: Workers, progress: Progress, fresh: bool = False) -> int:
    """Bring all cases of a plan among the parts, from other studies or computed; the number of the latter.

    Parameters
    ----------
    fresh : take nothing from other studies.
    """
    if not fresh:
        adopt(plan, parts)
    return compute(plan, parts, workers, progress)


def adopt(plan: Plan, parts: Parts) -> None:
    """Take what other studies in the same folder have computed of the cases."""
    missing = plan.missing(parts)
    lacking = zip(plan.items, missing.T, strict=True)
    if missing.any():
        parts.adopt({item: {plan.keys[number] for number in np.flatnonzero(lacks)} for item, lacks in lacking})


def compute(plan: Plan, parts: Parts, workers: Workers, progress: Progress) -> int:
    """Compute what is not among the parts and add it to them; the number of cases that lacked something."""
    missing = plan.missing(parts)
    chunks, waiting = plan.chunks(missing), int(missing.any(1).sum())
    progress.begin(plan.study.name, len(plan.cases), len(plan.cases) - waiting)

    def keep(number: int, pieces: list[Piece]) -> None:
        chunk = chunks[number]
        cases, states = computed_columns(pieces, chunk)
        keep_chunk(plan, parts, chunk, cases, states)
        failed = cases["outcome"] != "converged"
        for metric in chunk.metrics:
            failed |= cases[reason_column(metric)] != ""
        progress.advance(len(failed), int(failed.sum()))

    try:
        run_tasks(solve_chunk, dict(enumerate(chunks)), keep, workers, split=Chunk.single)
    finally:
        progress.end()
    return waiting


def computed_columns(pieces: list[Piece], chunk: Chunk) -> tuple[Columns, Columns | None]:
    """Columns of a chunk's cases and, if they are kept, of their states, from the pieces that it was computed in."""
    cases, states = [], []
    for piece in pieces:
        if piece.fate == "done":
            cases.append(piece.value[0])
            states.append(piece.value[1])
        else:
            outcome = CASE_CRASHED if piece.fate == "crashed" else CASE_FAILED
            cases.append(blank_columns(piece.task.numbers, chunk.metrics, outcome, piece.reason))
    return _stacked(cases), _stacked(states) if states and chunk.states != "none" else None


def keep_chunk(plan: Plan, parts: Parts, chunk: Chunk, cases: Columns, states: Columns | None) -> None:
    """Add the items that a chunk was computed for to the parts."""
    numbers, names = cases["case_id"], {}
    if plan.items[0] in chunk.items:
        outcome = blank_columns(numbers[:0], (), "", "")
        names = {name: plan.items[0] for name in outcome if name != "case_id"}
    for metric, item in plan.metric_items:
        if item in chunk.items:
            columns = [*(quantity.name for quantity in metric.quantities()), reason_column(metric)]
            names |= dict.fromkeys(columns, item)
    kept = None
    if chunk.states != "none" and plan.states_item:
        states = states or {"case_id": np.zeros(0, np.int64)}
        count = np.bincount(np.searchsorted(numbers, states["case_id"]), minlength=len(numbers))
        kept = States(plan.states_item, count, {name: states[name] for name in states if name != "case_id"})
    parts.add([plan.keys[number] for number in numbers], cases, names, kept)


def _stacked(tables: Sequence[Columns]) -> Columns:
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
