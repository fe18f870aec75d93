"""Parameters by name: any number of a manipulator or of its load steps, and the loads with a load parameter changed.

Paths to a manipulator's numbers are those of `prb3r.model.paths`.  Loads: `tension.<cable>` is a factor on all tensions
applied to a cable; a column of a table of steps, such as `cable_1_n` or `tip_y_n`, is added to that column in every
step, or after `step.<number>.` in that step alone.
"""

import re
from dataclasses import dataclass

import numpy as np

from prb3r.mechanics.chain import Chain, Loads
from prb3r.model.effects import Observation
from prb3r.model.files.toml_lines import Keys
from prb3r.model.manipulator import Manipulator
from prb3r.model.paths import keys_of_path, require_known, value_at
from prb3r.model.step_checks import column_names
from prb3r.model.steps import with_tensions
from prb3r.quantities import unit_ending

RELATIVE_STEP = 1e-5
"""Change of a parameter to either side for differences, over its size."""
SIZE_OF_ZERO = {"_m": 1e-2, "_m2": 1e-2, "_per_m": 1.0, "_n": 1.0, "_n_m2": 0.1, "_m_s2": 1.0, "_rad_per_n_m": 1e-9}
"""Size that stands for a parameter whose value is zero, by the unit ending of its name; 0.1 for all other endings.  For
a compliance, that of the hinge by which a rigid clamp is computed (`hinges.RIGID`) where plates have 10 N m/rad."""


@dataclass(frozen=True)
class Parameter:
    """A number of a manipulator, to which `keys` lead, or of its loads, with empty `keys`."""

    path: str
    keys: Keys
    value: float

    @property
    def step(self) -> float:
        """Change to either side for the differences at the held shape, in the parameter's unit."""
        size = abs(self.value) or SIZE_OF_ZERO.get(unit_ending(self.path.rsplit(".", 1)[-1]), 0.1)
        return RELATIVE_STEP * size


def parameter_at(manipulator: Manipulator, path: str) -> Parameter:
    """The number of a manipulator or of its loads that `path` names, with its present value.

    The present value of a factor on tensions is 1, that of a load to be added 0.

    Raises
    ------
    ValueError
        If there is no such number, or it is not one on which equilibria depend smoothly.
    """
    parts = path.split(".", 2)
    if parts[0] == "tension":
        require_known(".".join(parts[1:]), manipulator.cable_names, f"{path}: there is no cable")
        return Parameter(path, (), 1.0)
    column = parts[2] if parts[0] == "step" and len(parts) == 3 and parts[1].isdigit() else path
    columns = [name for name in column_names(manipulator) if not name.startswith("slip_")]
    if column in columns:
        return Parameter(path, (), 0.0)
    if parts[0] == "step":
        require_known(column, columns, f"{path}: steps have no column")
    keys, value = _number_at(manipulator, path)
    return Parameter(path, keys, value)


def _number_at(manipulator: Manipulator, path: str) -> tuple[Keys, float]:
    """Keys to a number of a manipulator on which equilibria depend, and the number; raises ValueError for others."""
    keys = keys_of_path(manipulator, path)
    effect = manipulator.effect[int(keys[1])] if keys[0] == "effect" and len(keys) > 1 else None
    if isinstance(effect, Observation):
        raise ValueError(f"{path}: {effect.kind} changes what is read, not the equilibrium")
    value = value_at(manipulator, keys)
    if not isinstance(value, float):
        raise ValueError(f"{path} is {'not given' if value is None else 'not a number that can change smoothly'}")
    return keys, value


def changed_loads(manipulator: Manipulator, chain: Chain, loads: Loads, numbers: np.ndarray, path: str, value: float):
    """The `loads` of one sequence with the load parameter `path` at `value`: a factor on tensions, or N to be added.

    `numbers` (s,) are the numbers of the steps.
    """
    if path.startswith("tension."):
        factor = np.ones(len(chain.reach))
        factor[manipulator.cable_names.index(path.removeprefix("tension."))] = value
        return with_tensions(loads, loads.tension * factor, np.arange(loads.steps) == 0)
    _, number, column = path.split(".", 2) if path.startswith("step.") else ("", "", path)
    added = value * (np.ones(len(numbers)) if number == "" else (numbers == int(number)))
    if cable := re.fullmatch(r"cable_(.+)_n", column):
        column_of = np.arange(len(chain.reach)) == manipulator.cable_names.index(cable[1])
        tension = loads.tension + added[:, None] * column_of
        return with_tensions(loads, tension, np.arange(loads.steps) == 0)
    if column.startswith("tip_"):
        return loads._replace(tip=loads.tip + added[:, None] * [column == "tip_x_n", column == "tip_y_n"])
    disk, axis, _ = column.split("_")
    force = loads.force.copy()
    force[:, int(disk.removeprefix("disk")) - 1, "xy".index(axis)] += added
    return loads._replace(force=force)
