"""The table of states of the cases of a part, kept on disk in one file or in several, one for each block of rows.

Each file is read through once for its checksum.  Afterwards a file is memory-mapped only while rows are picked from it,
so that the memory used depends on the number of rows picked and not on the number of rows in the files.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa

from prb3r.runs.sealed import is_sealed, mapped, write_sealed

STATES = "states"
"""Suffix of the files of states, and the kind of table under which they are sealed."""

Columns = dict[str, np.ndarray]
"""Columns of a table by their names, all of one length."""


@dataclass(frozen=True)
class States:
    """Rows of states of some cases, one case after the other, as they are handed to `Parts.add`."""

    item: str
    """The item that the states belong to, see `parts`."""
    count: np.ndarray
    """(cases,) number of rows of states of each case."""
    columns: Columns | None
    """Columns of states; None: the rows are in files already."""
    blocks: tuple[int, ...] = ()
    """Number of rows in each of these files; empty where `columns` are given."""


@dataclass(frozen=True, eq=False)
class StateFiles:
    """The states of a part as files on disk."""

    home: Path
    """Folder of the parts."""
    stem: str
    """Name of the part."""
    blocks: tuple[int, ...]
    """Number of rows in each file."""

    @property
    def paths(self) -> list[Path]:
        """The files of states, in the order of the rows."""
        return [block_path(self.home, self.stem, number) for number in range(len(self.blocks))]

    @cached_property
    def whole(self) -> bool:
        """Whether every file of states exists and matches its checksum; checked once."""
        return all(is_sealed(path, f"{STATES} {path.stem}") for path in self.paths)


def picked(files: Sequence[Path], ends: np.ndarray, rows: np.ndarray) -> pa.Table:
    """Some `rows`, at least one, of files of states that count as one table, each below the one before it.

    Rows that follow each other in a file are mapped from it and not copied.

    Parameters
    ----------
    ends : (files,) row of that table after the last one of each file.
    """
    holder = np.searchsorted(ends, rows, side="right")
    tables, places = [], []
    for number in dict.fromkeys(holder[np.diff(holder, prepend=-1) != 0].tolist()):
        here = np.flatnonzero(holder == number)
        table = mapped(files[number])
        local = rows[here] - (ends[number] - table.num_rows)
        tables.append(table.slice(local[0], len(local)) if _consecutive(local) else table.take(local))
        places.append(here)
    whole, place = pa.concat_tables(tables), np.concatenate(places)
    return whole if _consecutive(place) else whole.combine_chunks().take(np.argsort(place))


def _consecutive(rows: np.ndarray) -> bool:
    """Whether each number of a row follows the one before it."""
    return bool((np.diff(rows) == 1).all())


def block_path(home: Path, stem: str, number: int) -> Path:
    """Path of block `number` (from 0) of the states of the part named `stem`; block 0 has the bare name of the part."""
    return home / f"{stem}{f'-{number}' if number else ''}.{STATES}"


def write_block(home: Path, stem: str, number: int, columns: Columns) -> None:
    """Write block `number` of the states of the part named `stem`, with nan as missing values.

    Raises what `write_sealed` raises.
    """
    path = block_path(home, stem, number)
    arrays = {name: _missing_where_nan(values) for name, values in columns.items()}
    write_sealed(path, f"{STATES} {path.stem}", pa.table(arrays))


def _missing_where_nan(values: np.ndarray) -> pa.Array:
    """Values as an Arrow array with nan as missing values; without any they are not copied, which takes a sixth of the
    time."""
    return pa.array(values, from_pandas=bool(np.isnan(values).any()))
