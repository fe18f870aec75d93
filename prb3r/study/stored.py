"""Tasks whose results workers put on the disk themselves, where they see the folder of the study's parts.

What comes back to the one process that gathers is then a number of rows; tables do not pass through it, nor through the
scheduler of a cluster.  A worker that does not see the folder, or cannot write there, hands its tables over instead.
"""

import contextlib
import secrets
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from prb3r.errors import EngineError, Problem
from prb3r.runs.parts import COUNT
from prb3r.runs.pending import read_pending, write_pending
from prb3r.runs.states import Columns, write_block
from prb3r.study.chunk import Chunk
from prb3r.study.cloud import CloudBlock, SolvedCloudBlock
from prb3r.study.work import StudyTask, solve_task

MARK = "seen-{}.tmp"
"""Name of the file by which workers know the folder."""


@dataclass(frozen=True)
class Storage:
    """The folder of a study's parts, as this run's workers may know it."""

    home: Path
    mark: str
    """Name of a file that this run has put there."""

    @property
    def seen(self) -> bool:
        """Whether this process sees it, and not another folder of that name."""
        return (self.home / self.mark).exists()


@contextlib.contextmanager
def storage(home: Path) -> Iterator[Storage]:
    """Let workers know the folder `home`, which exists, as long as the context lasts."""
    place = Storage(home.resolve(), MARK.format(secrets.token_hex(8)))
    (place.home / place.mark).touch()
    try:
        yield place
    finally:
        with contextlib.suppress(OSError):
            (place.home / place.mark).unlink()


@dataclass(frozen=True)
class StoredTask:
    """A task and the part that its results become, or become a block of."""

    task: StudyTask
    storage: Storage
    stem: str
    """Name of the part."""
    with_states: bool

    @property
    def numbers(self) -> np.ndarray:
        """(cases,) numbers of the task's cases in the study, ascending; of a block of a cloud, its case."""
        return (self.task.chunk if isinstance(self.task, CloudBlock) else self.task).numbers

    def single(self) -> Sequence["StoredTask | StudyTask"]:
        """What it is split into where it fails; the tables of these are handed over."""
        parts = self.task.single()
        return parts if len(parts) > 1 else [self]


@dataclass(frozen=True)
class Stored:
    """What comes back of a task whose results are on the disk."""

    rows: int
    """Of states."""


def solve_and_store(task: StoredTask | StudyTask) -> tuple[Columns, Columns] | SolvedCloudBlock | Stored:
    """Solve a task and put what comes of it on the disk, or return it as `solve_task` does."""
    if not isinstance(task, StoredTask):
        return solve_task(task)
    solved = solve_task(task.task)
    if not task.storage.seen:
        return solved
    try:
        return _put(task, solved)
    except EngineError:  # the process that gathers says so, if it cannot write either
        return solved


def _put(task: StoredTask, solved: tuple[Columns, Columns] | SolvedCloudBlock) -> Stored:
    home, number = task.storage.home, _number(task.task)
    if isinstance(solved, SolvedCloudBlock):
        known, states = solved.loads, solved.states
    else:
        known, states = solved
        place = np.searchsorted(known["case_id"], states["case_id"])
        known = known | {COUNT: np.bincount(place, minlength=len(known["case_id"]))}
        states = {name: values for name, values in states.items() if name != "case_id"}
    if task.with_states:
        write_block(home, task.stem, number, states)
    write_pending(home, task.stem, number, known)
    return Stored(len(states["step"]))


def fetched(task: StoredTask) -> Columns:
    """What a worker has put on the disk beside states: columns of loads, or of cases with their numbers of states.

    Raises
    ------
    EngineError
        If it is not there.
    """
    kept = read_pending(task.storage.home, task.stem, _number(task.task), states=False)
    if kept is None:
        what = "what workers have written there is gone or damaged"
        raise EngineError(Problem(str(task.storage.home), what))
    return kept[0]


def _number(task: Chunk | CloudBlock) -> int:
    return task.number if isinstance(task, CloudBlock) else 0
