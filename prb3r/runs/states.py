"""Rows of states of the cases of a part, in one file or in blocks of rows, of which as few as possible are in memory.

A file is read through once to see that it is whole.  Afterwards it is mapped for as long as some rows are picked from
it and not longer, so that the memory depends on the rows that are asked for alone, whatever the number of all rows.
"""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa

from prb3r.runs.sealed import is_sealed, mapped, write_sealed

STATES = "states"

Columns = dict[str, np.ndarray]
"""Columns of a table by their names, all of one length."""


@dataclass(frozen=True)
class States:
    """Rows of states of some cases, one case after the other."""

    item: str
    count: np.ndarray
    """(cases,) rows of each."""
    columns: Columns | None
    """None: they are in files already."""
    blocks: tuple[int, ...] = ()
    """Rows of each of these files."""


@dataclass(frozen=True, eq=False)
class StateFiles:
    """The states of a part as they are kept."""

    home: Path
    stem: str
    """Name of the part."""
    blocks: tuple[int, ...]
    """Rows of each file."""

    @property
    def paths(self) -> list[Path]:
        """The files of its blocks, in the order of the rows."""
        return [block_path(self.home, self.stem, number) for number in range(len(self.blocks))]

    @cached_property
    def whole(self) -> bool:
        """Whether every file of its blocks is there and has the content that its digest says; checked once."""
        return all(is_sealed(path, f"{STATES} {path.stem}") for path in self.paths)

    def picked(self, rows: np.ndarray, names: Collection[str]) -> Columns:
        """Columns of some rows, at least one; nothing else stays in memory."""
        ends = np.cumsum(self.blocks)
        within = np.searchsorted(ends, rows, side="right")
        out: Columns = {}
        for number in np.unique(within):
            here = within == number
            local = rows[here] - (ends[number] - self.blocks[number])
            table, first = mapped(self.paths[number]), int(local.min())
            for name in names:
                values = table[name].slice(first, int(local.max()) + 1 - first).to_numpy()
                out.setdefault(name, np.empty(len(rows), values.dtype))[here] = values[local - first]
        return out


def block_path(home: Path, stem: str, number: int) -> Path:
    """The file of a block of the states of a part; the first is named like the part."""
    return home / f"{stem}{f'-{number}' if number else ''}.{STATES}"


def write_block(home: Path, stem: str, number: int, columns: Columns) -> None:
    """Write a block of the states of a part; raises what `write_sealed` raises."""
    path = block_path(home, stem, number)
    write_sealed(path, f"{STATES} {path.stem}", pa.table({name: pa.array(values) for name, values in columns.items()}))
