"""Parameters by name: any number of a manipulator or of its load steps, and the problem with it changed.

Paths are those of studies: segments, effects and listed offsets by number from 1, cables by name, such as
`segment.1.thickness_m`, `cable.2.offset_m`, `friction.coefficient`, `effect.1.factor`.  Loads: `tension.<cable>` is a
factor on all tensions applied to a cable; a column of a table of steps, such as `cable_1_n` or `tip_y_n`, is added to
that column in every step, or after `step.<number>.` in that step alone.
"""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import BaseModel

from prb3r.errors import did_you_mean
from prb3r.mechanics.chain import Chain, Loads
from prb3r.model.effects import Observation
from prb3r.model.manipulator import Cable, Manipulator
from prb3r.model.steps import column_names
from prb3r.quantities import unit_ending

RELATIVE_STEP = 1e-5
"""Change of a parameter to either side, of its size."""
SIZE_OF_ZERO = {"_m": 1e-2, "_m2": 1e-2, "_per_m": 1.0, "_n": 1.0, "_n_m2": 0.1, "_m_s2": 1.0}
"""Size of a parameter that is zero, by its unit; of a pure number 0.1."""


@dataclass(frozen=True)
class Parameter:
    """A number of a manipulator (`keys` lead to it), or of its loads (then there are none)."""

    path: str
    keys: tuple[str | int, ...]
    value: float

    @property
    def step(self) -> float:
        """Change to either side for what is known of the parameter without solving, in its unit."""
        size = abs(self.value) or SIZE_OF_ZERO.get(unit_ending(self.path.rsplit(".", 1)[-1]), 0.1)
        return RELATIVE_STEP * size


def parameter_at(manipulator: Manipulator, path: str) -> Parameter:
    """The number of a manipulator, or of its loads, that `path` names, with its present value.

    Raises
    ------
    ValueError
        If there is none.
    """
    parts = path.split(".")
    if parts[0] == "tension":
        _check(".".join(parts[1:]), manipulator.cable_names, f"{path}: there is no cable")
        return Parameter(path, (), 1.0)
    column = parts[2] if parts[0] == "step" and len(parts) == 3 and parts[1].isdigit() else path
    columns = [name for name in column_names(manipulator) if not name.startswith("slip_")]
    if column in columns:
        return Parameter(path, (), 0.0)
    if parts[0] == "step":
        _check(column, columns, f"{path}: steps have no column")
    keys, value = _keys(manipulator, path, parts)
    return Parameter(path, keys, value)


def _keys(manipulator: Manipulator, path: str, parts: list[str]) -> tuple[tuple[str | int, ...], float]:
    """Keys to a number of a manipulator, and the number."""
    keys: tuple[str | int, ...] = ()
    node: Any = manipulator
    for part in parts:
        if isinstance(node, Observation):
            raise ValueError(f"{path}: {node.kind} changes what is read, not the equilibrium")
        if isinstance(node, BaseModel):
            _check(part, type(node).model_fields, f"{path}: there is no")
            keys, node = (*keys, part), getattr(node, part)
        elif isinstance(node, list) and node and isinstance(node[0], Cable):
            _check(part, manipulator.cable_names, f"{path}: there is no cable")
            number = manipulator.cable_names.index(part)
            keys, node = (*keys, number), node[number]
        elif isinstance(node, list):
            if not part.isdigit() or not 1 <= int(part) <= len(node):
                raise ValueError(f"{path}: {part!r} is not a number from 1 to {len(node)}")
            keys, node = (*keys, int(part) - 1), node[int(part) - 1]
        else:
            raise ValueError(f"{path} leads into a plain value at {part!r}")
    if not isinstance(node, float):
        raise ValueError(f"{path} is {'not given' if node is None else 'not a number that can change smoothly'}")
    return keys, node


def _check(part: str, valid, what: str) -> None:
    if part not in valid:
        raise ValueError(f"{what} {part!r}{did_you_mean(part, valid)}")


def changed(manipulator: Manipulator, keys: tuple[str | int, ...], value: float) -> Manipulator:
    """The manipulator with another number, which is not checked: a derivative may look past a bound."""

    def put(node: Any, keys: tuple[str | int, ...]) -> Any:
        if not keys:
            return value
        key, inner = keys[0], keys[1:]
        if isinstance(key, int):
            return [*node[:key], put(node[key], inner), *node[key + 1 :]]
        return node.model_copy(update={key: put(getattr(node, key), inner)})

    return put(manipulator, keys)


def changed_loads(manipulator: Manipulator, chain: Chain, loads: Loads, numbers: np.ndarray, path: str, value: float):
    """Loads of the steps with `numbers` (s,), the load parameter `path` at `value`: a factor, or N to be added."""
    if path.startswith("tension."):
        factor = np.ones(len(chain.reach))
        factor[manipulator.cable_names.index(path.removeprefix("tension."))] = value
        return loads._replace(tension=loads.tension * factor)
    _, number, column = path.split(".") if path.startswith("step.") else ("", "", path)
    added = value * (np.ones(len(numbers)) if number == "" else (numbers == int(number)))
    if cable := re.fullmatch(r"cable_(.+)_n", column):
        column_of = np.arange(len(chain.reach)) == manipulator.cable_names.index(cable[1])
        return loads._replace(tension=loads.tension + added[:, None] * column_of)
    if column.startswith("tip_"):
        return loads._replace(tip=loads.tip + added[:, None] * [column == "tip_x_n", column == "tip_y_n"])
    disk, axis, _ = column.split("_")
    force = loads.force.copy()
    force[:, int(disk.removeprefix("disk")) - 1, "xy".index(axis)] += added
    return loads._replace(force=force)
