"""What is computed already, case by case: a case is known by the hash of its content, whatever study asks for it.

A part holds some cases: rows of numbers under their keys, and rows of states.  What a column depends on beside its case
(a metric's settings, the program) is the item that the column belongs to; a case may have some items and lack others.
Parts live in `<study>/.parts/`, one level below every glob over a study's results.
"""

import contextlib
import hashlib
import json
import shutil
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import repeat
from pathlib import Path

import numpy as np
import pyarrow as pa

from prb3r.runs.files import clear_left_over, make_folder, replaced
from prb3r.runs.pending import drop_pending
from prb3r.runs.sealed import read_sealed, write_sealed
from prb3r.runs.states import STATES, Columns, StateFiles, States, write_block

FOLDER = ".parts"
CASES = "cases"
ITEM, BLOCKS, KEY, COUNT = b"item", b"blocks", " key", " states"
"""Item of a column (metadata of its field) or of the states (of the table), rows of the files of states as JSON;
columns of the cases' keys and of their numbers of states."""
KEY_BYTES = 16


@dataclass(frozen=True)
class Kept:
    """Where rows are kept: (n,) part, -1 where a row is in none, and (n,) row of the part's cases."""

    part: np.ndarray
    row: np.ndarray

    @property
    def known(self) -> np.ndarray:
        """(n,) whether a row is kept, that is whether its `part` is not -1."""
        return self.part >= 0


@dataclass(frozen=True, eq=False)
class Part:
    """Some cases as they are kept."""

    path: Path
    """Of the table of cases."""
    cases: pa.Table

    @cached_property
    def items(self) -> set[str]:
        """The items that it holds something of: those named with its columns, and that of its states if it has any."""
        metadata = [self.cases.schema.metadata, *(field.metadata for field in self.cases.schema)]
        return {known[ITEM].decode() for known in metadata if known and ITEM in known}

    @cached_property
    def states(self) -> StateFiles:
        """The states of its cases, without files if there are none."""
        blocks = json.loads((self.cases.schema.metadata or {}).get(BLOCKS, b"[]"))
        return StateFiles(self.path.parent, self.path.stem, tuple(blocks))

    @property
    def files(self) -> list[Path]:
        """Its files in the order in which they are written: blocks of states, then the table of cases."""
        return [*self.states.paths, self.path]

    def has(self, item: str) -> bool:
        """Whether an item of its cases is kept whole."""
        of_states = (self.cases.schema.metadata or {}).get(ITEM) == item.encode()
        return item in self.items and (not of_states or self.states.whole)

    @cached_property
    def keys(self) -> list[bytes]:
        """What its cases are known by, in their order."""
        return self.cases[KEY].to_pylist()

    @cached_property
    def ends(self) -> np.ndarray:
        """(cases,) row of the states where those of each case end."""
        return np.cumsum(self.cases[COUNT].to_numpy())

    def column(self, name: str) -> np.ndarray:
        """A column of its cases as an array."""
        return self.cases[name].to_numpy()


class Parts:
    """The parts in the folder of a study, and those that are added.

    Parameters
    ----------
    folder : of the study's results.
    """

    def __init__(self, folder: Path) -> None:
        self.home = folder / FOLDER
        self.parts = list(_stored(self.home))
        self.made = False

    def ready(self) -> None:
        """Make the folder of the parts, once: where it is removed afterwards, the next part cannot be written.

        Raises
        ------
        EngineError
            If that cannot be.
        """
        if not self.made:
            make_folder(self.home)
            self.made = True

    def add_block(self, stem: str, number: int, columns: Columns) -> None:
        """Write a block of the states of a part that is not there yet; see :meth:`add`."""
        self.ready()
        write_block(self.home, stem, number, columns)

    def place(self, item: str, keys: Sequence[bytes]) -> Kept:
        """Where an item of the cases with these keys is kept."""
        rows: dict[bytes, int] = {}
        ends = [0]
        for part in self.parts:
            first, count = ends[-1], len(part.cases)
            if part.has(item):
                rows.update(zip(part.keys, range(first, first + count), strict=True))
            ends.append(first + count)
        index = np.fromiter(map(rows.get, keys, repeat(-1)), np.int64, len(keys))
        number = np.searchsorted(ends, index, side="right") - 1
        return Kept(number, np.where(index < 0, -1, index - np.asarray(ends)[number]))

    def add(self, keys: Sequence[bytes], cases: Columns, items: Mapping[str, str], states: "States | None") -> None:
        """Keep some cases.

        Parameters
        ----------
        cases : their columns.
        items : item of each of these columns.
        """
        self.ready()
        count = np.zeros(len(keys), np.int64) if states is None else states.count
        arrays = [pa.array(keys, pa.binary(KEY_BYTES)), pa.array(count), *(pa.array(cases[name]) for name in items)]
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
        """Copy the parts of other studies beside this one that have something of what is lacking.

        Parameters
        ----------
        lacking : keys of the cases that lack each item.
        """
        self.ready()
        for home in sorted(self.home.parent.parent.glob(f"*/{FOLDER}")):
            for part in _stored(home) if home != self.home else ():
                if any(not set(part.keys).isdisjoint(keys) for item, keys in lacking.items() if part.has(item)):
                    for path in (path for path in part.files if path.exists()):  # without states there is but one
                        with replaced(self.home / path.name) as copy:
                            shutil.copyfile(path, copy)
                    self.parts.append(Part(self.home / part.path.name, part.cases))

    def discard(self) -> None:
        """Remove the files of all parts, and forget them."""
        with contextlib.suppress(FileNotFoundError):
            shutil.rmtree(self.home)
        self.parts, self.made = [], False

    def clear(self, outdated: Callable[[str], bool]) -> None:
        """Remove the parts all of whose items are outdated, and what interrupted runs have left."""
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
    """A column of cases that are all kept."""
    out: np.ndarray | None = None
    for number in present(place.part):
        rows, values = place.part == number, parts.parts[number].column(name)
        out = np.empty(len(rows), values.dtype) if out is None else out
        out[rows] = values[place.row[rows]]
    return np.zeros(0) if out is None else out


def present(part: np.ndarray) -> np.ndarray:
    """The numbers that occur among those of parts, ascending."""
    return np.flatnonzero(np.bincount(part))


def state_counts(parts: Parts, place: Kept) -> np.ndarray:
    """(n,) number of states of cases that are all kept."""
    return _states(parts, place)[0]


def rows_of_states(
    parts: Parts, place: Kept, ends: np.ndarray, rows: slice
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of some rows of the states of cases in their order: the index of the case, its part and its row of states there.

    Parameters
    ----------
    ends : (n,) row where the states of each case end.
    """
    row = np.arange(rows.start, rows.stop)
    case = np.searchsorted(ends, row, side="right")
    some = slice(case[0], case[-1] + 1) if len(case) else slice(0, 0)
    count, begin = _states(parts, Kept(place.part[some], place.row[some]))
    within = case - some.start
    return case, place.part[case], begin[within] + row - (ends[case] - count[within])


def _states(parts: Parts, place: Kept) -> tuple[np.ndarray, np.ndarray]:
    """Of every case, the number of its states and the row of the first among those of its part."""
    count, begin = np.zeros(len(place.part), np.int64), np.zeros(len(place.part), np.int64)
    for number in present(place.part):
        rows, ends = place.part == number, parts.parts[number].ends
        at = place.row[rows]
        count[rows] = np.diff(ends, prepend=0)[at]
        begin[rows] = ends[at] - count[rows]
    return count, begin


def _stored(home: Path) -> Iterator[Part]:
    """The parts in a folder, sorted by name, but for those whose table of cases is damaged."""
    for path in sorted(home.glob(f"*.{CASES}")):
        cases = read_sealed(path, f"{CASES} {path.stem}")
        if cases is not None:
            yield Part(path, cases)


def part_name(keys: Iterable[bytes], items: Iterable[str]) -> str:
    """Of a part: the same for the same content."""
    text = json.dumps(sorted(items)).encode()
    return hashlib.blake2b(b"".join(keys) + text, digest_size=8).hexdigest()
