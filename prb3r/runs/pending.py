"""Results of tasks that are not part of a stored case yet: a run that ends half-way leaves them for the next one.

A large case, a cloud of loads, is solved in blocks.  The columns of each solved block are kept beside its states, and
are removed when the whole case is stored as a part.
"""

from pathlib import Path

import pyarrow as pa

from prb3r.errors import EngineError, Problem
from prb3r.runs.sealed import is_sealed, mapped, read_sealed, write_sealed
from prb3r.runs.states import STATES, Columns, block_path

PENDING = "pending"
"""Suffix of these files, and the kind of table under which they are sealed."""


def write_pending(home: Path, stem: str, number: int, columns: Columns) -> None:
    """Write the columns of block `number` of a case; raises what `write_sealed` raises.

    Parameters
    ----------
    stem : name of the part that the case becomes.
    """
    path = pending_path(home, stem, number)
    write_sealed(path, f"{PENDING} {path.stem}", pa.table({name: pa.array(values) for name, values in columns.items()}))


def read_pending(home: Path, stem: str, number: int, states: bool) -> tuple[Columns, int] | None:
    """The stored columns of block `number` and its number of rows of states; None if they are missing or damaged.

    Parameters
    ----------
    stem : name of the part that the case becomes.
    states : whether the block must have undamaged states too; where not, its number of rows is given as 0.
    """
    path, block = pending_path(home, stem, number), block_path(home, stem, number)
    if not path.exists() or (states and not is_sealed(block, f"{STATES} {block.stem}")):
        return None
    table = read_sealed(path, f"{PENDING} {path.stem}")
    if table is None:
        return None
    return {name: table[name].to_numpy() for name in table.column_names}, mapped(block).num_rows if states else 0


def lost_on_the_way(home: Path) -> EngineError:
    """The error that what workers have written into the folder `home` is not there, or not whole."""
    return EngineError(Problem(str(home), "what workers have written there is gone or damaged"))


def drop_pending(home: Path, stem: str = "*") -> None:
    """Remove the stored columns of all blocks of the case that becomes the part `stem`, or of all cases."""
    for path in home.glob(f"{stem}-*.{PENDING}"):
        path.unlink(missing_ok=True)


def pending_path(home: Path, stem: str, number: int) -> Path:
    """Path of the stored columns of block `number` of the case that becomes the part `stem`."""
    return home / f"{stem}-{number}.{PENDING}"
