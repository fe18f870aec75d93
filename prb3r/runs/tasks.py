"""What is done by workers and what became of it."""

from dataclasses import dataclass
from typing import Any, Literal

Fate = Literal["done", "raised", "crashed"]


@dataclass(frozen=True)
class Piece:
    """What became of a task, or of one part of a task that had to be split."""

    task: Any
    fate: Fate
    value: Any = None
    """What the function returned, if done."""
    reason: str = ""
    """One line, if not."""


@dataclass(frozen=True)
class Workers:
    """Who does the work: processes on this machine or a cluster."""

    backend: Literal["loky", "dask"] = "loky"
    jobs: int = 1
    """Number of worker processes on this machine, for loky."""
    scheduler: str | None = None
    """Address, for dask: `tcp://host:8786`."""


ONE_PROCESS = Workers()
"""A single worker on this machine."""


@dataclass(eq=False)
class Job:
    """A task, or a part of one, on its way; `number` is that of the task."""

    number: int
    part: int | None
    """Which part of a task that was split; None: the whole task."""
    task: Any
    deaths: int = 0
    """Workers lost to it while it ran alone."""
