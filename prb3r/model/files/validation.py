"""Validation of plain data by a pydantic model, with all problems in an engineer's words.

Text and truth values are never taken for numbers, and nan and inf are refused.
"""

import json
import math
import re
from collections.abc import Iterator
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.model.files.toml_lines import Keys, dotted
from prb3r.model.files.valid_keys import valid_keys
from prb3r.quantities import other_unit

_Model = TypeVar("_Model", bound=BaseModel)


class KeyedError(ValueError):
    """An error for a model's validator to raise, with several problems inside its table: pairs of keys and message."""

    def __init__(self, *places: tuple[Keys, str]) -> None:
        super().__init__(*places)

    @property
    def places(self) -> tuple[tuple[Keys, str], ...]:
        """For each problem its keys, relative to the validated table, and its message."""
        return self.args

    def __str__(self) -> str:
        return "; ".join(what for _, what in self.places)


def validated(data: dict, model: type[_Model]) -> _Model:
    """An instance of `model` from plain data.

    Raises
    ------
    SpecError
        With every problem of the data, each with its dotted path.
    """
    instance, wrong = validate(data, model)
    if instance is None or wrong:
        raise SpecError(*(Problem(dotted(keys, data), what) for keys, what in wrong))
    return instance


def validate(data: dict, model: type[_Model]) -> tuple[_Model | None, list[tuple[Keys, str]]]:
    """An instance of `model` from plain `data`, or None, and all problems of the data: pairs of keys and message.

    Both come back where pydantic converts a value that this package refuses.
    """
    instance: _Model | None = None
    errors: list[Any] = []
    try:
        instance = model.model_validate(data)
    except ValidationError as invalid:
        errors += [part for error in invalid.errors(include_url=False) for part in _taken_apart(error)]
    try:
        model.model_validate_json(json.dumps(data, default=str), strict=True)
    except ValidationError as invalid:
        errors += _quiet_conversions(invalid.errors(include_url=False), data)
    infinite = dict(_infinite(data))
    wrong = {keys: [f"{_shown(value)} is not allowed; write a finite number"] for keys, value in infinite.items()}
    places = [(_within(error["loc"], data, error["type"]), error) for error in errors]
    deepest = [keys for keys, error in places if len(keys) < len(error["loc"])]
    for keys, error in places:
        in_branch = len(keys) < len(error["loc"])
        beaten = in_branch and any(len(other) > len(keys) and other[: len(keys)] == keys for other in deepest)
        if not beaten and keys not in infinite:
            keys, what = _explain(keys, error, model, data)
            wrong.setdefault(keys, [])
            wrong[keys] += [what] * (what not in wrong[keys])
    return instance, [(keys, what) for keys, whats in wrong.items() for what in _merged(whats)]


def _taken_apart(error: Any) -> Iterator[Any]:
    """A pydantic error taken apart: one error for each problem of a `KeyedError`, else the error itself."""
    cause = error.get("ctx", {}).get("error")
    for keys, what in cause.places if isinstance(cause, KeyedError) else ():
        yield {**error, "loc": (*error["loc"], *keys), "ctx": {"error": ValueError(what)}}
    if not isinstance(cause, KeyedError):
        yield error


def _quiet_conversions(errors: list[Any], data: dict) -> list[Any]:
    """Those errors of strict validation where text or a truth value would be converted to a number, or the reverse.

    Errors that share their place with others, as in a union, are left out.
    """
    wrong = {"float_type": (str, bool), "int_type": (str, bool), "bool_type": (str, int, float)}
    places = [_within(error["loc"], data, error["type"]) for error in errors]
    alone = [error for keys, error in zip(places, errors, strict=True) if places.count(keys) == 1]
    return [error for error in alone if isinstance(error["input"], wrong.get(error["type"], ()))]


def _infinite(value: Any, keys: Keys = ()) -> Iterator[tuple[Keys, float]]:
    """Keys and value of every number within plain data that is not finite."""
    if isinstance(value, float | int) and not _finite(value):
        yield keys, value
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from _infinite(inner, (*keys, key))


def _finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False


def _within(loc: Keys, data: Any, kind: str) -> Keys:
    """The keys of `data` in pydantic's `loc` of an error, without its names of union branches and validators.

    `kind` is the type of the error; of a missing key the last part is kept.
    """
    keys: Keys = ()
    for number, part in enumerate(loc, 1):
        inside = part in data if isinstance(data, dict) else isinstance(data, list) and part in range(len(data))
        if inside:
            data = data[part]
        if inside or (kind == "missing" and number == len(loc)):
            keys = (*keys, part)
    return keys


def _merged(whats: list[str]) -> list[str]:
    """The messages on one value, with those of the form "must be ..., not ..." merged into one, as the branches of a
    union cause several of them."""
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


_PATTERNS = {
    r"^[a-z0-9-]+$": "lower-case letters, digits and hyphens",
    r"^[a-z0-9][a-z0-9-]*$": "lower-case letters, digits and hyphens, no hyphen first",
    r"^[A-Za-z][A-Za-z0-9_]*$": "letters, digits and underscores, a letter first",
}
"""Patterns of names in words."""


def _explain(keys: Keys, error: dict, model: type[BaseModel], data: dict) -> tuple[Keys, str]:
    """The keys at which to look, and a pydantic error in an engineer's words."""
    kind, context, value = error["type"], error.get("ctx", {}), error["input"]
    if kind == "missing":
        return keys[:-1], f"{keys[-1]!r} is missing"
    if kind == "extra_forbidden":
        key, valid = str(keys[-1]), valid_keys(model, keys[:-1], data)
        unit = other_unit(key, valid)
        return keys, f"unknown key {key!r}" + (f": {unit}" if unit else _instead(key, valid, keys[:-1], model, data))
    if kind == "union_tag_not_found":
        return keys, f"{context['discriminator']} is missing"
    if kind == "union_tag_invalid":
        name = context["discriminator"].strip("'")
        options = re.findall(r"'([^']*)'", context["expected_tags"])
        hint = did_you_mean(str(context["tag"]), options) or f"; valid: {', '.join(options)}"
        return (*keys, name), f"unknown {name} {context['tag']!r}{hint}"
    if kind in {"value_error", "assertion_error"}:
        return keys, str(context["error"]) or error["msg"]
    for pattern, words in _MUST_BE.items():
        if re.fullmatch(pattern, kind):
            numbers = {name: f"{number:g}" for name, number in context.items() if isinstance(number, float)}
            must_be = _PATTERNS.get(context.get("pattern", ""), words.format(**context | numbers))
            return keys, f"must be {must_be}, not {_shown(value)}"
    return keys, f"{error['msg'][:1].lower()}{error['msg'][1:]}, not {_shown(value)}"


def _instead(key: str, valid: list[str], keys: Keys, model: type[BaseModel], data: Any) -> str:
    """Ending of a message about an unknown `key` of the table at `keys`: the closest valid key.

    If a table of another kind may have the key, all keys of the table's own kind are listed instead.
    """
    table = data
    for part in keys:
        table = table[part]
    if "kind" in table and key in valid_keys(model, keys, data, any_kind=True):
        return f"; kind {table['kind']!r} takes {', '.join(name for name in valid if name != 'kind')}"
    return did_you_mean(key, valid)


def _shown(value: Any) -> str:
    """A value as it is shown in a message, cut to 60 characters."""
    if isinstance(value, dict):
        return "a table"
    text = str(value) if isinstance(value, float) else json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."
