"""Checks of a table of load steps: the columns that it may have, and all problems with its names, signs and sizes."""

import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from prb3r.errors import Problem, did_you_mean
from prb3r.markdown import listed
from prb3r.model.files.cells import (
    count,
    is_empty,
    key_problems,
    named,
    number_problems,
    numbers,
    others,
    rows_of,
    too_large,
    with_keys,
)
from prb3r.model.manipulator import Manipulator

REST_NOISE = 0.02
"""A tension below zero by up to this share of the table's largest tension counts as zero: a force sensor at rest."""


TIME = "time_s"
"""Optional column of a table of steps: the time at which each was taken, by one clock."""
LOAD_COLUMN = re.compile(r"(?:cable_.+_(?:n|kg)|slip_.+|tip_[xy]_n|disk[1-9]\d*_[xy]_n)")
"""Names that load columns have, whatever the manipulator."""
LOAD_COLUMN_FORMS = (
    "cable_<name>_n",
    "cable_<name>_kg",
    "slip_<name>",
    "tip_x_n",
    "tip_y_n",
    "disk<k>_x_n",
    "disk<k>_y_n",
)
"""The same as messages write them."""


def column_names(manipulator: Manipulator) -> list[str]:
    """Load columns that a table of steps may have, without those in kilograms."""
    cables = [f"cable_{name}_n" for name in manipulator.cable_names]
    slips = [f"slip_{name}" for name in manipulator.cable_names]
    disks = [f"disk{k}_{axis}_n" for k in range(1, manipulator.plates + 1) for axis in "xy"]
    return [*cables, "tip_x_n", "tip_y_n", *slips, *disks]


def with_whole_names(manipulator: Manipulator, frame: pd.DataFrame) -> pd.DataFrame:
    """A table of steps in which cables have their whole names: space at the end of a column's name, which is no part of
    it in CSV, may be part of a cable's."""
    known = set(column_names(manipulator))
    cut = {name.strip(): name for name in known if name.strip() not in known}
    return frame.rename(columns={name: cut[name] for name in frame.columns if name in cut})


def cable_columns(manipulator: Manipulator, frame: Container[str]) -> list[str]:
    """The columns of a table of steps that hold tensions, in newtons or kilograms."""
    names = (f"cable_{name}_{unit}" for name in manipulator.cable_names for unit in ("n", "kg"))
    return [name for name in names if name in frame]


def step_problems(
    manipulator: Manipulator | None, frame: pd.DataFrame, where: str, *, keys=("sequence", "step")
) -> list[Problem]:
    """All problems of a table of steps.

    Parameters
    ----------
    manipulator : the manipulator on which the loads act; without it, which cables and disks there are and signs of
        tensions stay unchecked.
    where : name of the table in messages.
    keys : columns that tell rows apart; empty for loads without sequences, which have no times either.
    """
    valid = [*keys, *([TIME] if keys else []), *(_columns(manipulator) if manipulator else [])]
    if twice := frame.columns[frame.columns.duplicated()].unique().tolist():
        return [Problem(f"{where} column {name}", "stands there twice") for name in twice]
    problems = key_problems(frame, where, keys)
    if not problems and keys:
        problems += _repeated(with_keys(frame), where)
        problems += _time_problems(with_keys(frame), f"{where} column {TIME}") if TIME in frame else []
    for name in frame.columns:
        place = f"{where} column {name}"
        if name not in valid and (manipulator or not is_load_column(name)):
            problems.append(Problem(place, f"unknown column{_hint(manipulator, str(name), valid)}"))
        elif name not in (*keys, TIME):
            problems += _load_problems(frame[name], str(name), place)
    for effect in manipulator.effect if manipulator else ():
        if effect.needs_times and TIME not in frame:
            what = f"column {TIME!r} is missing: the effect {effect.kind} goes by when each step was taken, in seconds"
            problems.append(Problem(where, what if keys else f"{effect.kind} goes by times, which loads here have not"))
    for name in manipulator.cable_names if manipulator else ():
        if {f"cable_{name}_n", f"cable_{name}_kg"} <= set(frame.columns):
            problems.append(Problem(where, f"cable_{name}_n and cable_{name}_kg exclude each other"))
    return problems + (list(_pushing(manipulator, frame, where)) if manipulator else [])


def is_load_column(name: object) -> bool:
    """Whether a column of this name could hold loads of some manipulator."""
    return LOAD_COLUMN.fullmatch(str(name)) is not None


def ignored_slips(manipulator: Manipulator, columns: Iterable[str], table: str = "") -> str:
    """A sentence on columns of declared slip that are ignored, as slip of the manipulator follows from the load path;
    empty if there are none.  `table` names what the columns are of."""
    slips = sorted(name for name in columns if name.startswith("slip_")) if manipulator.follows_history else []
    of = f" of {table}" if table else ""
    return f"{', '.join(slips)}{of} ignored: friction follows the cables' own travel (history)" if slips else ""


LET_GO = 0.01
"""Fall of a tension, over its value before, from which on a cable counts as let go.  Choice: a hundredth is no more
than what a load cell scatters by."""


def let_go(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Whether tensions fall from one step to the next, but not to nothing."""
    return (after < (1 - LET_GO) * before) & (after > 0)


def let_go_as_drawn(manipulator: Manipulator, suspect: Sequence[bool]) -> str:
    """A sentence on cables that are let go and yet count as drawn in throughout; empty if there are none, or if slip is
    not declared or not felt.

    Parameters
    ----------
    suspect : (m,) whether each cable does so, by the loads alone (`let_go`); dead cables do not count.
    """
    chain, cables = manipulator.chain(), manipulator.cable_names
    felt = chain.friction.any() or np.any(chain.pulley != 1) or chain.hole_drag
    alive = (chain.reach > 0).tolist()
    names = [name for name, drawn, lives in zip(cables, suspect, alive, strict=True) if drawn and lives]
    if not names or manipulator.follows_history or not felt:
        return ""
    are, say = ("is", "says") if len(names) == 1 else ("are", "say")
    slips = listed([f"slip_{name}" for name in names])
    return (
        f"{named('cable', names)} {are} let go, and {slips} {say} drawn in (-1) throughout, as it is understood where "
        "there is no such column; write 1 where a cable is paid out"
    )


def refused(manipulator: Manipulator, columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """(c,) whether each of `c` tables of `s` steps has a problem; `step_problems` says which.

    Parameters
    ----------
    columns : (c, s) numbers of each load column, by its name.
    """
    names, count = cable_columns(manipulator, columns), len(next(iter(columns.values())))
    twice = any(name.endswith("_n") and name.removesuffix("n") + "kg" in names for name in names)
    timeless = any(effect.needs_times for effect in manipulator.effect)
    if twice or timeless or not columns.keys() <= set(_columns(manipulator)):
        return np.ones(count, bool)
    bad = [(np.isnan(values) | too_large(values)).any(1) for values in columns.values()]
    bad += [_no_slip(values).any(1) for name, values in columns.items() if name.startswith("slip_")]
    newtons = [_newtons(manipulator, name, columns[name]) for name in names]
    if newtons:
        largest = np.max([column.max(1) for column in newtons], axis=0)[:, None]
        bad += [_pushes(column, largest).any(1) for column in newtons]
    return np.any(bad, axis=0)


def _no_slip(values: Any) -> Any:
    """Whether declared slips are something else than -1 (drawn in), 0 (none) or 1 (paid out)."""
    return (values != -1) & (values != 0) & (values != 1)


def _newtons(manipulator: Manipulator, name: str, values: Any) -> Any:
    """Tensions of the column `name` in newtons; kilograms are multiplied by the manipulator's gravity."""
    return values * (manipulator.gravity_m_s2 if name.endswith("_kg") else 1)


def _pushes(newtons: Any, largest: Any) -> Any:
    """Whether tensions lie below zero by more than `REST_NOISE` of the largest one of their table."""
    return newtons < -REST_NOISE * np.maximum(largest, 0.0)


def _columns(manipulator: Manipulator) -> list[str]:
    """All load columns that a table of steps may have, those in kilograms included."""
    return [*column_names(manipulator), *(f"cable_{name}_kg" for name in manipulator.cable_names)]


def _hint(manipulator: Manipulator | None, name: str, valid: list[str]) -> str:
    """Ending of a message about an unknown column: the disk or cable that does not exist, or the closest valid name."""
    if manipulator and (disk := re.fullmatch(r"disk(\d+)_[xy]_n", name)):
        return f": there is no disk {disk[1]}, disks that can carry loads are 1 to {manipulator.plates}"
    if manipulator and (other := re.fullmatch(r"(?:cable_(.+)_(?:n|kg)|slip_(.+))", name)):
        names = ", ".join(manipulator.cable_names) or "no"
        return f": there is no cable {other[1] or other[2]}; the manipulator has the cables {names}"
    options = [v for v in valid if not v.startswith("disk")] if manipulator else [*valid, *LOAD_COLUMN_FORMS]
    return did_you_mean(name, options)


def _repeated(frame: pd.DataFrame, where: str) -> Iterator[Problem]:
    """A problem for each sequence with steps that stand in several rows; it names these steps and rows."""
    for name, rows in frame[frame.duplicated(["sequence", "step"], keep=False)].groupby("sequence", sort=False):
        steps = rows["step"].unique()
        places = [f"step {step} stands in {rows_of(rows['step'] == step)}" for step in steps[:3]]
        more = f" and {count(len(steps) - 3, 'more step')} alike" if len(steps) > 3 else ""
        differ = "" if len(rows.drop_duplicates()) == len(steps) else ", with different loads"
        remedy = "a sequence that is pulled again needs a name of its own"
        yield Problem(where, f"sequence {name}: {', '.join(places)}{more}{differ}; {remedy}")


def _time_problems(frame: pd.DataFrame, place: str) -> list[Problem]:
    """Problems with the times of steps, which have to grow within a sequence and be of one clock, so that sequences do
    not overlap."""
    problems, time = number_problems(frame[TIME], place), numbers(frame[TIME])
    if (empty := is_empty(frame[TIME])).any():
        problems.append(
            Problem(place, f"{rows_of(empty)}: empty; leave the whole column out where times are not known")
        )
    if problems:
        return problems
    ordered = frame.assign(**{TIME: time}).sort_values("step", kind="stable")
    spans = []
    for name, rows in ordered.groupby("sequence", sort=False):
        late = rows[TIME].diff() <= 0
        if late.any():
            row = late.idxmax()
            what = f"step {rows.loc[row, 'step']} is not later than the one before it (row {row + 1})"
            problems.append(Problem(place, f"sequence {name}: {what}; times grow from step to step, in seconds"))
        spans.append((rows[TIME].min(), rows[TIME].max(), name))
    for (_, end, before), (begin, _, after) in pairwise(sorted(spans)):
        if begin <= end:
            both = f"sequences {before} and {after} overlap"
            problems.append(Problem(place, f"{both}: times are of one clock that runs through the whole recording"))
    return problems


def _load_problems(values: pd.Series, name: str, place: str) -> list[Problem]:
    """Problems with the cells of one load column: no numbers, empty loads, or slips other than -1, 0 and 1."""
    problems, read = number_problems(values, place), numbers(values)
    if name.startswith("slip_"):
        wrong = np.isfinite(read) & _no_slip(read)
        what = "must be -1 (drawn toward the base), 0 or +1 (paid out)"
    else:
        wrong, what = is_empty(values), "empty; write 0 for no load"
    if wrong.any():
        problems.append(Problem(place, f"{rows_of(wrong)}: {what}"))
    return problems


def _pushing(manipulator: Manipulator, frame: pd.DataFrame, where: str) -> Iterator[Problem]:
    """A problem for each column with a tension farther below zero than `REST_NOISE` of the largest in the table."""
    names = cable_columns(manipulator, frame)
    read = {name: numbers(frame[name]) for name in names}
    newtons = {name: _newtons(manipulator, name, column.mask(too_large(column))) for name, column in read.items()}
    largest = max((column.max() for column in newtons.values()), default=0.0)
    for name, column in newtons.items():
        if (pushes := _pushes(column, largest)).any():
            lowest = read[name][column.idxmin()]
            what = f"row {column.idxmin() + 1} is {lowest:g}: a cable cannot push; tensions are at least 0"
            yield Problem(f"{where} column {name}", what + others(pushes))
