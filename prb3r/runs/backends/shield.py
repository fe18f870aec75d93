"""The wrapper that runs every task in a worker and turns its errors into data."""

from collections.abc import Callable
from typing import Any

from prb3r.runs.tasks import Fate


def shielded(function: Callable, task: Any) -> tuple[Fate, Any]:
    """`("done", value)` of a task, or `("raised", reason)` with the error in one line.

    It limits the worker to one thread of linear algebra, for good.
    """
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)
    try:
        return "done", function(task)
    except Exception as error:
        return "raised", reason_of(error)


def reason_of(error: BaseException) -> str:
    """An error in one line of at most 300 characters: its kind and the first line of its message."""
    first = next(iter(str(error).splitlines()), "")
    return f"{type(error).__name__}: {first}"[:300].removesuffix(": ")
