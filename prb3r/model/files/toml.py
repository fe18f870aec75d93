"""Strict TOML: every problem of a file at once, each with its line and its key.

Models are pydantic models with `extra="forbid"`.  Text and truth values never pass for numbers, nan and inf never pass.
`tomllib` gives no positions, so a small scanner maps key paths, such as `("segment", 1, "thickness_m")`, to lines.
"""

import json
import math
import re
import tomllib
import types
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, RootModel, ValidationError

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.quantities import other_unit

Model = TypeVar("Model", bound=BaseModel)
Keys = tuple[str | int, ...]

_TEXT = r"\"\"\"(?:\\[\s\S]|[^\\])*?\"{3,5}|'''[\s\S]*?'{3,5}|\"(?:\\.|[^\"\\])*\"|'[^']*'"
_BLANK = re.compile(r"(?:[\s,]|#[^\n]*)*")
_KEY = re.compile(rf"\s*({_TEXT}|[\w-]+)\s*(\.?)")
_VALUE = re.compile(rf"{_TEXT}|[^\s,#\]}}][^,#\]}}\n]*")


def read(path: str | Path, model: type[Model], context: Any = None) -> Model:
    """The TOML file at `path` as an instance of `model`.

    Parameters
    ----------
    context
        Passed on to the validators of `model`.

    Raises
    ------
    SpecError
        With all problems of the file.
    """
    text = _text(Path(path))
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, _, place = str(error).removesuffix(")").partition(" (at line ")
        line = int(place.partition(",")[0] or text.count("\n") + 1)
        what = what.removesuffix(" (at end of document")
        raise SpecError(Problem(f"{path}:{line}", f"not valid TOML: {what[:1].lower()}{what[1:]}")) from None
    instance, found = validate(data, model, context)
    if instance is not None and not found:
        return instance
    lines = scan(text)
    places = sorted((_line(lines, keys), dotted(keys), what) for keys, what in found)
    raise SpecError(*(Problem(f"{path}:{line} {key}".rstrip(), what) for line, key, what in places))


def place(path: str | Path, keys: Keys) -> str:
    """Where a key stands in a readable TOML file, for a :class:`Problem`."""
    return f"{path}:{_line(scan(_text(Path(path))), keys)} {dotted(keys)}"


def dotted(keys: Keys) -> str:
    """`segment[1].thickness_m`."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")


def _text(path: Path) -> str:
    try:
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


# Positions ------------------------------------------------------------------------------------------------------------


def scan(text: str) -> dict[Keys, int]:
    """Line of every key, table and list element of a valid TOML text."""
    starts = [0, *(match.end() for match in re.finditer("\n", text))]
    lines: dict[Keys, int] = {}
    counts: dict[Keys, int] = {}

    def matched(pattern: re.Pattern, at: int) -> re.Match:
        match = pattern.match(text, at)
        assert match, f"valid TOML that the scanner cannot follow at character {at}"
        return match

    def note(keys: Keys, at: int) -> None:
        for length in range(1, len(keys) + 1):
            lines.setdefault(keys[:length], bisect_right(starts, at))

    def key(at: int) -> tuple[Keys, int]:
        parts: Keys = ()
        while True:
            match = matched(_KEY, at)
            quoted = match[1][0] in "\"'"
            parts, at = (*parts, next(iter(tomllib.loads(f"{match[1]}=0"))) if quoted else match[1]), match.end()
            if not match[2]:
                return parts, at

    def value(at: int, keys: Keys) -> int:
        if text[at] not in "[{":
            return matched(_VALUE, at).end()
        close, index = {"[": "]", "{": "}"}[text[at]], 0
        at = matched(_BLANK, at + 1).end()
        while text[at] != close:
            if close == "}":
                at = pair(at, keys)
            else:
                note((*keys, index), at)
                at, index = value(at, (*keys, index)), index + 1
            at = matched(_BLANK, at).end()
        return at + 1

    def pair(at: int, table: Keys) -> int:
        parts, end = key(at)
        note((*table, *parts), at)
        return value(matched(_BLANK, text.index("=", end) + 1).end(), (*table, *parts))

    def header(at: int) -> tuple[Keys, int]:
        depth = 2 if text.startswith("[[", at) else 1
        parts, end = key(at + depth)
        table: Keys = ()
        for number, part in enumerate(parts, 1):
            table = (*table, part)
            if depth == 2 and number == len(parts):
                counts[table] = counts.get(table, 0) + 1
            if table in counts:
                table = (*table, counts[table] - 1)
        note(table, at)
        return table, text.index("]", end) + depth

    table: Keys = ()
    at = matched(_BLANK, 0).end()
    while at < len(text):
        if text[at] == "[":
            table, at = header(at)
        else:
            at = pair(at, table)
        at = matched(_BLANK, at).end()
    return lines


def _line(lines: Mapping[Keys, int], keys: Keys) -> int:
    return next((lines[keys[:n]] for n in range(len(keys), 0, -1) if keys[:n] in lines), 1)


# Validation -----------------------------------------------------------------------------------------------------------


def validate(data: dict, model: type[Model], context: Any = None) -> tuple[Model | None, list[tuple[Keys, str]]]:
    """An instance of `model`, or all that keeps `data` from being one: key paths and what is wrong there."""
    instance: Model | None = None
    errors: list[Any] = []
    try:
        instance = model.model_validate(data, context=context)
    except ValidationError as invalid:
        errors += invalid.errors(include_url=False)
    try:
        model.model_validate_json(json.dumps(data, default=str), strict=True, context=context)
    except ValidationError as invalid:
        errors += _quiet_conversions(invalid.errors(include_url=False), data)
    infinite = dict(_infinite(data))
    found = {keys: [f"{value} is not allowed; write a finite number"] for keys, value in infinite.items()}
    places = [(_within(error["loc"], data, error["type"]), error) for error in errors]
    deepest = [keys for keys, error in places if len(keys) < len(error["loc"])]
    for keys, error in places:
        in_branch = len(keys) < len(error["loc"])
        beaten = in_branch and any(len(other) > len(keys) and other[: len(keys)] == keys for other in deepest)
        if not beaten and keys not in infinite:
            keys, what = _explain(keys, error, model, data)
            found.setdefault(keys, [])
            found[keys] += [what] * (what not in found[keys])
    return instance, [(keys, what) for keys, whats in found.items() for what in _merged(whats)]


def _quiet_conversions(errors: list[Any], data: dict) -> list[Any]:
    """Those strict errors that say text or a truth value would pass for a number, or the reverse."""
    wrong = {"float_type": (str, bool), "int_type": (str, bool), "bool_type": (str, int, float)}
    places = [_within(error["loc"], data, error["type"]) for error in errors]
    alone = [error for keys, error in zip(places, errors, strict=True) if places.count(keys) == 1]
    return [error for error in alone if isinstance(error["input"], wrong.get(error["type"], ()))]


def _infinite(value: Any, keys: Keys = ()) -> Iterator[tuple[Keys, float]]:
    if isinstance(value, float) and not math.isfinite(value):
        yield keys, value
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from _infinite(inner, (*keys, key))


def _within(loc: Keys, data: Any, kind: str) -> Keys:
    """The part of pydantic's `loc` that is in the file: without names of union branches and validators."""
    keys: Keys = ()
    for number, part in enumerate(loc, 1):
        inside = part in data if isinstance(data, dict) else isinstance(data, list) and part in range(len(data))
        if inside:
            data = data[part]
        if inside or (kind == "missing" and number == len(loc)):
            keys = (*keys, part)
    return keys


def _merged(whats: list[str]) -> list[str]:
    """What a value may be, in one sentence where the branches of a union say it in several."""
    choices = [match for what in whats if (match := re.fullmatch(r"must be (.*?)(, not .*)", what))]
    if len(choices) < 2:
        return whats
    sentence = f"must be {' or '.join(dict.fromkeys(choice[1] for choice in choices))}{choices[0][2]}"
    return [sentence, *(what for what in whats if what not in {choice[0] for choice in choices})]


_MUST_BE = {
    r"float_.*|decimal_.*|complex_.*": "a number",
    r"finite_number": "a finite number",
    r"int_.*": "a whole number",
    r"string_(type|sub_type|unicode)": "text",
    r"bool_.*": "true or false",
    r"(list|tuple|set|frozen_set|iterable|sequence)_type": "a list",
    r"model_.*|dict_.*|mapping_.*|dataclass_.*": "a table",
    r"greater_than": "greater than {gt}",
    r"greater_than_equal": "at least {ge}",
    r"less_than": "less than {lt}",
    r"less_than_equal": "at most {le}",
    r"multiple_of": "a multiple of {multiple_of}",
    r"literal_error|enum": "{expected}",
    r"too_short": "a list of at least {min_length}",
    r"too_long": "a list of at most {max_length}",
    r"string_too_short": "text of at least {min_length} characters",
    r"string_too_long": "text of at most {max_length} characters",
    r"string_pattern_mismatch": "text like {pattern}",
}


def _explain(keys: Keys, error: dict, model: type[BaseModel], data: dict) -> tuple[Keys, str]:
    """Where to look, and pydantic's error in an engineer's words."""
    kind, context, value = error["type"], error.get("ctx", {}), error["input"]
    if kind == "missing":
        return keys[:-1], f"{keys[-1]!r} is missing"
    if kind == "extra_forbidden":
        key, valid = str(keys[-1]), _valid_keys(model, keys[:-1], data)
        unit = other_unit(key, valid)
        return keys, f"unknown key {key!r}" + (f": {unit}" if unit else did_you_mean(key, valid))
    if kind == "union_tag_not_found":
        return keys, f"{context['discriminator']} is missing"
    if kind == "union_tag_invalid":
        name = context["discriminator"].strip("'")
        options = re.findall(r"'([^']*)'", context["expected_tags"])
        return (*keys, name), f"unknown {name} {context['tag']!r}{did_you_mean(str(context['tag']), options)}"
    if kind in {"value_error", "assertion_error"}:
        return keys, str(context["error"]) or error["msg"]
    for pattern, words in _MUST_BE.items():
        if re.fullmatch(pattern, kind):
            numbers = {name: f"{number:g}" for name, number in context.items() if isinstance(number, float)}
            return keys, f"must be {words.format(**context | numbers)}, not {_shown(value)}"
    return keys, f"{error['msg'][:1].lower()}{error['msg'][1:]}, not {_shown(value)}"


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return "a table"
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."


# What a model accepts -------------------------------------------------------------------------------------------------


def _valid_keys(model: type[BaseModel], keys: Keys, data: Any) -> list[str]:
    """Keys that the table at `keys` may have."""
    kinds = [model]
    for key in keys:
        kinds, data = [branch for kind in _fitting(kinds, data) for branch in _inside(kind, key)], data[key]
    fields = [kind.model_fields for kind in _fitting(kinds, data) if _is_model(kind)]
    return [field.alias or name for branch in fields for name, field in branch.items()]


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _inside(kind: Any, key: str | int) -> list[Any]:
    """Kinds that the element or field `key` of a `kind` may have, unions taken apart."""
    if _is_model(kind):
        named = [field.annotation for name, field in kind.model_fields.items() if key in (name, field.alias)]
        return [branch for annotation in named for branch in _branches(annotation)]
    arguments = get_args(kind)[1:] if isinstance(key, str) else get_args(kind)
    return [branch for argument in arguments for branch in _branches(argument)]


def _branches(kind: Any) -> list[Any]:
    if get_origin(kind) is Annotated:
        return _branches(get_args(kind)[0])
    if get_origin(kind) in (Union, types.UnionType):
        return [branch for argument in get_args(kind) for branch in _branches(argument)]
    if _is_model(kind) and issubclass(kind, RootModel):
        return _branches(kind.model_fields["root"].annotation)
    return [kind]


def _fitting(kinds: list[Any], data: Any) -> list[Any]:
    """Those models whose literal fields (such as `kind`) agree with the table, if there are any."""

    def agrees(kind: Any) -> bool:
        fields = kind.model_fields.items() if _is_model(kind) and isinstance(data, dict) else ()
        literals = {name: get_args(f.annotation) for name, f in fields if get_origin(f.annotation) is Literal}
        return all(data[name] in options for name, options in literals.items() if name in data)

    return [kind for kind in kinds if agrees(kind)] or kinds
