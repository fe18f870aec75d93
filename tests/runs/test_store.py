"""Tables say what they hold, appear whole or not at all, and do not remember how they were computed."""

import itertools
import os
import subprocess
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from prb3r.errors import EngineError, SpecError
from prb3r.quantities import Quantity
from prb3r.runs import parts, store
from prb3r.runs.files import ensure_writable
from prb3r.runs.parts import Parts
from prb3r.runs.store import arrow_table, content_hash, provenance_of, read_arrow, write_arrow

GAIN = Quantity("gain", "g", "1", "what is gained")
SPEC = {"name": "small", "seed": 1, "angles_rad": [0.1, 0.2]}


def rows(first, last):
    """Cases of which some failed: no metric, but a reason."""
    case = np.arange(first, last)
    failed = case % 3 == 0
    return {
        "cases": arrow_table(
            {
                "case_id": case,
                "x_m": np.where(failed, np.nan, np.sqrt(case)),
                "gain": [None if bad else number / 7 for bad, number in zip(failed, case, strict=True)],
                "iterations": [None if bad else int(number) for bad, number in zip(failed, case, strict=True)],
                "reason": ["no equilibrium" if bad else "" for bad in failed],
            },
            [GAIN],
            SPEC,
        ),
        "states": arrow_table({"case_id": np.repeat(case, 3), "angle_rad": np.repeat(case, 3) / 9}, (), SPEC),
    }


def assembled(folder, bounds, order=1, again=()):
    kept = Parts(folder, content_hash(SPEC))
    pairs = list(enumerate(itertools.pairwise(bounds)))
    for chunk, span in [*pairs[::order], *(pairs[index] for index in again)]:
        kept.save(chunk, content_hash(span), rows(*span))
    paths = kept.assemble(range(len(pairs)))
    return {kind: path.read_bytes() for kind, path in paths.items()}


def test_every_field_has_unit_and_description_and_the_file_its_provenance(tmp_path):
    write_arrow(rows(0, 9)["cases"], tmp_path / "cases.parquet")
    data = read_arrow(tmp_path / "cases.parquet")
    assert data.schema.field("x_m").metadata[b"unit"] == b"m"
    assert data.schema.field("gain").metadata == {b"unit": b"1", b"description": b"what is gained"}
    assert provenance_of(tmp_path / "cases.parquet") == SPEC
    assert [str(kind) for kind in data.schema.types] == ["int64", "double", "double", "int64", "string"]
    assert data["x_m"].null_count == data["gain"].null_count == 3


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_pandas_polars_and_duckdb_read_the_same_and_never_see_the_parts(tmp_path):
    duckdb, pandas, polars = (pytest.importorskip(name) for name in ("duckdb", "pandas", "polars"))
    assembled(tmp_path, [0, 10, 20])
    path = tmp_path / "cases.parquet"
    expected = read_arrow(path)["gain"].to_numpy()
    np.testing.assert_array_equal(pandas.read_parquet(path)["gain"].to_numpy(), expected)
    np.testing.assert_array_equal(polars.read_parquet(path)["gain"].to_numpy(), expected)
    count, total = duckdb.sql(f"select count(*), sum(gain) from '{tmp_path}/c*.parquet'").fetchall()[0]
    assert (count, total) == (20, pytest.approx(np.nansum(expected)))


def test_bytes_depend_on_rows_alone(tmp_path, monkeypatch):
    for module in (store, parts):
        monkeypatch.setattr(module, "ROW_GROUP", 16)
    straight = assembled(tmp_path / "a", [0, 10, 20, 50])
    backwards_and_repeated = assembled(tmp_path / "b", [0, 10, 20, 50], order=-1, again=[1])
    otherwise_cut = assembled(tmp_path / "c", [0, 1, 37, 50])
    assert straight == backwards_and_repeated == otherwise_cut
    assert pq.ParquetFile(tmp_path / "a" / "states.parquet").metadata.num_row_groups == 10
    for kind, whole in rows(0, 50).items():
        if kind == "cases":
            write_arrow(whole, tmp_path / "whole.parquet")
            assert (tmp_path / "whole.parquet").read_bytes() == straight[kind]


def test_a_part_is_reused_only_if_whole_and_of_the_same_cases(tmp_path):
    kept, key = Parts(tmp_path, content_hash(SPEC)), content_hash([0, 10])
    assert not kept.has(0, key)
    kept.save(0, key, rows(0, 10))
    assert kept.has(0, key)
    assert not kept.has(0, content_hash([0, 11]))
    assert not Parts(tmp_path, content_hash({})).has(0, key)
    assert kept.load(0, "cases").equals(rows(0, 10)["cases"], check_metadata=True)
    victim = kept.path(0, "states")
    good = victim.read_bytes()
    column = pq.read_metadata(victim).row_group(0).column(1)
    last = column.data_page_offset + column.total_compressed_size - 1
    for damaged in (b"", good[: len(good) // 2], good[:last] + bytes([good[last] ^ 1]) + good[last + 1 :]):
        victim.write_bytes(damaged)
        assert not kept.has(0, key)
    kept.discard()
    assert list(tmp_path.iterdir()) == []


def test_hash_follows_content_not_order_and_refuses_nan():
    assert content_hash({"a": 0.1, "b": [1]}) == content_hash({"b": [1], "a": 0.1})
    assert content_hash({"a": 0.1}) != content_hash({"a": 0.1 + 2**-56})
    with pytest.raises(ValueError, match="JSON compliant"):
        content_hash({"a": float("nan")})


def test_a_failed_write_says_so_and_leaves_what_was_there(tmp_path):
    write_arrow(rows(0, 9)["states"], tmp_path / "states.parquet")
    before = (tmp_path / "states.parquet").read_bytes()
    script = (
        "import resource, sys; from pathlib import Path; from prb3r.errors import EngineError\n"
        "from prb3r.runs.store import arrow_table, write_arrow\n"
        "import numpy as np; data = arrow_table({'x_m': np.random.default_rng(1).random(100_000)})\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "try: write_arrow(data, Path(sys.argv[1]))\n"
        "except EngineError as error: print(error)\n"
    )
    pytest.importorskip("resource", reason="needs file size limits")
    call = [sys.executable, "-c", script, str(tmp_path / "states.parquet")]
    said = subprocess.run(call, capture_output=True, text=True, timeout=30)
    assert said.stdout == f"{tmp_path}/states.parquet: cannot be written: file too large\n"
    assert [path.name for path in tmp_path.iterdir()] == ["states.parquet"]
    assert (tmp_path / "states.parquet").read_bytes() == before
    with pytest.raises(EngineError, match="cannot be written: not a directory"):
        write_arrow(pa.table({"x_m": [1.0]}), tmp_path / "states.parquet" / "x" / "y.parquet")


def test_places_that_cannot_hold_results_are_refused_before_work_starts(tmp_path):
    ensure_writable(tmp_path / "a" / "b")
    (tmp_path / "file").write_text("")
    with pytest.raises(SpecError, match=r"results cannot go there: .*/file is a file"):
        ensure_writable(tmp_path / "file" / "study")
    if os.geteuid():
        (tmp_path / "a").chmod(0o500)
        with pytest.raises(SpecError, match="permission denied"):
            ensure_writable(tmp_path / "a" / "c")
