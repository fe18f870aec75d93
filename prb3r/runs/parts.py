"""Parts that make a run resumable: the tables of every chunk of its cases, kept under what they were computed from.

Parts live in `results/<study>/.parts/<hash>/`, one level below every `*.parquet` glob over a study's results.
"""

import contextlib
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from prb3r.runs.store import ROW_GROUP, read_arrow, typed_schema, whole_table

PART = b"prb3r part"
"""Key of the file metadata that says what a part was computed from."""


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
        """The folder of these parts."""
        return self.folder / ".parts" / self.spec_hash[:12]

    def path(self, chunk: int, kind: str) -> Path:
        """The file of a kind of table of a chunk."""
        return self.home / f"{chunk:06d}.{kind}.parquet"

    def has(self, chunk: int, key: str) -> bool:
        """Whether a chunk with the content `key` (such as a hash of its cases) is stored whole."""
        return all(readable(self.path(chunk, kind), self._key(key)) for kind in self.kinds)

    def save(self, chunk: int, key: str, tables: Mapping[str, pa.Table]) -> None:
        """Store a chunk's tables; columns without any value get their type from other chunks later."""
        for kind in self.kinds:
            data = tables[kind]
            data = data.replace_schema_metadata({**(data.schema.metadata or {}), PART: self._key(key)})
            with whole_table(self.path(chunk, kind), data.schema) as writer:
                writer.write_table(data.combine_chunks())

    def load(self, chunk: int, kind: str) -> pa.Table:
        """A table of a stored chunk, without the key it was stored under.

        Raises
        ------
        SpecError
            If it is not there or is damaged.
        """
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
        schema = typed_schema(pa.unify_schemas(schemas, promote_options="permissive")).with_metadata(metadata)
        with whole_table(path, schema) as writer:
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
