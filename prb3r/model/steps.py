"""Load steps: a table of tensions and dead loads, in newtons or kilograms, is checked and turned into `Loads`."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError
from prb3r.mechanics.chain import Chain, Loads
from prb3r.model.files.cells import blank_rows, numbers, with_keys
from prb3r.model.files.table import read_table
from prb3r.model.manipulator import Manipulator
from prb3r.model.step_checks import TIME, let_go, step_problems, with_whole_names

HELD_N = 0.1
"""Least change of tension that counts for the rate of a cable, N, as creep or the control of a held tension causes it.
So the rate of a held tension is this over the dwell, and friction follows the logarithm of the dwell.  Choice: a
hundredth of what small rigs pull with."""


@dataclass(frozen=True)
class LoadSequence:
    """Load steps that are applied one after the other, starting from rest."""

    name: str
    steps: np.ndarray
    """(s,) step numbers."""
    loads: Loads


@dataclass(frozen=True)
class LoadTable:
    """Load steps of `k` sequences, one sequence after the other; every sequence starts from rest."""

    names: np.ndarray
    """(k,) names of the sequences, as text."""
    first: np.ndarray
    """(k,) row of the first step of each sequence."""
    steps: np.ndarray
    """(s,) step numbers, which grow within a sequence."""
    loads: Loads
    """Loads of all `s` steps."""

    @property
    def begins(self) -> np.ndarray:
        """(s,) whether a step is the first of its sequence."""
        begins = np.zeros(len(self.steps), bool)
        begins[self.first] = True
        return begins

    @property
    def pace_s(self) -> float | None:
        """As :func:`pace_of`."""
        return pace_of(self.loads.time[:, 0], self.begins, np.arange(len(self.steps)))

    @property
    def let_go_as_drawn(self) -> np.ndarray:
        """(m,) whether each cable is let go at some step, but not to nothing, and counts as drawn in at every one."""
        tension, slip = self.loads.tension, self.loads.slip
        falls = let_go(tension[:-1], tension[1:]) & ~self.begins[1:, None]
        return falls.any(0) & (slip == -1).all(0)

    def sequences(self) -> Iterator[LoadSequence]:
        """The sequences in the order of the table, each with its own part of the loads."""
        ends = np.append(self.first[1:], len(self.steps))
        for name, first, end in zip(self.names, self.first, ends, strict=True):
            rows = slice(first, end)
            yield LoadSequence(name, self.steps[rows], Loads(*(field[rows] for field in self.loads)))

    def blocks(self, rows: int) -> Iterator["LoadTable"]:
        """Tables of whole sequences with up to `rows` steps each; a longer sequence is a table of its own."""
        ends, start = np.append(self.first[1:], len(self.steps)), 0
        while start < len(self.first):
            stop = max(start + 1, int(np.searchsorted(ends, self.first[start] + rows, side="right")))
            part = slice(self.first[start], ends[stop - 1])
            loads = Loads(*(field[part] for field in self.loads))
            yield LoadTable(self.names[start:stop], self.first[start:stop] - part.start, self.steps[part], loads)
            start = stop


def loads_of(manipulator: Manipulator, chain: Chain, table: pd.DataFrame | Mapping[str, np.ndarray]) -> Loads:
    """Loads of the rows of `table`, in N, whose columns have been checked; absent loads are zero, absent slips -1.

    Rows have to be in their order in time, those of a sequence together.  Without a column `time_s`, successive rows
    are one elapsed step apart.  Tensions below zero become zero.
    """
    rows = len(next(iter(table.values()))) if isinstance(table, Mapping) else len(table)
    begins = np.arange(rows) == 0
    if "sequence" in table:
        sequence = np.asarray(table["sequence"], object)
        begins[1:] = sequence[1:] != sequence[:-1]

    def column(name: str, absent: float) -> np.ndarray:
        if name not in table:
            return np.full(rows, absent)
        cells = table[name]
        return np.nan_to_num(cells if isinstance(cells, np.ndarray) else numbers(cells).to_numpy(), nan=absent)

    def tension(name: str) -> np.ndarray:
        newtons = column(f"cable_{name}_n", 0.0) + manipulator.gravity_m_s2 * column(f"cable_{name}_kg", 0.0)
        return np.maximum(newtons, 0.0)

    names, plates = manipulator.cable_names, chain.plates
    places = {f"disk{k}_{axis}_n": (k - 1, a) for k in range(1, plates + 1) for a, axis in enumerate("xy")}
    named = [name for name in places if name in table]
    force = np.zeros((rows, plates, 2)) if named else _zeros(rows, plates, 2)
    for name in named:
        force[(slice(None), *places[name])] = column(name, 0.0)
    stack = lambda columns: np.stack(columns, 1) if columns else np.zeros((rows, 0))  # noqa: E731
    tensions, slips = (stack(of) for of in ([tension(n) for n in names], [column(f"slip_{n}", -1.0) for n in names]))
    return Loads(
        tensions,
        slips,
        force,
        np.stack([column("tip_x_n", 0.0), column("tip_y_n", 0.0)], 1),
        _zeros(rows, plates),
        elapsed_steps(column(TIME, 0.0) if TIME in table else np.arange(float(rows)))[:, None],
        _rates(tensions, column(TIME, 0.0), begins) if TIME in table else _zeros(rows, len(names)),
        tension_travel(tensions, slips, begins),
        column(TIME, 0.0)[:, None] if TIME in table else _zeros(rows, 1),
    )


def elapsed_steps(time: np.ndarray) -> np.ndarray:
    """(s,) number of steps that had passed before each: its time since the first over the mean time per step.

    `time` (s,) of the steps, s.
    """
    first, last = (time.min(), time.max()) if len(time) else (0.0, 0.0)
    return (time - first) * ((len(time) - 1) / (last - first)) if last > first else time - first


def pace_of(time: np.ndarray, begins: np.ndarray, row: np.ndarray) -> float | None:
    """Median time from one step of a sequence to the next, s; None where no times are known, or none follows another.

    Parameters
    ----------
    time : (s,) of each step, s; 0 at all where no times are known.
    begins : (s,) whether a step is the first of its sequence.
    row : (s,) of each step in a table that may have more steps, which follow each other evenly between these.
    """
    lasts = (np.diff(time) / np.diff(row))[~begins[1:]]
    return float(np.median(lasts)) if time.any() and lasts.size else None


def _rates(tension: np.ndarray, time: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """(s, m) rate at which each tension changed since the step before, N/s; 0 at the first step of a sequence.

    Parameters
    ----------
    tension : (s, m), N
    time : (s,) of each step, s
    begins : (s,) whether a step is the first of its sequence.
    """
    rate = np.zeros(tension.shape)
    passed = np.where(begins[1:], np.inf, np.diff(time))
    rate[1:] = np.maximum(np.abs(np.diff(tension, axis=0)), HELD_N) / passed[:, None]
    return rate


def tension_changes(tension: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """(s, m) change of each tension since the step before, or since rest at the first step of a sequence, N.

    Parameters
    ----------
    tension : (s, m), N
    begins : (s,) whether a step is the first of its sequence.
    """
    before = np.concatenate([np.zeros((1, tension.shape[1])), tension[:-1]])
    return tension - np.where(begins[:, None], 0.0, before)


def tension_travel(tension: np.ndarray, slip: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """(s, m) sum of the absolute changes of each cable's tension since it began to slip in its present direction, N.

    A cable begins to slip anew at the first step of a sequence, where its declared slip differs from that of the step
    before, and where it was slack at the step before.  The change of tension up to the first step of the new direction
    counts as travel in that direction.

    Parameters
    ----------
    tension : (s, m), N
    slip : (s, m) declared: -1, 0 or +1
    begins : (s,) whether a step is the first of its sequence.
    """
    first, none = begins[:, None], np.zeros((1, tension.shape[1]))
    slack = np.concatenate([none, tension[:-1]]) == 0
    starts = first | (slip != np.concatenate([none, slip[:-1]])) | slack
    change = np.abs(tension_changes(tension, begins))
    total = np.cumsum(change, axis=0)
    return total - np.maximum.accumulate(np.where(starts, total - change, 0.0), axis=0)


def with_tensions(loads: Loads, tension: np.ndarray, begins: np.ndarray) -> Loads:
    """The loads with other tensions (s, m), N, and the travel and the rates that follow from these.

    `begins` (s,) is whether a step is the first of its sequence.
    """
    changed, before = (np.maximum(np.abs(tension_changes(t, begins)), HELD_N) for t in (tension, loads.tension))
    travel = tension_travel(tension, loads.slip, begins)
    return loads._replace(tension=tension, travel=travel, rate=loads.rate * changed / before)


def _zeros(*shape: int) -> np.ndarray:
    """A read-only array of zeros that takes no memory; for a million steps, loads that no column names would fill most
    of it."""
    return np.broadcast_to(0.0, shape)


def load_steps(
    manipulator: Manipulator, steps: pd.DataFrame | Mapping[str, Any] | str | Path, where: str = "steps"
) -> LoadTable:
    """Checked load steps from a table of steps, or from the file that holds the table.

    Sequences stand in the order of their first rows, and steps within a sequence in the order of their numbers.
    `where` names the table in messages; a file goes by its own name.

    Raises
    ------
    SpecError
        With every problem of the table.
    """
    if isinstance(steps, str | Path):
        steps, where = read_table(steps), str(steps)
    elif isinstance(steps, Mapping):
        steps = _frame(steps, where)
    steps = with_whole_names(manipulator, steps).reset_index(drop=True)
    steps = steps[~blank_rows(steps)]
    if problems := step_problems(manipulator, steps, where):
        raise SpecError(*problems)
    if steps.empty:
        raise SpecError(Problem(where, "holds no steps"))
    steps = with_keys(steps)
    number, (codes, names) = steps["step"].to_numpy(), pd.factorize(steps["sequence"])
    order = np.lexsort((number, codes))
    loads = loads_of(manipulator, manipulator.chain(), steps.iloc[order])
    return LoadTable(
        np.asarray(names, object),
        np.searchsorted(codes[order], np.arange(len(names))),
        number[order],
        loads,
    )


def _frame(columns: Mapping[str, Any], where: str) -> pd.DataFrame:
    """A table from columns of one length; a single value stands in every row, and single values alone are one step.

    Raises SpecError for other columns.
    """
    alone = bool(columns) and all(np.ndim(values) == 0 for values in columns.values())
    try:
        return pd.DataFrame(dict(columns), index=[0] if alone else None)
    except ValueError as error:
        raise SpecError(Problem(where, f"is no table of steps: {error}")) from None


def sequences_of(manipulator: Manipulator, steps: pd.DataFrame | Mapping[str, Any] | str | Path) -> list[LoadSequence]:
    """The sequences of a table of steps, each by itself; parameters and errors are those of :func:`load_steps`."""
    return list(load_steps(manipulator, steps).sequences())
