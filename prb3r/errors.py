"""Errors that keep every problem they stand for, so that a user repairs all of them in one go."""

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import ClassVar

SHORT_LIST = 8
"""Up to this many valid names are listed in full when none of them is close."""


@dataclass(frozen=True)
class Problem:
    """Something that is wrong with an input, and where: a file with its line, a column, an address."""

    where: str
    """Place as a person would look for it: `studies/x.toml:12 factor[0].values`."""
    what: str
    """What is wrong and what would be right."""

    def __str__(self) -> str:
        return f"{self.where}: {self.what}" if self.where else self.what


class Prb3rError(Exception):
    """Base of all errors a user is meant to read; its text lists the problems, one a line."""

    exit_code: ClassVar[int] = 2

    def __init__(self, *problems: Problem) -> None:
        super().__init__(*problems)

    @property
    def problems(self) -> tuple[Problem, ...]:
        return self.args

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))


class SpecError(Prb3rError):
    """A manipulator, study or step table that cannot be used."""


class RecordingError(Prb3rError):
    """A recording that cannot be used, with every problem of its files."""


class EngineError(Prb3rError):
    """The machinery that runs or stores cases failed, not a case."""

    exit_code: ClassVar[int] = 3


def did_you_mean(word: str, options: Iterable[str]) -> str:
    """Ending for a message about an unknown `word`: the closest option, else all of them if they are few."""
    names = sorted(set(options))
    lower = {name.lower(): name for name in names}
    close = get_close_matches(word.lower(), lower, n=1)
    if close:
        return f"; did you mean {lower[close[0]]!r}?"
    return f"; valid: {', '.join(names)}" if 0 < len(names) <= SHORT_LIST else ""
