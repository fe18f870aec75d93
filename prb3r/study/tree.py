"""The tree of plain values that describes a case, and the paths by which factors set values in it.

A changed tree has new containers along the path and shares all others with the old tree, so that many cases take little
more memory than the values in which they differ.
"""

from typing import Any

from prb3r.errors import did_you_mean
from prb3r.model.paths import no_number, parts_of_path

Tree = dict[str, Any]
"""Nested dicts and lists of plain values."""
LOAD_PARTS = ("initial", "step", "sweep", "cloud", "reach", "broken")
"""Entries of the tree besides `manipulator`; a path that begins with none of them leads into the manipulator."""
BEFORE_NAMES = {"initial": 1, "step": 2, "cloud": 2}
"""Number of keys before the names of loads and of cables in these entries, which may hold dots themselves."""


def with_setting(settings: Tree, path: str, value: Any) -> Tree:
    """A copy of the settings with `value` at `path`; the given settings stay as they are.

    Raises
    ------
    KeyError
        If the path leads to no place in the settings.
    """
    return _replaced(settings, _parts(settings, path), value, path)


def setting_at(settings: Tree, path: str) -> Any:
    """The value at `path`.

    Raises
    ------
    KeyError
        If there is no value at `path`.
    """
    *before, last = _parts(settings, path)
    tree: Any = settings
    for part in before:
        tree = _inner(tree, part, path)
    container, key = _enter(tree, last, path)
    if isinstance(container, dict) and key not in container:
        raise KeyError(f"path {path!r} has no value to take a ratio of")
    return container[key]


def _parts(settings: Tree, path: str) -> list[str]:
    """The keys along a path, beginning with an entry of the tree: `manipulator` or one of `LOAD_PARTS`."""
    path = path.removeprefix("manipulator.")
    first = path.partition(".")[0]
    if first in LOAD_PARTS:
        return path.split(".", BEFORE_NAMES.get(first, -1))
    cables = settings["manipulator"]["cable"]
    names = [cable["name"] for cable in cables if "name" in cable] if isinstance(cables, list) else []
    return ["manipulator", *parts_of_path(path, names)]


def _replaced(tree: Any, parts: list[str], value: Any, path: str) -> Any:
    """A copy of `tree` with `value` at `parts`; `path` is the whole path, for messages."""
    container, key = _enter(tree, parts[0], path)
    new = _replaced(_inner(tree, parts[0], path), parts[1:], value, path) if len(parts) > 1 else value
    if isinstance(container, dict):
        return container | {key: new}
    return [*container[:key], new, *container[key + 1 :]]


def _inner(tree: Any, part: str, path: str) -> Any:
    """The value at `part` of a path in `tree`; raises KeyError, with the nearest name, where there is none."""
    container, key = _enter(tree, part, path)
    if isinstance(container, dict) and key not in container:
        raise KeyError(f"path {path!r}: there is no {part!r}{did_you_mean(part, container)}")
    return container[key]


def _enter(tree: Any, part: str, path: str) -> tuple[Any, Any]:
    """Container and key for a part of a path in `tree`: segments and steps by number from 1, cables by name.

    A key of a dict need not exist yet.  Raises KeyError for a cable or number that does not exist, or a plain value.
    """
    if isinstance(tree, dict):
        return tree, part
    if not isinstance(tree, list):
        raise KeyError(f"path {path!r} leads into a plain value at {part!r}")
    if tree and isinstance(tree[0], dict) and "ends_at_segment" in tree[0]:
        names = [cable["name"] for cable in tree]
        if part not in names:
            raise KeyError(f"path {path!r}: there is no cable {part!r}{did_you_mean(part, names)}")
        return tree, names.index(part)
    if not part.isdigit() or not 1 <= int(part) <= len(tree):
        raise KeyError(
            f"path {path!r}: {no_number(part, len(tree), path.removeprefix('manipulator.').partition('.')[0])}"
        )
    return tree, int(part) - 1
