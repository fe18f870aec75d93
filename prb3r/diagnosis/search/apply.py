"""Where many tasks of one kind are done: here, or in worker processes."""

from collections.abc import Callable, Sequence
from typing import Any

Apply = Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]
"""Applies a function to many tasks, here or in workers, and returns what it returned in their order."""


def serially(function: Callable[[Any], Any], tasks: Sequence[Any]) -> list[Any]:
    """One after the other, here."""
    return [function(task) for task in tasks]
