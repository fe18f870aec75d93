"""What may stand where a manipulator is meant: the manipulator, its file, or what the file would hold."""

from collections.abc import Callable, Mapping
from functools import wraps
from os import PathLike
from typing import Any, Concatenate, ParamSpec, TypeVar

from prb3r.errors import Problem, SpecError
from prb3r.model.files.plain import plain
from prb3r.model.files.validation import validated
from prb3r.model.manipulator import Manipulator, load_manipulator

Given = Manipulator | Mapping[str, Any] | str | PathLike[str]
_P = ParamSpec("_P")
_R = TypeVar("_R")


def manipulator_of(given: Given) -> Manipulator:
    """The manipulator that is given, read from its file if it is a path and checked if it is plain data.

    Raises
    ------
    SpecError
        With everything that is wrong with the file or the data; for anything else what is meant.
    """
    if isinstance(given, Manipulator):
        return given
    if isinstance(given, str | PathLike):
        return load_manipulator(given)  # type: ignore[arg-type]
    if isinstance(given, Mapping):
        return validated(plain(given), Manipulator)
    what = f"a Manipulator, the path of its file or a dict of what that holds is meant, not {type(given).__name__}"
    raise SpecError(Problem("manipulator", what))


def of_given(function: Callable[Concatenate[Manipulator, _P], _R]) -> Callable[Concatenate[Given, _P], _R]:
    """`function`, whose first argument may be all that stands for a manipulator."""

    @wraps(function)
    def entrance(manipulator: Given, *args: _P.args, **kwargs: _P.kwargs) -> _R:
        return function(manipulator_of(manipulator), *args, **kwargs)

    return entrance
