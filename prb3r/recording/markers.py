"""The table of markers of a recording: its checks, and the readings in it.

Rows may have empty cells or be repeated; every reading is kept, but exact repetitions of a row are used once.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from prb3r.errors import Problem, did_you_mean
from prb3r.model.files.cells import count, is_empty, key_problems, number_problems, numbers, ranges, rows_of, with_keys
from prb3r.model.manipulator import Manipulator
from prb3r.quantities import other_unit
from prb3r.recording.findings import Findings
from prb3r.recording.recording import Kind, Measurement, Readings
from prb3r.recording.units import angle_problems, position_problems

MARKER_KEYS = ("sequence", "step", "disk")
MARKER_COLUMNS = tuple(kind.column for kind in Kind)


def marker_problems(
    frame: pd.DataFrame,
    steps: pd.DataFrame | None,
    manipulator: Manipulator | None,
    measurement: Measurement | None,
    where: str,
) -> list[Problem]:
    """All problems of a table of markers, as far as steps, manipulator and measurement are known (not None).

    `where` names the table in messages.
    """
    keys = key_problems(frame, where, MARKER_KEYS)
    problems = [*keys, *_column_problems(frame, where)]
    if "disk" not in frame or any(problem.where == f"{where} column disk" for problem in keys):
        return problems
    disk = numbers(frame["disk"])
    last = manipulator.plates if manipulator else np.inf
    strange = (disk % 1 != 0) | (disk < 0) | (disk > last)
    if strange.any():
        row = strange.idxmax()
        there = f"disks are 0 (base) to {last}" if manipulator else "disks are counted 0 (base), 1, 2, ..."
        what = f"there is no disk {disk[row]:g} ({rows_of(strange)}); {there}"
        problems.append(Problem(f"{where} column disk", what))
    if "bend_rad" in frame and (at_base := (disk == 0) & ~is_empty(frame["bend_rad"])).any():
        what = f"{rows_of(at_base)}: no plate ends at the base disk 0; the first bend is that of disk 1"
        problems.append(Problem(f"{where} column bend_rad", what))
    if not keys and steps is not None:
        problems += _without_step(with_keys(frame), steps, where)
    read = [name for name in MARKER_COLUMNS if name in frame and not number_problems(frame[name], "")]
    readings = pd.DataFrame({name: numbers(frame[name]) for name in read}, frame.index).assign(disk=disk)
    readings = readings[~strange].replace([np.inf, -np.inf], np.nan)
    if manipulator:
        problems += position_problems(readings, manipulator, measurement, where)
    return [*problems, *angle_problems(readings, where)]


def _column_problems(frame: pd.DataFrame, where: str) -> Iterator[Problem]:
    """Problems with the columns of readings: unknown names, cells that are no numbers, or no readings at all."""
    for name in frame.columns.difference(MARKER_KEYS, sort=False):
        place = f"{where} column {name}"
        if name in MARKER_COLUMNS:
            yield from number_problems(frame[name], place)
        else:
            unit = other_unit(str(name), MARKER_COLUMNS)
            remedy = f": {unit}" if unit else did_you_mean(str(name), [*MARKER_KEYS, *MARKER_COLUMNS])
            yield Problem(place, f"unknown column{remedy}")
    read = [name for name in MARKER_COLUMNS if name in frame]
    if not read and not any(other_unit(str(name), MARKER_COLUMNS) for name in frame.columns):
        yield Problem(where, f"records nothing: give at least one of the columns {', '.join(MARKER_COLUMNS)}")
    elif read and all(is_empty(frame[name]).all() for name in read):
        yield Problem(where, "holds no readings: every cell is empty")


def _without_step(frame: pd.DataFrame, steps: pd.DataFrame, where: str) -> Iterator[Problem]:
    """Problems of rows whose sequence or step does not stand in the table of steps."""
    names = steps["sequence"].unique()
    for name, rows in frame[~frame["sequence"].isin(names)].groupby("sequence", sort=False):
        here = rows_of(pd.Series(True, rows.index))
        yield Problem(
            f"{where} column sequence", f"{here}: no sequence {name!r} in the steps{did_you_mean(name, names)}"
        )
    lost = ~_index(frame).isin(_index(steps))
    for (name, step), rows in frame[lost & frame["sequence"].isin(names)].groupby(["sequence", "step"], sort=False):
        here = rows_of(pd.Series(True, rows.index))
        yield Problem(f"{where} column step", f"{here}: sequence {name} has no step {step} in the steps")


def _index(frame: pd.DataFrame) -> pd.MultiIndex:
    """Sequence and step of every row, as an index."""
    return pd.MultiIndex.from_arrays([frame["sequence"], frame["step"].astype(float)])


def readings_of(raw: pd.DataFrame, steps: pd.DataFrame, plates: int, where: str, findings: Findings) -> Readings:
    """The readings of a table without problems, sorted by step, disk, kind and row.

    Repeated rows, missing readings and the like are added to the remarks of `findings`.
    """
    name = Path(where).name
    read = [kind for kind in Kind if kind.column in raw]
    frame = with_keys(raw).assign(**{kind.column: numbers(raw[kind.column]) for kind in read})
    frame["disk"] = numbers(frame["disk"]).astype(int)
    frame["row"] = _index(steps).get_indexer(_index(frame))
    columns = [kind.column for kind in read]
    repeated = frame.duplicated([*MARKER_KEYS, *columns])
    if repeated.any():
        twice = int(frame.loc[repeated, columns].notna().to_numpy().sum())
        what = f"({count(twice, 'reading')}) repeat a row before exactly and are used once"
        findings.remarks.append(f"{rows_of(repeated)} of {name} {what}")
    frame = frame[~repeated]
    again = frame.duplicated(["row", "disk"], keep=False)
    if again.any():
        markers = count(len(frame.loc[again, ["row", "disk"]].drop_duplicates()), "marker")
        findings.remarks.append(
            f"{rows_of(again)} of {name}: {markers} read more than once with different values; every reading is used"
        )
    _say_missing(frame, columns, len(steps), plates, name, findings)
    value = frame[columns].to_numpy(float)
    place, column = np.nonzero(~np.isnan(value))
    step, disk = frame["row"].to_numpy()[place], frame["disk"].to_numpy()[place]
    kind = np.array(read, int)[column]
    order = np.lexsort((place, kind, disk, step))
    return Readings(*(field[order] for field in (step, disk, kind, value[place, column])))


def _say_missing(
    frame: pd.DataFrame, columns: list[str], steps: int, plates: int, name: str, findings: Findings
) -> None:
    """Add remarks on empty cells, disks and steps without readings, and markers without a row to `findings`."""
    empty = int(frame[columns].isna().to_numpy().sum())
    if empty:
        findings.remarks.append(f"{empty} of {frame[columns].size} cells of {name} are empty: not read")
    full = frame[frame[columns].notna().any(axis=1)]
    disks = np.unique(full["disk"])
    never = np.setdiff1d(np.arange(1, plates + 1), disks)
    if len(never):
        findings.remarks.append(f"disk{'s' * (len(never) > 1)} {ranges(never)} never read")
    silent = steps - full["row"].nunique()
    if silent:
        findings.remarks.append(f"{count(silent, 'step')} without any reading")
    listed = frame.loc[frame["disk"].isin(disks), ["row", "disk"]].drop_duplicates()
    absent = len(disks) * listed["row"].nunique() - len(listed)
    if absent:
        findings.remarks.append(f"{count(absent, 'marker')} without a row in {name} at steps where others have one")
