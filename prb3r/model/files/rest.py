"""What is in order of a TOML file that has problems, so that what it says can be checked further."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel

from prb3r.model.files.toml import toml_contents
from prb3r.model.files.toml_lines import Keys
from prb3r.model.files.validation import validate

_Model = TypeVar("_Model", bound=BaseModel)


@dataclass(frozen=True)
class Rest(Generic[_Model]):
    """A file without its tables, elements of lists and values that are wrong."""

    instance: _Model
    left_out: frozenset[str]
    """First keys of what was left out."""
    kept: Mapping[str, list[int]]
    """For each list of which elements were left out, the numbers in the file (from 0) of those that were not."""

    def in_file(self, keys: Keys) -> Keys:
        """The keys in the file of what has the given `keys` in `instance`."""
        first, number = (*keys, None, None)[:2]
        if isinstance(first, str) and first in self.kept and isinstance(number, int):
            return (first, self.kept[first][number], *keys[2:])
        return keys


def rest_of(path: Path, model: type[_Model]) -> Rest[_Model] | None:
    """What is in order of a file that `model` refuses; None if that is no whole file, as where required keys are wrong.

    What is left out is whole values of the top level, of lists single elements.
    """
    data = toml_contents(path) or {}
    wrong = validate(data, model)[1]
    if any(not keys for keys, _ in wrong):
        return None
    without: dict[str, Any] = dict(data)
    kept = dict[str, list[int]]()
    left_out = frozenset(str(keys[0]) for keys, _ in wrong)
    for first in left_out:
        elements = {keys[1] for keys, _ in wrong if keys[0] == first and len(keys) > 1}
        part = data.get(first)
        if isinstance(part, list) and elements and all(isinstance(number, int) for number in elements):
            kept[first] = [number for number in range(len(part)) if number not in elements]
            without[first] = [part[number] for number in kept[first]]
        else:
            without.pop(first, None)
    instance, still_wrong = validate(without, model)
    return None if instance is None or still_wrong else Rest(instance, left_out, kept)
