"""A part: a table of some cases on disk, with their rows of states in files of their own.

A case is found by its key, the hash of its content.  Each column of the table belongs to an item, which names what the
column depends on beside its case (the settings of a metric, the program text); a part may have some items and lack
others.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from prb3r.runs.sealed import read_sealed, write_sealed
from prb3r.runs.states import Columns, StateFiles, States, write_block

CASES = "cases"
"""Suffix of the tables of cases, and the kind of table under which they are sealed."""
ITEM, BLOCKS, KEY, COUNT = b"item", b"blocks", " key", " states"
"""`ITEM`: metadata key for the item of a column (on its field) or of the states (on the table).  `BLOCKS`: metadata key
of the table for the numbers of rows in the files of states, as JSON.  `KEY`, `COUNT`: columns of the keys of the cases
and of their numbers of rows of states."""
KEY_TYPE = np.dtype("V16")
"""Type of the key of a case: 16 bytes."""


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

    def column(self, name: str) -> np.ndarray:
        """(cases,) a column of the table of cases."""
        return self.cases[name].to_numpy()


def write_part(home: Path, keys: np.ndarray, cases: Columns, items: Mapping[str, str], states: States | None) -> Part:
    """Write some cases as a part into the folder `home` of the parts; raises what `write_sealed` raises.

    Parameters
    ----------
    keys : (cases,) key of each case.
    cases : columns of the cases.
    items : item of each column to be stored; other columns are left out.
    states : rows of states of the cases; None if states are not among what was computed.
    """
    count = np.zeros(len(keys), np.int64) if states is None else states.count
    arrays = [arrow_keys(keys), pa.array(count), *(pa.array(cases[name]) for name in items)]
    fields = [pa.field(KEY, arrays[0].type), pa.field(COUNT, arrays[1].type)]
    fields += [
        pa.field(name, array.type, metadata={ITEM: item})
        for array, (name, item) in zip(arrays[2:], items.items(), strict=True)
    ]
    name = part_name(keys, [*items.values(), *([states.item] if states else [])])
    path, table = home / f"{name}.{CASES}", pa.table(arrays, pa.schema(fields))
    if states is not None:
        blocks = states.blocks
        if states.columns is not None:
            write_block(home, name, 0, states.columns)
            blocks = (int(count.sum()),)
        table = table.replace_schema_metadata({ITEM: states.item, BLOCKS: json.dumps(blocks)})
    write_sealed(path, f"{CASES} {name}", table)
    return Part(path, table)


def read_part(home: Path, name: str) -> Part | None:
    """The part of that name in a folder of parts; None if there is none, or if its table of cases is damaged."""
    path = home / f"{name}.{CASES}"
    cases = read_sealed(path, f"{CASES} {name}")
    return None if cases is None else Part(path, cases)


def stored_parts(home: Path) -> Iterator[Part]:
    """The parts stored in a folder, sorted by name, without those whose table of cases is damaged."""
    found = (read_part(home, path.stem) for path in sorted(home.glob(f"*.{CASES}")))
    return (part for part in found if part is not None)


def part_name(keys: np.ndarray, items: Iterable[str]) -> str:
    """Name of a part, 16 hexadecimal digits: the hash of the `keys` (cases,) of its cases and of its items."""
    text = json.dumps(sorted(items)).encode()
    return hashlib.blake2b(keys.tobytes() + text, digest_size=8).hexdigest()


def arrow_keys(keys: np.ndarray) -> pa.Array:
    """Keys (n,) of cases as an Arrow array of their bytes."""
    content = [None, pa.py_buffer(np.ascontiguousarray(keys, KEY_TYPE))]
    return pa.FixedSizeBinaryArray.from_buffers(pa.binary(KEY_TYPE.itemsize), len(keys), content)


def first_of_each(keys: np.ndarray) -> np.ndarray:
    """(n,) whether each of the `keys` (n,) of cases stands there for the first time."""
    known = arrow_keys(keys)
    return pc.index_in(known, value_set=known).to_numpy() == np.arange(len(keys))
