"""What runs in a worker around every task."""

from collections.abc import Callable
from typing import Any

from prb3r.runs.tasks import Fate


def shielded(function: Callable, task: Any) -> tuple[Fate, Any]:
    """What became of a task, with one thread: its value if it is done, else the reason in one line."""
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
