"""The data that describe tasks for workers and their outcomes."""

from dataclasses import dataclass
from typing import Any, Literal

Fate = Literal["done", "raised", "crashed"]
"""Outcome of a task: its function returned, raised an error, or lost its worker."""


@dataclass(frozen=True)
class Piece:
    """Outcome of a task, or of one part of a task that had to be split."""

    task: Any
    fate: Fate
    value: Any = None
    """What the function returned, if the fate is `done`."""
    reason: str = ""
    """Why there is no value, in one line, if the fate is another one."""


@dataclass(frozen=True)
class Workers:
    """Where tasks run: processes on this machine, or a dask cluster."""

    backend: Literal["loky", "dask"] = "loky"
    jobs: int = 1
    """Number of worker processes on this machine, for loky."""
    scheduler: str | None = None
    """Address of the scheduler, for dask: `tcp://host:8786`."""


ONE_PROCESS = Workers()
"""A single worker on this machine."""


@dataclass(eq=False)
class Job:
    """A task, or a part of a split task, that waits for a worker or is run by one."""

    number: int
    """Number of the whole task."""
    part: int | None
    """Number of the part, from 0, in a task that was split; None: the whole task."""
    task: Any
    """What is given to the function."""
    deaths: int = 0
    """Number of workers that died on this job while it ran alone."""
