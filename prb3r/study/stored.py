"""Tasks whose results the workers write to disk themselves, if they see the folder of the study's parts.

Only a number of rows then comes back to the gathering process; tables pass neither through it nor through the scheduler
of a cluster.  A worker that does not see the folder, or cannot write there, returns its tables instead.
"""

import contextlib
import secrets
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from prb3r.errors import EngineError, Problem
from prb3r.runs.part import COUNT
from prb3r.runs.pending import read_pending, write_pending
from prb3r.runs.states import Columns, write_block
from prb3r.study.chunk import Chunk, states_of_each
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
    """A task whose results the worker writes to disk, and the name of the part that they belong to."""

    task: StudyTask
    storage: Storage
    stem: str
    """Name of the part."""
    with_states: bool
    """Whether states are kept."""

    @property
    def numbers(self) -> np.ndarray:
        """(cases,) numbers of the task's cases in the study, ascending; for a block of a cloud, of its case."""
        return (self.task.chunk if isinstance(self.task, CloudBlock) else self.task).numbers

    def single(self) -> Sequence["StoredTask | StudyTask"]:
        """The tasks that this one is split into when it fails, whose tables are returned; itself if it has one case."""
        parts = self.task.single()
        return parts if len(parts) > 1 else [self]


@dataclass(frozen=True)
class Stored:
    """The value returned for a task whose results are on disk."""

    rows: int
    """Number of rows of states."""


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
    """Write the results of a task: first its block of states, then its other columns as pending."""
    home, number = task.storage.home, _number(task.task)
    if isinstance(solved, SolvedCloudBlock):
        known, states = solved.loads, solved.states
    else:
        known, states = solved
        known = known | {COUNT: states_of_each(known["case_id"], states)}
        states = {name: values for name, values in states.items() if name != "case_id"}
    if task.with_states:
        write_block(home, task.stem, number, states)
    write_pending(home, task.stem, number, known)
    return Stored(len(states["step"]))


def fetched(task: StoredTask) -> Columns:
    """The columns besides states that a worker has written for a task: of loads, or of cases and their `COUNT`.

    Raises
    ------
    EngineError
        If they are missing or damaged.
    """
    kept = read_pending(task.storage.home, task.stem, _number(task.task), states=False)
    if kept is None:
        what = "what workers have written there is gone or damaged"
        raise EngineError(Problem(str(task.storage.home), what))
    return kept[0]


def _number(task: Chunk | CloudBlock) -> int:
    """Number of the block of states that a task gives; 0 for a chunk."""
    return task.number if isinstance(task, CloudBlock) else 0
