"""Plain data as TOML text."""

import json
from collections.abc import Iterator, Mapping
from typing import Any


def toml_text(data: Mapping[str, Any]) -> str:
    """TOML that reads back as `data`: numbers, text, truth values, lists and tables; absent values (None) are left out.

    Raises
    ------
    TypeError
        For anything else.
    """
    return "\n".join(_table(data, ())).strip() + "\n"


def _table(data: Mapping[str, Any], keys: tuple[str, ...]) -> Iterator[str]:
    inner = {name: value for name, value in data.items() if isinstance(value, Mapping) or _is_tables(value)}
    for name, value in data.items():
        if value is not None and name not in inner:
            yield f"{_key(name)} = {_value(value)}"
    for name, value in inner.items():
        path = (*keys, name)
        header = ".".join(map(_key, path))
        for table in [value] if isinstance(value, Mapping) else value:
            yield f"\n[{header}]" if isinstance(value, Mapping) else f"\n[[{header}]]"
            yield from _table(table, path)


def _is_tables(value: Any) -> bool:
    return isinstance(value, list | tuple) and bool(value) and all(isinstance(each, Mapping) for each in value)


def _key(name: str) -> str:
    plain = name.replace("_", "").replace("-", "")
    return name if plain.isascii() and plain.isalnum() else _value(name)


def _value(value: Any) -> str:
    if isinstance(value, bool | int | str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(k)} = {_value(v)}' for k, v in value.items() if v is not None)} }}"
    raise TypeError(f"{value!r} has no place in a TOML file")
