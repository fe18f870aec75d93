"""Tables that say themselves whether they are whole: a digest before the content, the kind of table within it.

What is read back is what was written, or nothing: cut off, flipped or foreign files are told by their digest, a table
of one kind under the name of another by its kind.  So nobody waits until the disk has them: what a power cut tears is
missing afterwards.  The content is mapped into memory, not read; a digest alone is checked by reading, piece by piece.
"""

import hashlib
from pathlib import Path

import pyarrow as pa

from prb3r.runs.files import replaced

MAGIC = b"prb3r sealed 1\n\0"
HEADER = 64
"""Bytes before the content: as many as keep columns aligned in memory."""
DIGEST = 16
KIND = b"kind"
"""Key of the table's metadata that says what it holds."""
PIECE = 2**20
"""Bytes that are read at once where a digest is checked."""


def write_sealed(path: Path, kind: str, table: pa.Table) -> None:
    """Write a table whole or not at all.

    Raises
    ------
    EngineError
        If the disk is full or the folder is not there or does not take it.
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
    """The table of that kind in a file; None if there is none, or if it is damaged."""
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
    """Whether a file holds an undamaged table of that kind; no more than a piece of it is in memory."""
    digest = hashlib.blake2b(digest_size=DIGEST)
    try:
        with open(path, "rb", buffering=0) as file:
            header = file.read(HEADER)
            while piece := file.read(PIECE):
                digest.update(piece)
        return header == _sealed(digest.digest()) and (mapped(path).schema.metadata or {}).get(KIND) == kind.encode()
    except (pa.ArrowException, OSError, ValueError):
        return False


def mapped(path: Path) -> pa.Table:
    """The table in a file that is known to be undamaged, in memory only where it is looked at."""
    with pa.memory_map(str(path)) as file:
        return pa.ipc.open_file(file.read_buffer()[HEADER:]).read_all()


def _header(content: pa.Buffer) -> bytes:
    return _sealed(hashlib.blake2b(content, digest_size=DIGEST).digest())


def _sealed(digest: bytes) -> bytes:
    return (MAGIC + digest).ljust(HEADER, b"\0")
