"""Stored results of cases: a case is found by its key, whichever study asks for it and whichever run computed it.

Parts live in `<study>/.parts/`, one level below every glob over a study's results.
"""

import contextlib
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from prb3r.runs.files import clear_left_over, make_folder, replaced
from prb3r.runs.part import COUNT, KEY, Part, arrow_keys, read_part, stored_parts, write_part
from prb3r.runs.pending import drop_pending, lost_on_the_way
from prb3r.runs.states import STATES, Columns, States, picked, write_block

FOLDER = ".parts"


@dataclass(frozen=True)
class Kept:
    """Where an item of `n` cases is stored."""

    parts: tuple[Part, ...]
    """The parts that hold the item of any case; their tables of cases count as one, each below the one before it."""
    row: np.ndarray
    """(n,) row of the case in that table, -1 where no part holds the item of the case."""

    @property
    def known(self) -> np.ndarray:
        """(n,) whether the item of a case is stored."""
        return self.row >= 0

    def column(self, name: str) -> np.ndarray:
        """(n,) the column `name` of the item, if it is stored of all cases."""
        return np.concatenate([part.column(name) for part in self.parts])[self.row] if len(self.row) else np.zeros(0)


class StateRows:
    """The states of cases, of which all are stored (`place` says where): a table, one case after the other.

    `total` is its number of rows.
    """

    def __init__(self, place: Kept) -> None:
        self.files = [path for part in place.parts for path in part.states.paths]
        self.file_ends = np.cumsum([rows for part in place.parts for rows in part.states.blocks], dtype=np.int64)
        count = np.concatenate([part.column(COUNT) for part in place.parts])
        self.count = count[place.row]
        self.begin = (np.cumsum(count) - count)[place.row]
        self.ends = np.cumsum(self.count)
        self.total = int(self.ends[-1])

    def between(self, start: int, stop: int) -> tuple[np.ndarray, pa.Table]:
        """The rows from `start` to before `stop`, at least one: (rows,) index of the case of each, and their columns.

        Columns are mapped from the disk, not copied, where rows lie there in the order of the table.
        """
        first, last = np.searchsorted(self.ends, [start, stop - 1], side="right")
        some = slice(first, last + 1)
        count, before = self.count[some], int(self.ends[first] - self.count[first])
        case = np.repeat(np.arange(first, last + 1), count)
        stored = np.arange(before, before + len(case)) + np.repeat(self.begin[some] - self.ends[some] + count, count)
        cut = slice(start - before, stop - before)
        return case[cut], picked(self.files, self.file_ends, stored[cut])


class Parts:
    """The parts stored in the folder of a study, and those added during a run.

    Parameters
    ----------
    folder : folder of the study's results; the parts are in its sub-folder `.parts`.
    """

    def __init__(self, folder: Path) -> None:
        self.home = folder / FOLDER
        self.parts = list(stored_parts(self.home))
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

    def places(self, items: Sequence[str], keys: np.ndarray) -> list[Kept]:
        """Where each item of the cases with these `keys` (n,) is stored; where several parts hold it, in the last."""
        return _places(self.parts[::-1], items, keys)

    def add(self, keys: np.ndarray, cases: Columns, items: Mapping[str, str], states: States | None) -> None:
        """Store some cases as a new part; takes and raises what :func:`write_part` does."""
        self.ready()
        self.parts.append(write_part(self.home, keys, cases, items, states))

    def take(self, name: str) -> None:
        """Take in the part of that name, which a worker has written into the folder.

        Raises
        ------
        EngineError
            If it is missing or damaged.
        """
        part = read_part(self.home, name)
        if part is None:
            raise lost_on_the_way(self.home)
        self.parts.append(part)

    def adopt(self, items: Sequence[str], keys: np.ndarray, missing: np.ndarray) -> bool:
        """Copy those parts of other studies in the same folder of results that hold a missing item of a case.

        Returns whether there are any.

        Parameters
        ----------
        keys : (n,) keys of the cases.
        missing : (n, items) which items the cases lack.
        """
        self.ready()
        before = len(self.parts)
        for home in sorted(self.home.parent.parent.glob(f"*/{FOLDER}")):
            for part in _holders(list(stored_parts(home)), items, keys, missing) if home != self.home else ():
                for path in (path for path in part.files if path.exists()):  # files of states may be gone
                    with replaced(self.home / path.name) as copy:
                        shutil.copyfile(path, copy)
                self.parts.append(Part(self.home / part.path.name, part.cases))
        return len(self.parts) > before

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


def _places(parts: Sequence[Part], items: Sequence[str], keys: np.ndarray) -> list[Kept]:
    """Where each item of the cases with these `keys` (n,) is stored; where several parts hold it, in the first."""
    rows: dict[tuple[int, ...], np.ndarray] = {}
    holders = [tuple(number for number, part in enumerate(parts) if part.has(item)) for item in items]
    for numbers in holders:
        if numbers not in rows:
            rows[numbers] = _rows(keys, [parts[number] for number in numbers])
    return [Kept(tuple(parts[number] for number in numbers), rows[numbers]) for numbers in holders]


def _holders(parts: Sequence[Part], items: Sequence[str], keys: np.ndarray, missing: np.ndarray) -> list[Part]:
    """Those of the parts that hold a missing item of a case, each once; arguments as of `Parts.adopt`."""
    found: dict[Part, None] = {}
    for place, lacks in zip(_places(parts, items, keys), missing.T, strict=True):
        ends = np.cumsum([len(part.cases) for part in place.parts])
        numbers = np.unique(np.searchsorted(ends, place.row[lacks & place.known], side="right"))
        found |= dict.fromkeys(place.parts[number] for number in numbers.tolist())
    return list(found)


def _rows(keys: np.ndarray, parts: Sequence[Part]) -> np.ndarray:
    """(n,) row of the first case with each of the `keys` (n,) in the tables of parts below each other; -1 without."""
    if not parts:
        return np.full(len(keys), -1)
    stored = pa.chunked_array([chunk for part in parts for chunk in part.cases[KEY].chunks])
    return pc.index_in(arrow_keys(keys), value_set=stored).fill_null(-1).to_numpy().astype(np.int64)
