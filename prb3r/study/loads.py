"""Load steps as columns, from the initial loads, steps and sweep of a case or of a family of cases."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from prb3r.model.step_checks import let_go
from prb3r.study.rounding import short, significant
from prb3r.study.tree import Tree


def load_columns(settings: Tree, count: int) -> dict[str, np.ndarray]:
    """(count, s) values by name of the load column, for `count` cases of `s` steps each.

    In the settings of a family, a load is a number that all cases share or an array of (count,) numbers.
    """
    rows = load_rows(settings)
    columns = {}
    for name in dict.fromkeys(name for row in rows for name in row):
        columns[name] = np.full((count, len(rows)), _absent(name))
        for step, row in enumerate(rows):
            if name in row:
                columns[name][:, step] = row[name]
    return columns


def steps_frame(settings: Tree) -> pd.DataFrame:
    """The load steps of a single case as a table, a row for each step."""
    rows = load_rows(settings)
    absent = {name: _absent(name) for row in rows for name in row}
    return pd.DataFrame([absent | row for row in rows])


def load_rows(settings: Tree) -> list[dict[str, Any]]:
    """The loads in each step: initial loads, steps, then steps of the sweep.

    A load that a step does not name keeps its value from the step before.
    """
    rows: list[dict[str, Any]] = []
    steps = ([settings["initial"]] if settings["initial"] else []) + settings["step"]
    for step in [*steps, *_swept(settings.get("sweep"), steps)]:
        replaced = {in_other_unit(name) for name in step}
        before = rows[-1] if rows else {}
        rows.append({name: value for name, value in before.items() if name not in replaced} | step)
    return rows


def in_other_unit(name: str) -> str:
    """The column of the same load in kilograms instead of newtons, or the reverse; empty for other columns."""
    pairs = (("_n", "_kg"), ("_kg", "_n"))
    return next((name.removesuffix(ending) + other for ending, other in pairs if name.endswith(ending)), "")


def _absent(name: str) -> float:
    """The value of a load column that is not named: -1 (drawn in) for slip, else 0."""
    return -1.0 if name.startswith("slip_") else 0.0


def _swept(sweep: Tree | None, before: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """The steps of a sweep, which starts from the value that the steps `before` give its column, 0 without any."""
    if not sweep:
        return
    column, value = sweep["column"], 0.0
    for step in before:
        value = step.get(column, value)
    for turn in sweep["turns"]:
        for share in np.arange(1, sweep["count"] + 1) / sweep["count"]:
            at = value + share * (turn - value)
            yield {column: significant(at) if np.ndim(at) else short(at)}
        value = turn


def drawn_while_let_go(columns: dict[str, np.ndarray], cable: str) -> np.ndarray:
    """(count,) as `LoadTable.let_go_as_drawn`, of one cable in every case, from the columns of :func:`load_columns`."""
    count = len(next(iter(columns.values()), ()))
    pulls = next((columns[name] for name in (f"cable_{cable}_n", f"cable_{cable}_kg") if name in columns), None)
    if pulls is None:
        return np.zeros(count, bool)
    drawn = np.broadcast_to(columns.get(f"slip_{cable}", -1.0), pulls.shape) == -1.0
    return drawn.all(1) & let_go(pulls[:, :-1], pulls[:, 1:]).any(1)
