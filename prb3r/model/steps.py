"""Load steps: tables of tensions and dead loads, in newtons or kilograms, checked and turned into loads."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.mechanics.chain import Chain, Loads, loads
from prb3r.model.manipulator import Manipulator
from prb3r.model.table import read_table

REST_NOISE = 0.02
"""A tension below zero by up to this share of the cable's largest is a force sensor at rest and taken as zero."""


@dataclass(frozen=True)
class Sequence:
    """Load steps from rest, in their order."""

    name: str
    steps: np.ndarray
    """(s,) step numbers."""
    loads: Loads


def column_names(manipulator: Manipulator) -> list[str]:
    """Load columns that a table of steps may have, without those in kilograms."""
    cables = [f"cable_{name}_n" for name in manipulator.cable_names]
    slips = [f"slip_{name}" for name in manipulator.cable_names]
    disks = [f"disk{k}_{axis}_n" for k in range(1, manipulator.plates + 1) for axis in "xy"]
    return [*cables, "tip_x_n", "tip_y_n", *slips, *disks]


def loads_of(manipulator: Manipulator, chain: Chain, frame: pd.DataFrame) -> Loads:
    """Loads of the rows of `frame`, whose columns have been checked; absent loads are zero, absent slips -1."""

    def column(name: str, absent: float) -> np.ndarray:
        if name not in frame:
            return np.full(len(frame), absent)
        return np.nan_to_num(frame[name].to_numpy(float), nan=absent)

    def tension(name: str) -> np.ndarray:
        newtons = column(f"cable_{name}_n", 0.0) + manipulator.gravity_m_s2 * column(f"cable_{name}_kg", 0.0)
        return np.maximum(newtons, 0.0)

    names, disks = manipulator.cable_names, range(1, manipulator.plates + 1)
    force = np.zeros((len(frame), manipulator.plates, 2))
    for k in disks:
        for a, axis in enumerate("xy"):
            if f"disk{k}_{axis}_n" in frame:
                force[:, k - 1, a] = column(f"disk{k}_{axis}_n", 0.0)
    stack = lambda columns: np.stack(columns, 1) if columns else np.zeros((len(frame), 0))  # noqa: E731
    return loads(
        chain,
        stack([tension(name) for name in names]),
        stack([column(f"slip_{name}", -1.0) for name in names]),
        force,
        np.stack([column("tip_x_n", 0.0), column("tip_y_n", 0.0)], 1),
    )


def problems_of(
    manipulator: Manipulator, frame: pd.DataFrame, where: str, *, keys=("sequence", "step")
) -> list[Problem]:
    """Everything that is wrong with a table of steps."""
    valid = [*keys, *column_names(manipulator), *(f"cable_{name}_kg" for name in manipulator.cable_names)]
    problems = [Problem(where, f"column {key!r} is missing") for key in keys if key not in frame]
    for name in frame.columns:
        place = f"{where} column {name}"
        if name not in valid:
            problems.append(Problem(place, f"unknown column{_hint(manipulator, str(name), valid)}"))
        elif name not in keys:
            problems += _number_problems(frame[name], str(name), place)
    for name in manipulator.cable_names:
        if {f"cable_{name}_n", f"cable_{name}_kg"} <= set(frame.columns):
            problems.append(Problem(where, f"cable_{name}_n and cable_{name}_kg exclude each other"))
    if not problems and keys:
        for key, rows in frame.groupby(list(keys), sort=False).groups.items():
            if len(rows) > 1:
                at = ", ".join(f"{k} {v}" for k, v in zip(keys, key, strict=True))
                problems.append(
                    Problem(where, f"{at} stands in {len(rows)} rows (first: rows {rows[0] + 1}, {rows[1] + 1})")
                )
    return problems


def _hint(manipulator: Manipulator, name: str, valid: list[str]) -> str:
    if disk := re.fullmatch(r"disk(\d+)_[xy]_n", name):
        return f": there is no disk {disk[1]}, disks that can carry loads are 1 to {manipulator.plates}"
    return did_you_mean(name, [v for v in valid if not v.startswith("disk")])


def _number_problems(values: pd.Series, name: str, place: str) -> list[Problem]:
    numbers = pd.to_numeric(values, errors="coerce").astype(float)
    strange = values[numbers.isna() & values.notna()]
    if len(strange):
        return [Problem(place, f"row {strange.index[0] + 1} holds {strange.iloc[0]!r}, not a number")]
    if np.isinf(numbers).any():
        return [Problem(place, f"row {int(np.flatnonzero(np.isinf(numbers))[0]) + 1} is infinite")]
    if name.startswith("slip_") and not numbers.dropna().isin([-1, 0, 1]).all():
        return [Problem(place, "must be -1 (drawn toward the base), 0 or +1 (paid out)")]
    if name.startswith("slip_"):
        return []
    if numbers.isna().any():
        return [Problem(place, f"row {int(np.flatnonzero(numbers.isna())[0]) + 1} is empty; write 0 for no load")]
    if name.startswith("cable_") and (numbers < -REST_NOISE * max(numbers.abs().max(), 0.0)).any():
        row = int(np.flatnonzero(numbers < 0)[0])
        return [Problem(place, f"row {row + 1} is {numbers.iloc[row]:g}: a cable cannot push; tensions are at least 0")]
    return []


def sequences_of(manipulator: Manipulator, steps: pd.DataFrame | str | Path, where: str = "steps") -> list[Sequence]:
    """The sequences of a table of steps (or of the file that holds it), in order of appearance, sorted by step.

    Raises
    ------
    SpecError
        With every problem of the table.
    """
    if not isinstance(steps, pd.DataFrame):
        steps, where = read_table(steps), str(steps)
    if problems := problems_of(manipulator, steps, where):
        raise SpecError(*problems)
    if steps.empty:
        raise SpecError(Problem(where, "holds no steps"))
    chain, sequences = manipulator.chain(), []
    for name, rows in steps.groupby("sequence", sort=False):
        rows = rows.sort_values("step", kind="stable")
        sequences.append(Sequence(str(name), rows["step"].to_numpy(), loads_of(manipulator, chain, rows)))
    return sequences
