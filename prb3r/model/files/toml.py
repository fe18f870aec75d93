"""Strict TOML: reading a file into a pydantic model, with all its problems at once, each with line and key; writing.

Models are pydantic models with `extra="forbid"`.
"""

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import tomli_w
from pydantic import BaseModel

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.model.files.kinds import with_article, wrong_kind
from prb3r.model.files.place import TABLE_SUFFIXES, refusal_of_place
from prb3r.model.files.plain import plain
from prb3r.model.files.toml_lines import Keys, dotted, line_of, lines_of_keys
from prb3r.model.files.toml_syntax import what_is_wrong
from prb3r.model.files.validation import validate

MOST_NESTED = 20
"""Most levels of nested tables and lists; a manipulator with effects has five."""
MOST_BYTES = 2**24
"""Most bytes of a file."""
_Model = TypeVar("_Model", bound=BaseModel)


def read_toml(path: str | Path, model: type[_Model]) -> _Model:
    """The TOML file at `path` as an instance of `model`.

    Raises
    ------
    SpecError
        With all problems of the file.
    """
    kind = model.__name__.removesuffix("File").lower().replace("wishes", "requirements")
    if Path(path).suffix.lower() in TABLE_SUFFIXES:
        raise SpecError(Problem(str(path), f"is a table; {with_article(kind)} is a .toml file"))
    text = _text(Path(path))
    try:
        data = tomllib.loads(text)
        if _deeper(data, MOST_NESTED):
            raise RecursionError
    except RecursionError:
        raise SpecError(Problem(str(path), f"tables and lists are nested more than {MOST_NESTED} deep")) from None
    except ValueError as error:
        line, what = what_is_wrong(error, text)
        raise SpecError(Problem(f"{path}:{line}", f"not valid TOML: {what}")) from None
    instance, wrong = validate(data, model)
    if instance is not None and not wrong:
        return instance
    if not data:
        needed = ", ".join(repr(name) for name, field in model.model_fields.items() if field.is_required())
        raise SpecError(Problem(str(path), f"is empty; {with_article(kind)} begins with {needed}"))
    if what := wrong_kind(data, kind):
        raise SpecError(Problem(str(path), what))
    lines = lines_of_keys(text)
    places = sorted((line_of(lines, keys), dotted(keys, data), what) for keys, what in wrong)
    raise SpecError(*(Problem(f"{path}:{line} {key}".rstrip(), what) for line, key, what in places))


def toml_contents(path: Path) -> dict[str, Any] | None:
    """What a TOML file holds; None if it cannot be read, of which :func:`read_toml` says what is wrong."""
    try:
        return tomllib.loads(path.read_text("utf-8-sig")) if path.is_file() else None
    except (OSError, ValueError, RecursionError):
        return None


def place_of(path: str | Path, keys: Keys) -> str:
    """The place of a key in a readable TOML file, as `file:line key`, for a :class:`Problem`."""
    text = _text(Path(path))
    return f"{path}:{line_of(lines_of_keys(text), keys)} {dotted(keys, tomllib.loads(text))}"


def toml_text(data: Mapping[str, Any]) -> str:
    """TOML text that reads back as `data`, except for absent values (None), which are left out.

    Raises
    ------
    TypeError
        For a value of a type that TOML does not have.
    """
    return tomli_w.dumps(plain(data))


def _deeper(data: Any, most: int) -> bool:
    """Whether plain data has more than `most` levels of nested tables and lists."""
    level = [data]
    for _ in range(most):
        level = [inner for part in level for inner in _inner(part)]
        if not level:
            return False
    return True


def _inner(part: Any) -> Iterable[Any]:
    """The values of a table or the elements of a list; nothing for other data."""
    return part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()


def _text(path: Path) -> str:
    """The text of a file; raises SpecError if it cannot be read, for any reason."""
    try:
        if (what := refusal_of_place(path, MOST_BYTES)) is not None:
            raise SpecError(Problem(str(path), what))
        return path.read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
    except FileNotFoundError:
        others = [other.name for other in path.parent.glob("*.toml")] if path.parent.is_dir() else []
        what = "no such file" + did_you_mean(path.name, others)
    except IsADirectoryError:
        what = "is a folder, not a TOML file"
    except UnicodeDecodeError as error:
        what = f"is not UTF-8 text (line {error.object[: error.start].count(10) + 1})"
    except OSError as error:
        what = f"cannot be read: {str(error.strerror).lower()}"
    raise SpecError(Problem(str(path), what))
