"""Tasks whose results the workers write to disk themselves, if they see the folder of the study's parts.

Cases become a part, blocks of clouds wait as pending until the whole cloud is there.  Only numbers of rows then come
back to the gathering process; tables pass neither through it nor through the scheduler of a cluster.  A worker that
does not see the folder, or cannot write there, returns its tables instead.
"""

import contextlib
import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from prb3r.errors import EngineError
from prb3r.runs.part import part_name, write_part
from prb3r.runs.pending import lost_on_the_way, read_pending, write_pending
from prb3r.runs.states import Columns, States, write_block
from prb3r.study.chunk import Chunk, failed_cases, states_of_each
from prb3r.study.cloud import CloudBlock, SolvedCloudBlock
from prb3r.study.work import StudyTask, solve_task

MARK = "seen-{}.tmp"
"""Name of the marker file by which workers recognise the folder."""


@dataclass(frozen=True)
class Storage:
    """The folder of a study's parts with a marker file by which the workers of this run recognise it."""

    home: Path
    """Absolute path of the folder."""
    mark: str
    """Name of the marker file, which this run has made there."""

    @property
    def seen(self) -> bool:
        """Whether this process sees the folder, rather than none or another one at the same path."""
        return (self.home / self.mark).exists()


@contextlib.contextmanager
def storage(home: Path) -> Iterator[Storage]:
    """The existing folder `home` with a marker file, which is removed at the end of the context."""
    place = Storage(home.resolve(), MARK.format(secrets.token_hex(8)))
    (place.home / place.mark).touch()
    try:
        yield place
    finally:
        with contextlib.suppress(OSError):
            (place.home / place.mark).unlink()


@dataclass(frozen=True)
class StoredTask:
    """A task whose results the worker writes to disk, and the part that they become or belong to."""

    task: StudyTask
    storage: Storage
    keys: np.ndarray
    """(cases,) key of each case of the part."""
    items: Mapping[str, str]
    """Item of each column of the part's table of cases."""
    states_item: str | None
    """Item of the states of the part; None if none are kept."""

    @property
    def part(self) -> str:
        """Name of the part."""
        return part_name(self.keys, [*self.items.values(), *([self.states_item] if self.states_item else [])])

    @property
    def numbers(self) -> np.ndarray:
        """(cases,) numbers of the task's cases in the study, ascending; for a block of a cloud, of its case."""
        return self.chunk.numbers

    @property
    def chunk(self) -> Chunk:
        """The task's cases; for a block of a cloud, its case."""
        return self.task.chunk if isinstance(self.task, CloudBlock) else self.task

    @property
    def block(self) -> int:
        """Number of the block of a cloud; 0 for a chunk of cases."""
        return self.task.number if isinstance(self.task, CloudBlock) else 0

    def single(self) -> Sequence["StoredTask | StudyTask"]:
        """The tasks that this one is split into when it fails, whose tables are returned; itself if it has one case."""
        parts = self.task.single()
        return parts if len(parts) > 1 else [self]


@dataclass(frozen=True)
class Stored:
    """The value returned for a task whose results are on disk."""

    rows: int
    """Number of rows of states."""
    failed: int
    """Number of cases, or of loads of a block of a cloud, that failed."""


def solve_and_store(task: StoredTask | StudyTask) -> tuple[Columns, Columns] | SolvedCloudBlock | Stored:
    """Solve a task and write its results to disk, or return them as `solve_task` does.

    They are returned if the task is no `StoredTask`, or if this process does not see the folder or cannot write there.
    """
    if not isinstance(task, StoredTask):
        return solve_task(task)
    solved = solve_task(task.task)
    if not task.storage.seen:
        return solved
    try:
        return _put(task, solved)
    except EngineError:  # the gathering process reports it if it cannot write either
        return solved


def _put(task: StoredTask, solved: tuple[Columns, Columns] | SolvedCloudBlock) -> Stored:
    """Write the results of a task: a part of cases or, of a block of a cloud, first its states, then its loads."""
    home = task.storage.home
    if isinstance(solved, SolvedCloudBlock):
        if task.states_item:
            write_block(home, task.part, task.block, solved.states)
        write_pending(home, task.part, task.block, solved.loads)
        return Stored(solved.rows, solved.failed)
    cases, states = solved
    kept = states_of_part(task.states_item, cases, states) if task.states_item else None
    write_part(home, task.keys, cases, task.items, kept)
    return Stored(len(states["case_id"]), int(failed_cases(cases, task.chunk.metrics).sum()))


def states_of_part(item: str, cases: Columns, states: Columns) -> States:
    """The states of solved cases as a part takes them, under the name `item`."""
    columns = {name: values for name, values in states.items() if name != "case_id"}
    return States(item, states_of_each(cases["case_id"], states), columns)


def fetched_loads(task: StoredTask) -> Columns:
    """The columns of the loads of a block of a cloud that a worker has written.

    Raises
    ------
    EngineError
        If they are missing or damaged.
    """
    kept = read_pending(task.storage.home, task.part, task.block, states=False)
    if kept is None:
        raise lost_on_the_way(task.storage.home)
    return kept[0]
