"""Where many tasks of one kind are done: here, or in worker processes."""

from collections.abc import Callable, Sequence
from typing import Any

Apply = Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]
"""Applies a function to many tasks, here or in workers, and returns what it returned in their order."""


def serially(function: Callable[[Any], Any], tasks: Sequence[Any]) -> list[Any]:
    """The function of each task, one after the other in this process."""
    return [function(task) for task in tasks]
