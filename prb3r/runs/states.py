"""The table of states of the cases of a part, kept on disk in one file or in several, one for each block of rows.

Each file is read through once for its checksum.  Afterwards a file is memory-mapped only while rows are picked from it,
so that the memory used depends on the number of rows picked and not on the number of rows in the files.
"""

from collections.abc import Collection
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

    def picked(self, rows: np.ndarray, names: Collection[str]) -> Columns:
        """The columns `names` at `rows`, at least one, numbered through all blocks; nothing else stays in memory."""
        ends = np.cumsum(self.blocks)
        within = np.searchsorted(ends, rows, side="right")
        out: Columns = {}
        for number in np.unique(within):
            here = as_slice(np.flatnonzero(within == number))
            local = rows[here] - (ends[number] - self.blocks[number])
            table, first = mapped(self.paths[number]), int(local.min())
            taken = as_slice(local - first)
            for name in names:
                values = table[name].slice(first, int(local.max()) + 1 - first).to_numpy()
                out.setdefault(name, np.empty(len(rows), values.dtype))[here] = values[taken]
        return out


def as_slice(rows: np.ndarray) -> np.ndarray | slice:
    """Numbers of rows, at least one, as a slice if each follows the one before it; NumPy takes a slice sooner."""
    return slice(int(rows[0]), int(rows[-1]) + 1) if (np.diff(rows) == 1).all() else rows


def block_path(home: Path, stem: str, number: int) -> Path:
    """Path of block `number` (from 0) of the states of the part named `stem`; block 0 has the bare name of the part."""
    return home / f"{stem}{f'-{number}' if number else ''}.{STATES}"


def write_block(home: Path, stem: str, number: int, columns: Columns) -> None:
    """Write block `number` of the states of the part named `stem`; raises what `write_sealed` raises."""
    path = block_path(home, stem, number)
    write_sealed(path, f"{STATES} {path.stem}", pa.table({name: pa.array(values) for name, values in columns.items()}))
