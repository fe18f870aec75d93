"""Paths to the parts and values of a manipulator, such as `segment.1.thickness_m`: finding, reading and replacing them.

Names are separated by dots.  Cables are addressed by name, which may hold dots itself, elements of all other lists
(segments, effects, listed offsets) by number from 1.
"""

from collections.abc import Collection
from typing import Any

from pydantic import BaseModel

from prb3r.errors import did_you_mean
from prb3r.model.files.toml_lines import Keys


def keys_of_path(manipulator: BaseModel, path: str) -> Keys:
    """Keys and indices (from 0) that lead to what `path` names; an optional value there may be absent (None).

    Raises
    ------
    ValueError
        If there is no such part.
    """
    keys: Keys = ()
    node: Any = manipulator
    for part in parts_of_path(path, [cable.name for cable in getattr(manipulator, "cable", ())]):
        if isinstance(node, BaseModel):
            require_known(part, type(node).model_fields, f"{path}: there is no")
            keys, node = (*keys, part), getattr(node, part)
        elif isinstance(node, list) and node and "ends_at_segment" in getattr(type(node[0]), "model_fields", ()):
            names = [cable.name for cable in node]
            require_known(part, names, f"{path}: there is no cable")
            keys, node = (*keys, names.index(part)), node[names.index(part)]
        elif isinstance(node, list):
            if not part.isdigit() or not 1 <= int(part) <= len(node):
                raise ValueError(f"{path}: {no_number(part, len(node), keys[-1])}")
            keys, node = (*keys, int(part) - 1), node[int(part) - 1]
        else:
            raise ValueError(f"{path} leads into a plain value at {part!r}")
    return keys


def no_number(part: str, count: int, of: str | int) -> str:
    """What is said of a `part` of a path that is no number of the `count` parts in the list `of`."""
    return f"{part!r} is not a number from 1 to {count}" if count else f"there is no {of} {part}, nor any other"


def parts_of_path(path: str, cables: Collection[str]) -> list[str]:
    """The parts between the dots of a path; of what follows `cable.`, the longest of the names `cables` that fits is
    one part."""
    if not path.startswith("cable."):
        return path.split(".")
    rest = path.removeprefix("cable.")
    named = [name for name in cables if rest == name or rest.startswith(f"{name}.")]
    if not named:
        return path.split(".")
    name = max(named, key=len)
    return ["cable", name, *rest[len(name) :].split(".")[1:]]


def require_known(part: str, valid: Collection[str], what: str) -> None:
    """Raise an error if a part of a path is not among the valid ones.

    Raises
    ------
    ValueError
        With a message that begins with `what` and ends with the closest valid part.
    """
    if part not in valid:
        raise ValueError(f"{what} {part!r}{did_you_mean(part, valid)}")


def value_at(node: Any, keys: Keys) -> Any:
    """The part or value of a manipulator to which `keys` lead."""
    for key in keys:
        node = node[key] if isinstance(key, int) else getattr(node, key)
    return node


def with_value(node: Any, keys: Keys, value: Any) -> Any:
    """A copy of a model or of plain data in which `value` stands at `keys`; it is not validated.

    Parts that do not change are shared with the original.
    """
    if not keys:
        return value
    key, inner = keys[0], keys[1:]
    if isinstance(node, dict):
        return node | {key: with_value(node.get(key), inner, value)}
    if isinstance(key, int):
        return [*node[:key], with_value(node[key], inner, value), *node[key + 1 :]]
    return node.model_copy(update={key: with_value(getattr(node, key), inner, value)})
