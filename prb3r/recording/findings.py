"""What reading a recording brings to light."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from prb3r.errors import Problem, SpecError

_T = TypeVar("_T")


@dataclass
class Findings:
    """Problems that forbid the use of a recording, and remarks on what was repaired, counted or taken for granted."""

    problems: list[Problem] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    def tried(self, read: Callable[[], _T]) -> _T | None:
        """What `read` returns, or None where it refuses; its problems are kept."""
        try:
            return read()
        except SpecError as error:
            self.problems += error.problems
            return None
