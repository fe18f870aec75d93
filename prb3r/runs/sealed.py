"""Tables in files that carry a checksum of their content, so that damage is noticed, and the kind of table they hold.

A reader gets what was written, or nothing: truncated, corrupted and foreign files are found by their checksum, a table
of one kind under the name of another by its kind.  Writing therefore does not wait for the disk: a file that a power
cut tears counts as missing afterwards.  The content is memory-mapped, not read; `is_sealed` reads it piece by piece.

The checksum is CRC-32, as of the pages of Parquet.  A cryptographic digest, which finds forgeries too, takes five times
as long.
"""

import zlib
from pathlib import Path

import pyarrow as pa

from prb3r.runs.files import replaced

MAGIC = b"prb3r sealed 2\n\0"
HEADER = 64
"""Bytes before the content: a multiple of 64, which keeps columns aligned in memory."""
KIND = b"kind"
"""Metadata key of the table for its kind."""
PIECE = 2**20
"""Bytes that `is_sealed` reads at once."""


def write_sealed(path: Path, kind: str, table: pa.Table) -> None:
    """Write a table of a kind to `path`, whole or not at all.

    Raises
    ------
    EngineError
        If the disk is full, or the folder is missing or not writable.
    """
    table = table.replace_schema_metadata({**(table.schema.metadata or {}), KIND: kind.encode()})
    sink = pa.BufferOutputStream()
    with pa.ipc.new_file(sink, table.schema) as writer:
        writer.write_table(table.combine_chunks())
    content = sink.getvalue()
    with replaced(path, lasting=False, make_folder=False) as temporary, open(temporary, "wb") as file:
        file.write(_header(content))
        file.write(content)


def read_sealed(path: Path, kind: str) -> pa.Table | None:
    """The table in a file, memory-mapped; None if there is no file, or it is damaged or holds another kind of table."""
    try:
        with pa.memory_map(str(path)) as file:
            whole = file.read_buffer()
        content = whole[HEADER:]
        if whole[:HEADER].to_pybytes() != _header(content):
            return None
        table = pa.ipc.open_file(content).read_all()
    except (pa.ArrowException, OSError, ValueError):  # also of a folder, an empty file, a foreign one
        return None
    return table if (table.schema.metadata or {}).get(KIND) == kind.encode() else None


def is_sealed(path: Path, kind: str) -> bool:
    """Whether a file holds an undamaged table of that kind; at most `PIECE` bytes of it are in memory at once."""
    checksum, piece = 0, memoryview(bytearray(PIECE))
    try:
        with open(path, "rb", buffering=0) as file:
            header = file.read(HEADER)
            while count := file.readinto(piece):
                checksum = zlib.crc32(piece[:count], checksum)
        return header == _sealed(checksum) and (mapped(path).schema.metadata or {}).get(KIND) == kind.encode()
    except (pa.ArrowException, OSError, ValueError):
        return False


def mapped(path: Path) -> pa.Table:
    """The table in a file that is known to be undamaged, memory-mapped: pages are read when they are used."""
    with pa.memory_map(str(path)) as file:
        return pa.ipc.open_file(file.read_buffer()[HEADER:]).read_all()


def _header(content: pa.Buffer) -> bytes:
    """The header of a file with this content."""
    return _sealed(zlib.crc32(content))


def _sealed(checksum: int) -> bytes:
    """The header of a file whose content has this checksum."""
    return (MAGIC + checksum.to_bytes(4, "big")).ljust(HEADER, b"\0")
