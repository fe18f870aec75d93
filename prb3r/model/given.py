"""Arguments that stand for a manipulator: the manipulator itself, the path of its file, or what the file would hold."""

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
    """The manipulator for which an argument stands: read from its file if a path is given, validated if plain data are.

    Raises
    ------
    SpecError
        With every problem of the file or the data, or if the argument is of another type.
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
    """Decorator: `function`, whose first argument is a manipulator, accepts all that `manipulator_of` does."""

    @wraps(function)
    def entrance(manipulator: Given, *args: _P.args, **kwargs: _P.kwargs) -> _R:
        return function(manipulator_of(manipulator), *args, **kwargs)

    return entrance
