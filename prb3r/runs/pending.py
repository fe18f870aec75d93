"""Blocks of a case that is not whole yet: a run that ends half-way leaves them for the next one.

What all blocks are gathered into is kept beside the states of each, and goes when the case is there as a part.
"""

from pathlib import Path

import pyarrow as pa

from prb3r.runs.sealed import is_sealed, mapped, read_sealed, write_sealed
from prb3r.runs.states import STATES, Columns, block_path

PENDING = "pending"


def write_pending(home: Path, stem: str, number: int, columns: Columns) -> None:
    """Keep what a block gives to its case; raises what `write_sealed` raises.

    Parameters
    ----------
    stem : name of the part that the case becomes.
    """
    path = pending_path(home, stem, number)
    write_sealed(path, f"{PENDING} {path.stem}", pa.table({name: pa.array(values) for name, values in columns.items()}))


def read_pending(home: Path, stem: str, number: int, states: bool) -> tuple[Columns, int] | None:
    """What an earlier run has kept of a block, and the number of its rows of states; None if there is no such block.

    Parameters
    ----------
    states : whether its states must be there, whole.
    """
    path, block = pending_path(home, stem, number), block_path(home, stem, number)
    if not path.exists() or (states and not is_sealed(block, f"{STATES} {block.stem}")):
        return None
    table = read_sealed(path, f"{PENDING} {path.stem}")
    if table is None:
        return None
    return {name: table[name].to_numpy() for name in table.column_names}, mapped(block).num_rows if states else 0


def drop_pending(home: Path, stem: str = "*") -> None:
    """Remove what is kept of the blocks of a case, or of all cases."""
    for path in home.glob(f"{stem}-*.{PENDING}"):
        path.unlink(missing_ok=True)


def pending_path(home: Path, stem: str, number: int) -> Path:
    """The file of what a block gives to its case."""
    return home / f"{stem}-{number}.{PENDING}"
