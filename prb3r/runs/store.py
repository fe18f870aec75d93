"""Parquet tables of a study run: one pinned schema, atomic writes, and parts that make a run resumable.

Parts live in `results/<study>/.parts/<hash>/`, one level below every `*.parquet` glob over a study's results.
"""

import contextlib
import errno
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from prb3r.errors import EngineError, Problem, SpecError
from prb3r.quantities import Quantity, describe

ROW_GROUP = 65_536
"""Rows of a row group in final tables, whatever the parts were."""

PROVENANCE = b"prb3r"
"""Key of the file metadata that holds the provenance as JSON."""

PART = b"prb3r part"
"""Key of the file metadata that says what a part was computed from."""


def arrow_table(
    columns: Mapping[str, Any], quantities: Iterable[Quantity] = (), provenance: Mapping[str, Any] | None = None
) -> pa.Table:
    """A table of float64, int64, bool and text columns without nan, each field with its unit and description.

    Parameters
    ----------
    columns
        Arrays or sequences of one length.  None and nan are missing values.
    quantities
        What is not in the nomenclature, such as metrics.
    provenance
        Goes into the file's metadata; the same for the same spec, or the bytes of the file would differ.
    """
    known = {quantity.name: quantity for quantity in quantities}
    arrays = [_array(values) for values in columns.values()]
    fields = [
        pa.field(name, array.type, metadata=_metadata(known.get(name) or describe(name)))
        for name, array in zip(columns, arrays, strict=True)
    ]
    metadata = {PROVENANCE: canonical(provenance)} if provenance is not None else None
    return pa.table(arrays, schema=pa.schema(fields, metadata))


def _array(values: Any) -> pa.Array:
    array = values.combine_chunks() if isinstance(values, pa.ChunkedArray) else pa.array(values, from_pandas=True)
    if pa.types.is_dictionary(array.type) or pa.types.is_large_string(array.type):
        return array.cast(pa.string())
    if pa.types.is_floating(array.type):
        return array.cast(pa.float64())
    return array.cast(pa.int64()) if pa.types.is_integer(array.type) else array


def _settled(schema: pa.Schema) -> pa.Schema:
    """The schema with a type for columns in which every value is missing."""
    for index, field in enumerate(schema):
        if pa.types.is_null(field.type):
            text = (field.metadata or {}).get(b"unit") == b""
            schema = schema.set(index, field.with_type(pa.string() if text else pa.float64()))
    return schema


def _metadata(quantity: Quantity) -> dict[str, str]:
    return {"unit": quantity.unit, "description": quantity.meaning}


def provenance(path: Path) -> dict[str, Any]:
    """What a table was made from, as given to :func:`table`."""
    return json.loads((pq.read_schema(path).metadata or {}).get(PROVENANCE, b"{}"))


def canonical(content: Any) -> str:
    """JSON with sorted keys and shortest exact floats: equal for equal content.

    Raises
    ------
    ValueError
        For nan and inf, which have no place in a spec.
    """
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)


def content_hash(content: Any) -> str:
    """SHA-256 of canonical JSON."""
    return hashlib.sha256(canonical(content).encode()).hexdigest()


def write_arrow(data: pa.Table, path: Path) -> None:
    """Write a whole table or nothing.

    Raises
    ------
    EngineError
        If the disk is full or the folder does not take it.
    """
    schema = _settled(data.schema)
    with _writer(path, schema) as writer:
        writer.write_table(data.cast(schema).combine_chunks(), row_group_size=ROW_GROUP)


def write_whole(path: Path, content: bytes) -> Path:
    """Replace a file so that readers never see a part of it; its path.

    Raises
    ------
    EngineError
        If the disk is full or the folder does not take it.
    """
    with _atomic(path) as temporary, open(temporary, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    return path


@contextlib.contextmanager
def _writer(path: Path, schema: pa.Schema) -> Iterator[pq.ParquetWriter]:
    """A Parquet file that appears under its name when complete."""
    with _atomic(path) as temporary:
        # Only text repeats enough for a dictionary; numbers would be stored twice.
        text = [field.name for field in schema if pa.types.is_string(field.type)]
        with pq.ParquetWriter(
            temporary, schema, compression="zstd", use_dictionary=text, write_page_checksum=True
        ) as writer:
            yield writer
        with open(temporary, "rb") as file:
            os.fsync(file.fileno())


@contextlib.contextmanager
def _atomic(path: Path) -> Iterator[Path]:
    temporary = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        os.replace(temporary, path)
        _sync_folder(path.parent)
    except OSError as error:
        raise EngineError(Problem(str(path), f"cannot be written: {_words(error)}")) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


def _sync_folder(folder: Path) -> None:
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _words(error: OSError) -> str:
    if error.errno == errno.ENOSPC:
        return "the disk is full; what is already written is kept, free some space and run again"
    return os.strerror(error.errno).lower() if error.errno else str(error)


def read_arrow(path: Path) -> pa.Table:
    """A table with its metadata.

    Raises
    ------
    SpecError
        If there is none or it is damaged.
    """
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            return file.read()
    except FileNotFoundError:
        raise SpecError(Problem(str(path), "no such table")) from None
    except (pa.ArrowException, OSError) as error:
        raise SpecError(
            Problem(str(path), f"is not a readable Parquet table ({str(error).partition(chr(10))[0]})")
        ) from None


def readable(path: Path, key: bytes) -> bool:
    """Whether `path` is a whole part that was computed from what `key` stands for."""
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            same = (file.schema_arrow.metadata or {}).get(PART) == key
            if same:
                for _ in file.iter_batches(ROW_GROUP):
                    pass
            return same
    except (pa.ArrowException, OSError):
        return False


def ensure_writable(folder: Path) -> None:
    """Make `folder` and prove that files can be made in it, before any work is done.

    Raises
    ------
    SpecError
        If not.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (FileExistsError, NotADirectoryError):
        taken = next(path for path in (folder, *folder.parents) if path.exists())
        raise SpecError(Problem(str(folder), f"results cannot go there: {taken} is a file")) from None
    except OSError as error:
        raise SpecError(Problem(str(folder), f"results cannot go there: {_words(error)}")) from None


@dataclass(frozen=True)
class Parts:
    """The parts of one run: for every chunk of cases, one file for each kind of table."""

    folder: Path
    """Of the study's results."""
    spec_hash: str
    """Of the spec as resolved."""
    kinds: Sequence[str] = ("cases", "states")

    @property
    def home(self) -> Path:
        return self.folder / ".parts" / self.spec_hash[:12]

    def path(self, chunk: int, kind: str) -> Path:
        return self.home / f"{chunk:06d}.{kind}.parquet"

    def has(self, chunk: int, key: str) -> bool:
        """Whether a chunk with the content `key` (such as a hash of its cases) is stored whole."""
        return all(readable(self.path(chunk, kind), self._key(key)) for kind in self.kinds)

    def save(self, chunk: int, key: str, tables: Mapping[str, pa.Table]) -> None:
        """Store a chunk's tables; columns without any value get their type from other chunks later."""
        for kind in self.kinds:
            data = tables[kind]
            data = data.replace_schema_metadata({**(data.schema.metadata or {}), PART: self._key(key)})
            with _writer(self.path(chunk, kind), data.schema) as writer:
                writer.write_table(data.combine_chunks())

    def load(self, chunk: int, kind: str) -> pa.Table:
        """One table of a stored chunk."""
        data = read_arrow(self.path(chunk, kind))
        return data.replace_schema_metadata({k: v for k, v in data.schema.metadata.items() if k != PART})

    def assemble(self, chunks: Sequence[int]) -> dict[str, Path]:
        """Join stored chunks, in the given order, into the study's tables; the paths by kind."""
        return {kind: self.join(chunks, kind) for kind in self.kinds}

    def discard(self) -> None:
        """Remove the parts, and the folder of parts if no other run left any."""
        shutil.rmtree(self.home, ignore_errors=True)
        with contextlib.suppress(OSError):
            self.home.parent.rmdir()

    def join(self, chunks: Sequence[int], kind: str) -> Path:
        """Row groups are cut at fixed rows, so that the bytes depend on the rows alone."""
        path = self.folder / f"{kind}.parquet"
        schemas = [pq.read_schema(self.path(chunk, kind)) for chunk in chunks]
        metadata = {name: text for name, text in schemas[0].metadata.items() if name != PART}
        schema = _settled(pa.unify_schemas(schemas, promote_options="permissive")).with_metadata(metadata)
        with _writer(path, schema) as writer:
            rest = schema.empty_table()
            for chunk in chunks:
                rest = pa.concat_tables([rest, self.load(chunk, kind).cast(schema)])
                while len(rest) >= ROW_GROUP:
                    writer.write_table(rest.slice(0, ROW_GROUP).combine_chunks(), row_group_size=ROW_GROUP)
                    rest = rest.slice(ROW_GROUP)
            writer.write_table(rest.combine_chunks(), row_group_size=ROW_GROUP)
        return path

    def _key(self, key: str) -> bytes:
        return f"{self.spec_hash}:{key}".encode()
