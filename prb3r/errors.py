"""Errors that carry a list of problems, so that a user can repair all of them in one go."""

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import ClassVar

SHORT_LIST = 8
"""Most valid names that a message lists in full when none of them is close."""


@dataclass(frozen=True)
class Problem:
    """Something that is wrong with an input, with its place: a file with its line, a column, an address."""

    where: str
    """The place, as a person would look for it: `studies/x.toml:12 factor[0].values`; may be empty."""
    what: str
    """What is wrong there, and what would be right."""

    def __str__(self) -> str:
        return f"{self.where}: {self.what}" if self.where else self.what


class Prb3rError(Exception):
    """Base of all errors that a user is meant to read; the text lists the problems, one per line."""

    exit_code: ClassVar[int] = 2

    def __init__(self, *problems: Problem) -> None:
        super().__init__(*problems)

    @property
    def problems(self) -> tuple[Problem, ...]:
        return self.args

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))


class SpecError(Prb3rError):
    """A manipulator, a study, a table of steps or an argument that cannot be used, with every problem."""


class RecordingError(Prb3rError):
    """A recording that cannot be used, with every problem of its files."""


class EngineError(Prb3rError):
    """A failure of what runs or stores cases, such as workers or the disk, and not of a case."""

    exit_code: ClassVar[int] = 3


def did_you_mean(word: str, options: Iterable[str]) -> str:
    """Ending of a message about an unknown `word`: the closest option, or all options if they are few, or empty."""
    names = sorted(set(options))
    lower = {name.lower(): name for name in names}
    close = get_close_matches(word.lower(), lower, n=1)
    if close:
        return f"; did you mean {lower[close[0]]!r}?"
    return f"; valid: {', '.join(names)}" if 0 < len(names) <= SHORT_LIST else ""
