"""How many tasks of one kind are run: one after the other in this process, or in worker processes."""

from collections.abc import Callable, Sequence
from typing import Any

Apply = Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]
"""Applies a function to every task, in this process or in workers; returns the results in the order of the tasks."""


def serially(function: Callable[[Any], Any], tasks: Sequence[Any]) -> list[Any]:
    """Results of the function for all tasks, one after the other in this process."""
    return [function(task) for task in tasks]
