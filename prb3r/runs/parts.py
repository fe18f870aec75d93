"""Stored results of cases: a case is found by its key, the hash of its content, whichever study asks for it.

A part is a table of some cases: one row of numbers for each key, and rows of states in files of their own.  Each column
belongs to an item, which names what the column depends on beside its case (the settings of a metric, the program text);
a case may have some items and lack others.  Parts live in `<study>/.parts/`, one level below every glob over a study's
results.
"""

import contextlib
import hashlib
import json
import shutil
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from prb3r.runs.files import clear_left_over, make_folder, replaced
from prb3r.runs.pending import drop_pending
from prb3r.runs.sealed import read_sealed, write_sealed
from prb3r.runs.states import STATES, Columns, StateFiles, States, write_block

FOLDER = ".parts"
CASES = "cases"
"""Suffix of the tables of cases, and the kind of table under which they are sealed."""
ITEM, BLOCKS, KEY, COUNT = b"item", b"blocks", " key", " states"
"""`ITEM`: metadata key for the item of a column (on its field) or of the states (on the table).  `BLOCKS`: metadata key
of the table for the numbers of rows in the files of states, as JSON.  `KEY`, `COUNT`: columns of the keys of the cases
and of their numbers of rows of states."""
KEY_TYPE = np.dtype("V16")
"""Type of the key of a case: 16 bytes."""


@dataclass(frozen=True)
class Kept:
    """Where an item of `n` cases is stored among the parts."""

    part: np.ndarray
    """(n,) number of the part, -1 where no part holds the item of the case."""
    row: np.ndarray
    """(n,) row of the case in that part, -1 where there is none."""

    @property
    def known(self) -> np.ndarray:
        """(n,) whether the item of a case is stored, that is whether its `part` is not -1."""
        return self.part >= 0


@dataclass(frozen=True, eq=False)
class Part:
    """Some cases as stored on disk."""

    path: Path
    """File of the table of cases."""
    cases: pa.Table
    """One row for each case: its key, its number of states, and the columns of its items."""

    @cached_property
    def items(self) -> set[str]:
        """The items of the columns of the part, and the item of its states if it has any."""
        metadata = [self.cases.schema.metadata, *(field.metadata for field in self.cases.schema)]
        return {known[ITEM].decode() for known in metadata if known and ITEM in known}

    @cached_property
    def states(self) -> StateFiles:
        """The files of states of the part, none if no states were kept."""
        blocks = json.loads((self.cases.schema.metadata or {}).get(BLOCKS, b"[]"))
        return StateFiles(self.path.parent, self.path.stem, tuple(blocks))

    @property
    def files(self) -> list[Path]:
        """The files of the part in the order in which they are written: blocks of states, then the table of cases."""
        return [*self.states.paths, self.path]

    def has(self, item: str) -> bool:
        """Whether the part holds an item; states count only if all their files are undamaged."""
        of_states = (self.cases.schema.metadata or {}).get(ITEM) == item.encode()
        return item in self.items and (not of_states or self.states.whole)

    @cached_property
    def ends(self) -> np.ndarray:
        """(cases,) row after the last state of each case, in the states of the part."""
        return np.cumsum(self.cases[COUNT].to_numpy())

    def column(self, name: str) -> np.ndarray:
        """(cases,) a column of the table of cases."""
        return self.cases[name].to_numpy()


class Parts:
    """The parts stored in the folder of a study, and those added during a run.

    Parameters
    ----------
    folder : folder of the study's results; the parts are in its sub-folder `.parts`.
    """

    def __init__(self, folder: Path) -> None:
        self.home = folder / FOLDER
        self.parts = list(_stored(self.home))
        self.made = False

    def ready(self) -> None:
        """Make the folder of the parts, at the first call only.

        If the folder is removed afterwards, writing the next part fails instead of starting a new folder.

        Raises
        ------
        EngineError
            If the folder cannot be made.
        """
        if not self.made:
            make_folder(self.home)
            self.made = True

    def add_block(self, stem: str, number: int, columns: Columns) -> None:
        """Write block `number` of the states of a part that :meth:`add` completes later; its name will be `stem`."""
        self.ready()
        write_block(self.home, stem, number, columns)

    def place(self, item: str, keys: np.ndarray) -> Kept:
        """Where an item of the cases with these `keys` (n,) is stored; where several parts hold it, in the last of
        them."""
        holders = [number for number, part in enumerate(self.parts) if part.has(item)][::-1]
        if not holders:
            return Kept(np.full(len(keys), -1), np.full(len(keys), -1))
        stored = pa.chunked_array([chunk for number in holders for chunk in self.parts[number].cases[KEY].chunks])
        index = pc.index_in(_arrow_keys(keys), value_set=stored).fill_null(-1).to_numpy()  # of the first that is equal
        first = np.cumsum([0, *(len(self.parts[number].cases) for number in holders)])
        holder = np.searchsorted(first, index, side="right") - 1
        known = index >= 0
        return Kept(np.where(known, np.asarray(holders)[holder], -1), np.where(known, index - first[holder], -1))

    def add(self, keys: np.ndarray, cases: Columns, items: Mapping[str, str], states: "States | None") -> None:
        """Store some cases as a new part.

        Parameters
        ----------
        keys : (cases,) key of each case.
        cases : columns of the cases.
        items : item of each column to be stored; other columns are left out.
        states : rows of states of the cases; None if states are not among what was computed.
        """
        self.ready()
        count = np.zeros(len(keys), np.int64) if states is None else states.count
        arrays = [_arrow_keys(keys), pa.array(count), *(pa.array(cases[name]) for name in items)]
        fields = [pa.field(KEY, arrays[0].type), pa.field(COUNT, arrays[1].type)]
        fields += [
            pa.field(name, array.type, metadata={ITEM: item})
            for array, (name, item) in zip(arrays[2:], items.items(), strict=True)
        ]
        name = part_name(keys, [*items.values(), *([states.item] if states else [])])
        path, table = self.home / f"{name}.{CASES}", pa.table(arrays, pa.schema(fields))
        if states is not None:
            blocks = states.blocks
            if states.columns is not None:
                write_block(self.home, name, 0, states.columns)
                blocks = (int(count.sum()),)
            table = table.replace_schema_metadata({ITEM: states.item, BLOCKS: json.dumps(blocks)})
        write_sealed(path, f"{CASES} {name}", table)
        self.parts.append(Part(path, table))

    def adopt(self, lacking: Mapping[str, Collection[bytes]]) -> None:
        """Copy those parts of other studies in the same folder of results that hold a lacking item of a case.

        Parameters
        ----------
        lacking : for each item, the keys of the cases that lack it.
        """
        self.ready()
        for home in sorted(self.home.parent.parent.glob(f"*/{FOLDER}")):
            for part in _stored(home) if home != self.home else ():
                held = set(part.cases[KEY].to_pylist())
                if any(not held.isdisjoint(keys) for item, keys in lacking.items() if part.has(item)):
                    for path in (path for path in part.files if path.exists()):  # files of states may be gone
                        with replaced(self.home / path.name) as copy:
                            shutil.copyfile(path, copy)
                    self.parts.append(Part(self.home / part.path.name, part.cases))

    def discard(self) -> None:
        """Remove the folder of the parts with all its files, and forget the parts."""
        with contextlib.suppress(FileNotFoundError):
            shutil.rmtree(self.home)
        self.parts, self.made = [], False

    def clear(self, outdated: Callable[[str], bool]) -> None:
        """Remove the parts all of whose items are `outdated`, files of states without a part, and other leftovers of
        interrupted runs."""
        kept = set()
        for part in self.parts:
            if all(outdated(item) for item in part.items):
                part.path.unlink(missing_ok=True)
            else:
                kept.update(part.files)
        for path in set(self.home.glob(f"*.{STATES}")) - kept:
            path.unlink(missing_ok=True)
        drop_pending(self.home)
        clear_left_over(self.home)


def gathered(parts: Parts, place: Kept, name: str) -> np.ndarray:
    """(n,) the column `name` of `n` cases, all of which are stored; `place` says where."""
    out: np.ndarray | None = None
    for number in present(place.part):
        rows, values = place.part == number, parts.parts[number].column(name)
        out = np.empty(len(rows), values.dtype) if out is None else out
        out[rows] = values[place.row[rows]]
    return np.zeros(0) if out is None else out


def present(part: np.ndarray) -> np.ndarray:
    """The numbers of parts that occur in `part`, ascending, each once."""
    return np.flatnonzero(np.bincount(part))


def state_counts(parts: Parts, place: Kept) -> np.ndarray:
    """(n,) number of rows of states of each of `n` cases, all of which are stored."""
    return _states(parts, place)[0]


def rows_of_states(
    parts: Parts, place: Kept, ends: np.ndarray, rows: slice
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where some rows of the table of states of `n` cases are stored: three arrays, one entry for each row.

    The table has the states of the cases one after the other.  The arrays are the index of the case, the number of its
    part, and the row among the states of that part.

    Parameters
    ----------
    ends : (n,) row of the table after the last state of each case.
    rows : the rows of the table that are asked for.
    """
    row = np.arange(rows.start, rows.stop)
    case = np.searchsorted(ends, row, side="right")
    some = slice(case[0], case[-1] + 1) if len(case) else slice(0, 0)
    count, begin = _states(parts, Kept(place.part[some], place.row[some]))
    within = case - some.start
    return case, place.part[case], begin[within] + row - (ends[case] - count[within])


def _states(parts: Parts, place: Kept) -> tuple[np.ndarray, np.ndarray]:
    """(n,) number of states of each case and (n,) row of the first of them among the states of its part."""
    count, begin = np.zeros(len(place.part), np.int64), np.zeros(len(place.part), np.int64)
    for number in present(place.part):
        rows, ends = place.part == number, parts.parts[number].ends
        at = place.row[rows]
        count[rows] = np.diff(ends, prepend=0)[at]
        begin[rows] = ends[at] - count[rows]
    return count, begin


def _stored(home: Path) -> Iterator[Part]:
    """The parts stored in a folder, sorted by name, without those whose table of cases is damaged."""
    for path in sorted(home.glob(f"*.{CASES}")):
        cases = read_sealed(path, f"{CASES} {path.stem}")
        if cases is not None:
            yield Part(path, cases)


def part_name(keys: np.ndarray, items: Iterable[str]) -> str:
    """Name of a part, 16 hexadecimal digits: the hash of the `keys` (cases,) of its cases and of its items."""
    text = json.dumps(sorted(items)).encode()
    return hashlib.blake2b(keys.tobytes() + text, digest_size=8).hexdigest()


def _arrow_keys(keys: np.ndarray) -> pa.Array:
    """Keys (n,) of cases as an Arrow array of their bytes."""
    content = [None, pa.py_buffer(np.ascontiguousarray(keys, KEY_TYPE))]
    return pa.FixedSizeBinaryArray.from_buffers(pa.binary(KEY_TYPE.itemsize), len(keys), content)
