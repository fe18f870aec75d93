"""Obtain the results of all cases of a plan as parts: taken over from other studies, or computed by workers."""

from collections.abc import Mapping, Sequence

import numpy as np

from prb3r.runs.engine import run_tasks
from prb3r.runs.part import part_name
from prb3r.runs.parts import Parts
from prb3r.runs.pending import drop_pending, read_pending, write_pending
from prb3r.runs.states import Columns, States
from prb3r.runs.tasks import Piece, Workers
from prb3r.study.chunk import (
    CASE_CRASHED,
    CASE_FAILED,
    Chunk,
    blank_columns,
    failed_cases,
    one_below_another,
    reason_column,
)
from prb3r.study.cloud import CloudBlock, Gathering
from prb3r.study.plan import Plan, Progress
from prb3r.study.stored import Storage, Stored, StoredTask, fetched_loads, solve_and_store, states_of_part, storage
from prb3r.study.work import StudyTask, tasks_of


def obtain_results(plan: Plan, parts: Parts, workers: Workers, progress: Progress, fresh: bool = False) -> int:
    """Obtain all items of the cases of a plan as parts, from other studies or by computing.

    Returns the number of cases that lacked an item and were computed.

    Parameters
    ----------
    fresh : take nothing from other studies.
    """
    missing = plan.missing(parts)
    if not fresh and adopt(plan, parts, missing):
        missing = plan.missing(parts)
    return compute(plan, parts, missing, workers, progress)


def adopt(plan: Plan, parts: Parts, missing: np.ndarray) -> bool:
    """Copy parts of other studies in the same folder of results that hold items which cases of the plan lack.

    Returns whether there are any; `missing` is that of `Plan.missing`.
    """
    return bool(missing.any()) and parts.adopt(plan.items, plan.keys, missing)


def compute(plan: Plan, parts: Parts, missing: np.ndarray, workers: Workers, progress: Progress) -> int:
    """Compute the `missing` items (as of `Plan.missing`), which no part holds, and add them as parts.

    Returns the number of cases that lacked any.
    """
    parts.ready()
    asked = missing & plan.first_of_its_key[:, None]
    waiting = asked.any(1)
    tasks = [task for chunk in plan.chunks(asked) for task in tasks_of(chunk)]
    whole = plan.loads()
    what = "cases" if whole == len(plan.cases) else "loads"
    keeper = _Keeper(plan, parts, tasks, progress)
    left = keeper.resumed()
    progress.begin(plan.study.name, whole, whole - plan.loads(waiting) + keeper.known, what)
    try:
        keeper.finish()
        if left:
            with storage(parts.home) as place:
                todo = keeper.stored(left, place)
                run_tasks(solve_and_store, todo, keeper, workers, split=lambda task: task.single())
    finally:
        progress.end()
    return int(missing.any(1).sum())


class _Keeper:
    """Stores the results of tasks as parts: a chunk as it comes, a cloud once all its blocks have come.

    As the `on_result` of `run_tasks` it is called with the number of a task and its pieces.
    """

    def __init__(self, plan: Plan, parts: Parts, tasks: Sequence[StudyTask], progress: Progress) -> None:
        self.plan, self.parts, self.tasks, self.progress = plan, parts, tasks, progress
        self.clouds: dict[int, Gathering] = {}
        self.known = 0
        """Number of loads in blocks that an interrupted run has left on disk."""

    def resumed(self) -> dict[int, StudyTask]:
        """Take in blocks of clouds that an interrupted run has left on disk; returns the remaining tasks by number."""
        left = {}
        for number, task in enumerate(self.tasks):
            kept = None
            if isinstance(task, CloudBlock):
                kept = read_pending(self.parts.home, self._part(task), task.number, self._with_states(task))
            if isinstance(task, CloudBlock) and kept is not None:
                self._cloud(task).add(task, *kept)
                self.known += task.loads
            else:
                left[number] = task
        return left

    def stored(self, tasks: Mapping[int, StudyTask], place: Storage) -> dict[int, StoredTask]:
        """The tasks, by number, as tasks whose results the workers write to disk themselves."""
        return {number: self._to_store(task, place) for number, task in tasks.items()}

    def _to_store(self, task: StudyTask, place: Storage) -> StoredTask:
        chunk = _chunk_of(task)
        item = self.plan.states_item if self._with_states(task) else None
        return StoredTask(task, place, self.plan.keys[chunk.numbers], item_columns(self.plan, chunk), item)

    def finish(self) -> None:
        """Store the cases of all clouds of which no block is missing."""
        for cloud in [cloud for cloud in self.clouds.values() if not cloud.missing]:
            self._keep_cloud(cloud)

    def __call__(self, number: int, pieces: list[Piece]) -> None:
        task = self.tasks[number]
        failed = self._block(task, pieces[0]) if isinstance(task, CloudBlock) else self._chunk(task, pieces)
        self.progress.advance(task.loads, failed)

    def _chunk(self, chunk: Chunk, pieces: list[Piece]) -> int:
        """Store the cases of a chunk; returns how many failed or, if they have clouds, the number of loads of these."""
        known = pieces[0].value
        if isinstance(known, Stored):
            self.parts.take(self._part(chunk))
            failed = known.failed
        else:
            cases, states = computed_columns(pieces, chunk)
            keep_chunk(self.plan, self.parts, chunk, cases, states)
            failed = int(failed_cases(cases, chunk.metrics).sum())
        return failed * (chunk.loads // len(chunk.numbers))

    def _block(self, block: CloudBlock, piece: Piece) -> int:
        """Take in a block of a cloud and, if it is the last, store the case; returns the number of failed loads."""
        cloud, failed = self._cloud(block), block.loads
        if piece.fate == "done":
            cloud.add(block, self._loads(block, piece), piece.value.rows)
            failed = piece.value.failed
        else:
            cloud.lose(_lost_as(piece), piece.reason)
        if not cloud.missing:
            self._keep_cloud(cloud)
        return failed

    def _loads(self, block: CloudBlock, piece: Piece) -> Columns:
        """The columns of a solved block's loads, written to disk here with its states if no worker has done so."""
        if isinstance(piece.value, Stored):
            return fetched_loads(piece.task)
        stem = self._part(block)
        if self._with_states(block):
            self.parts.add_block(stem, block.number, piece.value.states)
        write_pending(self.parts.home, stem, block.number, piece.value.loads)
        return piece.value.loads

    def _cloud(self, block: CloudBlock) -> Gathering:
        """The gathering of the cloud of a block, a new one for the first block."""
        if block.case not in self.clouds:
            self.clouds[block.case] = Gathering(block)
        return self.clouds[block.case]

    def _with_states(self, task: StudyTask) -> bool:
        """Whether states are to be kept of a task."""
        return self.plan.states_item in _chunk_of(task).items

    def _keep_cloud(self, cloud: Gathering) -> None:
        """Store the case of a cloud of which no block is missing."""
        states, block = None, cloud.block
        if self._with_states(block):
            rows = tuple(cloud.rows) if cloud.lost is None else ()
            states = States(str(self.plan.states_item), np.array([sum(rows)]), None, rows)
        keep_columns(self.plan, self.parts, block.chunk, cloud.columns(), states)
        drop_pending(self.parts.home, self._part(block))
        del self.clouds[block.case]

    def _part(self, task: StudyTask) -> str:
        """Name of the part that the cases of a task become."""
        items = list(item_columns(self.plan, _chunk_of(task)).values())
        if self._with_states(task):
            items.append(str(self.plan.states_item))
        return part_name(self.plan.keys[_chunk_of(task).numbers], items)


def _chunk_of(task: StudyTask) -> Chunk:
    return task.chunk if isinstance(task, CloudBlock) else task


def _lost_as(piece: Piece) -> str:
    """The outcome of the cases of a piece that is not done."""
    return CASE_CRASHED if piece.fate == "crashed" else CASE_FAILED


def computed_columns(pieces: list[Piece], chunk: Chunk) -> tuple[Columns, Columns | None]:
    """Columns of a chunk's cases and of their states (None if not kept or all failed), from the pieces of its task."""
    cases, states = [], []
    for piece in pieces:
        if piece.fate == "done":
            cases.append(piece.value[0])
            states.append(piece.value[1])
        else:
            cases.append(blank_columns(piece.task.numbers, chunk.metrics, _lost_as(piece), piece.reason))
    return one_below_another(cases), one_below_another(states) if states and chunk.states != "none" else None


def keep_chunk(plan: Plan, parts: Parts, chunk: Chunk, cases: Columns, states: Columns | None) -> None:
    """Add computed columns of a chunk's cases and of their states to the parts."""
    kept = None
    if chunk.states != "none" and plan.states_item:
        kept = states_of_part(plan.states_item, cases, states or {"case_id": np.zeros(0, np.int64)})
    keep_columns(plan, parts, chunk, cases, kept)


def keep_columns(plan: Plan, parts: Parts, chunk: Chunk, cases: Columns, states: States | None) -> None:
    """Add columns of a chunk's cases to the parts, together with their states."""
    parts.add(plan.keys[cases["case_id"]], cases, item_columns(plan, chunk), states)


def item_columns(plan: Plan, chunk: Chunk) -> dict[str, str]:
    """The columns to be stored of a chunk, each with its item."""
    names = {}
    if plan.items[0] in chunk.items:
        outcome = blank_columns(np.zeros(0, np.int64), (), "", "")
        names = {name: plan.items[0] for name in outcome if name != "case_id"}
    for metric, item in plan.metric_items:
        if item in chunk.items:
            columns = [*(quantity.name for quantity in metric.quantities()), reason_column(metric)]
            names |= dict.fromkeys(columns, item)
    return names
