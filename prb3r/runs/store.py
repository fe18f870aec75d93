"""Parquet tables on disk: fixed column types, unit and description with every column, written whole or not at all."""

import contextlib
import hashlib
import json
import os
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from prb3r.errors import Problem, SpecError
from prb3r.quantities import Quantity, describe
from prb3r.runs.files import replaced

ROW_GROUP = 65_536
"""Rows of a row group in final tables, however the rows were computed."""

COMPRESSION_LEVEL = -1
"""Of zstd: tables of states take 0.85 of the time of the usual level 1, and 1.01 of the bytes."""

ENCODINGS = {pa.float64(): "BYTE_STREAM_SPLIT", pa.int64(): "DELTA_BINARY_PACKED"}
"""Encodings of Parquet for numbers of tables: exponents of neighbouring floats are alike, and so are steps between
neighbouring integers.  A table of states takes 0.82 of the bytes of plain numbers, and 0.65 of the time to write."""

PROVENANCE = b"prb3r"
"""Key of the file metadata that holds the provenance as JSON."""


def arrow_table(
    columns: Mapping[str, Any], quantities: Iterable[Quantity] = (), provenance: Mapping[str, Any] | None = None
) -> pa.Table:
    """A table of float64, int64, bool and text columns, each field with its unit and description.

    Parameters
    ----------
    columns
        Arrays or sequences of one length.  None and nan become missing values.
    quantities
        Unit and meaning of columns that are not in the nomenclature, such as metrics.
    provenance
        Goes into the file's metadata; it must be equal for equal specs, or the bytes of the file would differ.
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
    """Values as an Arrow array of one of the four types of columns; nan becomes null."""
    array = values if isinstance(values, pa.ChunkedArray) else pa.array(values, from_pandas=True)
    if pa.types.is_dictionary(array.type) or pa.types.is_large_string(array.type):
        return array.cast(pa.string())
    if pa.types.is_floating(array.type):
        return array.cast(pa.float64())
    return array.cast(pa.int64()) if pa.types.is_integer(array.type) else array


def typed_schema(schema: pa.Schema) -> pa.Schema:
    """The schema with float64, or text where the unit is empty, for columns in which every value is missing."""
    for index, field in enumerate(schema):
        if pa.types.is_null(field.type):
            text = (field.metadata or {}).get(b"unit") == b""
            schema = schema.set(index, field.with_type(pa.string() if text else pa.float64()))
    return schema


def _metadata(quantity: Quantity) -> dict[str, str]:
    return {"unit": quantity.unit, "description": quantity.meaning}


def provenance_of(path: Path) -> dict[str, Any]:
    """The provenance of a table on disk, as given to :func:`arrow_table`; empty if it has none."""
    return json.loads((pq.read_schema(path).metadata or {}).get(PROVENANCE, b"{}"))


def canonical(content: Any) -> str:
    """JSON with sorted keys and the shortest exact form of floats, so that equal content gives equal text.

    Raises
    ------
    ValueError
        For nan and inf, which a spec cannot hold.
    """
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)


def content_hash(content: Any) -> str:
    """SHA-256 of the canonical JSON of plain content, in hexadecimal digits."""
    return hashlib.sha256(canonical(content).encode()).hexdigest()


def bytes_hash(values: np.ndarray) -> str:
    """SHA-256 of the bytes of an array, in hexadecimal digits."""
    return hashlib.sha256(values.tobytes()).hexdigest()


def write_arrow(data: pa.Table, path: Path) -> None:
    """Write a table to `path`, whole or not at all; raises what `replaced` raises."""
    schema = typed_schema(data.schema)
    with whole_table(path, schema) as writer:
        writer.write_table(data.cast(schema).combine_chunks(), row_group_size=ROW_GROUP)


def write_one_below_another(tables: Iterable[Mapping[str, Any]], path: Path) -> None:
    """Write tables of the same columns, at least one, below each other as one table, whole or not at all.

    Only one of them is in memory at a time.  Raises what `replaced` raises.
    """
    with contextlib.ExitStack() as opened:
        writer = None
        for columns in tables:
            part = arrow_table(columns)
            if writer is None:
                writer = opened.enter_context(whole_table(path, typed_schema(part.schema)))
            writer.write_table(part.cast(writer.schema), row_group_size=ROW_GROUP)


@contextlib.contextmanager
def whole_table(path: Path, schema: pa.Schema) -> Iterator[pq.ParquetWriter]:
    """A writer of a Parquet file that appears as `path` once the context is left without an error."""
    with replaced(path) as temporary:
        # only text repeats enough for a dictionary; numbers would be stored twice
        text = [field.name for field in schema if pa.types.is_string(field.type)]
        encodings = {field.name: ENCODINGS[field.type] for field in schema if field.type in ENCODINGS}
        with pq.ParquetWriter(
            temporary,
            schema,
            compression="zstd",
            compression_level=COMPRESSION_LEVEL,
            use_dictionary=text,
            column_encoding=encodings,
            write_page_checksum=True,
        ) as writer:
            yield writer
        with open(temporary, "rb") as file:
            os.fsync(file.fileno())


def count_rows(path: Path) -> int:
    """Number of rows of a table on disk."""
    return pq.read_metadata(path).num_rows


def read_first(path: Path, wanted: Collection[str], by: str, most: int) -> pa.Table:
    """The rows of a table on disk in which the column `by` is at most `most`, with those of its columns in `wanted`.

    No more than these rows and one row group are in memory.
    """
    groups = []
    with pq.ParquetFile(path, page_checksum_verification=True) as file:
        columns = [name for name in file.schema_arrow.names if name in wanted]
        place = file.schema_arrow.get_field_index(by)
        for number in range(file.num_row_groups):
            known = file.metadata.row_group(number).column(place).statistics
            if known is None or not known.has_min_max or known.min <= most:
                group = file.read_row_group(number, columns=list({**dict.fromkeys(columns), by: None}))
                groups.append(group.filter(pc.field(by) <= most).select(columns))
        return pa.concat_tables(groups) if groups else file.schema_arrow.empty_table().select(columns)


def read_some(path: Path, by: str, values: Collection[int]) -> pa.Table:
    """The rows of a table on disk in which the column `by` has one of some values."""
    return pq.read_table(path, filters=[(by, "in", list(values))], page_checksum_verification=True)


def read_arrow(path: Path) -> pa.Table:
    """A table on disk with its metadata.

    Raises
    ------
    SpecError
        If there is no such file or it is damaged.
    """
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            return file.read()
    except FileNotFoundError:
        raise SpecError(Problem(str(path), "no such table; `prb3r run` of its study writes it")) from None
    except (pa.ArrowException, OSError) as error:
        raise SpecError(
            Problem(str(path), f"is not a readable Parquet table ({str(error).partition(chr(10))[0]})")
        ) from None
