"""Line numbers of the keys of a TOML file, which `tomllib` does not provide, and keys written as dotted paths."""

import re
import tomllib
from bisect import bisect_right
from collections.abc import Mapping
from typing import Any

Keys = tuple[str | int, ...]
"""Path of keys into a file, such as `("segment", 1, "thickness_m")`."""

_TEXT = r"\"\"\"(?:\\[\s\S]|[^\\])*?\"{3,5}|'''[\s\S]*?'{3,5}|\"(?:\\.|[^\"\\])*\"|'[^']*'"
_BLANK = re.compile(r"(?:[\s,]|#[^\n]*)*")
_KEY = re.compile(rf"\s*({_TEXT}|[\w-]+)\s*(\.?)")
_VALUE = re.compile(rf"{_TEXT}|[^\s,#\]}}][^,#\]}}\n]*")


def lines_of_keys(text: str) -> dict[Keys, int]:
    """Line number, from 1, of every key, table and list element of a valid TOML text."""
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


def line_of(lines: Mapping[Keys, int], keys: Keys) -> int:
    """The line of `keys`, or else of the innermost table around them that the file has; 1 if it has none."""
    return next((lines[keys[:n]] for n in range(len(keys), 0, -1) if keys[:n] in lines), 1)


def dotted(keys: Keys, data: Any = None) -> str:
    """Keys written as a path of a study: `("segment", 1, "thickness_m")` is `segment.2.thickness_m`.

    Parameters
    ----------
    data : the data to which the keys belong; list elements that have a `name` there are written by that name instead of
        their number.
    """
    parts = []
    for key in keys:
        data = data[key] if _has(data, key) else None
        name = data.get("name") if isinstance(key, int) and isinstance(data, dict) else None
        named = isinstance(name, str) and re.fullmatch(r"[\w-]+", name)
        parts.append(str(name if named else key + 1 if isinstance(key, int) else key))
    return ".".join(parts)


def _has(data: Any, key: str | int) -> bool:
    return (isinstance(data, dict) and key in data) or (isinstance(data, list) and key in range(len(data)))
