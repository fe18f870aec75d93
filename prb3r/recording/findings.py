"""Problems and remarks that are collected while a recording is read."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from prb3r.errors import Problem, SpecError

_T = TypeVar("_T")


@dataclass
class Findings:
    """Problems that forbid the use of a recording, and remarks on what reading repaired, counted or assumed."""

    problems: list[Problem] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    def tried(self, read: Callable[[], _T]) -> _T | None:
        """What `read` returns; if it raises SpecError, None, and its problems are added to these."""
        try:
            return read()
        except SpecError as error:
            self.problems += error.problems
            return None
