"""Tables say what they hold, appear whole or not at all, and do not remember how they were computed."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest

from prb3r.errors import EngineError, SpecError
from prb3r.quantities import Quantity
from prb3r.runs.files import ensure_writable
from prb3r.runs.part import KEY_TYPE, part_name
from prb3r.runs.parts import Parts, StateRows
from prb3r.runs.sealed import HEADER, is_sealed, read_sealed, write_sealed
from prb3r.runs.states import States
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


def test_every_field_has_unit_and_description_and_the_file_its_provenance(tmp_path):
    write_arrow(rows(0, 9)["cases"], tmp_path / "cases.parquet")
    data = read_arrow(tmp_path / "cases.parquet")
    assert data.schema.field("x_m").metadata[b"unit"] == b"m"
    assert data.schema.field("gain").metadata == {b"unit": b"1", b"description": b"what is gained"}
    assert provenance_of(tmp_path / "cases.parquet") == SPEC
    assert [str(kind) for kind in data.schema.types] == ["int64", "double", "double", "int64", "string"]
    assert data["x_m"].null_count == data["gain"].null_count == 3


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_pandas_polars_and_duckdb_read_the_same(tmp_path):
    duckdb, pandas, polars = (pytest.importorskip(name) for name in ("duckdb", "pandas", "polars"))
    path, written = tmp_path / "cases.parquet", rows(0, 20)["cases"].add_column(0, "a.b", pa.array(range(10, -10, -1)))
    write_arrow(written, path)
    expected = written.to_pydict()
    assert read_arrow(path).to_pydict() == polars.read_parquet(path).to_dict(as_series=False) == expected
    assert (
        pandas.read_parquet(path, dtype_backend="pyarrow").astype(object).replace(pandas.NA, None).to_dict("list")
        == expected
    )
    read = duckdb.sql(f"select * from '{tmp_path}/c*.parquet'")
    assert dict(zip(read.columns, map(list, zip(*read.fetchall(), strict=True)), strict=True)) == expected


def test_neighbouring_numbers_that_are_alike_take_little_room(tmp_path):
    count = 150_000
    angle = np.linspace(1, 2, count)
    write_arrow(
        pa.table({"case_id": np.arange(count) // 15, "disk": np.arange(count) % 15}), tmp_path / "whole.parquet"
    )
    write_arrow(pa.table({"angle_rad": angle}), tmp_path / "angles.parquet")
    assert (tmp_path / "whole.parquet").stat().st_size < count / 2
    assert (tmp_path / "angles.parquet").stat().st_size < 0.85 * angle.nbytes


TABLE = pa.table({"x_m": np.linspace(0, 1, 1000), "reason": ["", "no equilibrium"] * 500})


def test_what_is_read_back_is_what_was_written_or_nothing(tmp_path):
    path = tmp_path / "a.cases"
    write_sealed(path, "cases a", TABLE)
    good = path.read_bytes()
    assert read_sealed(path, "cases a").to_pydict() == TABLE.to_pydict()
    assert read_sealed(path, "states a") is None
    assert read_sealed(tmp_path / "b.cases", "cases b") is None
    rng = np.random.default_rng(3)
    flips = [*range(80), *rng.integers(0, len(good), 200), *range(len(good) - 100, len(good))]
    for place in flips:
        flipped = bytearray(good)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        assert read_sealed(path, "cases a") is None, place
        assert not is_sealed(path, "cases a"), place
    for cut in (0, 1, 63, 64, 65, len(good) // 2, len(good) - 1):
        path.write_bytes(good[:cut])
        assert read_sealed(path, "cases a") is None
        assert not is_sealed(path, "cases a")
    path.write_bytes(good + b"x")
    assert read_sealed(path, "cases a") is None
    path.write_bytes(good)
    assert is_sealed(path, "cases a")
    assert not is_sealed(path, "states a")


def test_a_table_with_the_digest_of_earlier_versions_counts_as_missing(tmp_path):
    path = tmp_path / "a.cases"
    write_sealed(path, "cases a", TABLE)
    content = path.read_bytes()[HEADER:]
    before = b"prb3r sealed 1\n\0" + hashlib.blake2b(content, digest_size=16).digest()
    path.write_bytes(before.ljust(HEADER, b"\0") + content)
    assert read_sealed(path, "cases a") is None
    assert not is_sealed(path, "cases a")


def cases(*numbers):
    keys = np.array([number.to_bytes(16, "big") for number in numbers], KEY_TYPE)
    values = np.array(numbers, float)
    count = np.array(numbers) % 3
    states = States("states", count, {"x_m": np.repeat(values, count) + np.arange(count.sum()) % 1})
    return keys, {"gain": values / 7, "reason": np.array([f"r{n}" for n in numbers], object)}, states


ITEMS = {"gain": "metric", "reason": "metric"}


def test_cases_are_known_by_their_keys_whatever_they_were_computed_along_with(tmp_path):
    kept = Parts(tmp_path)
    for numbers in ((5, 1, 4), (2, 3)):
        keys, columns, states = cases(*numbers)
        kept.add(keys, columns, ITEMS, states)
    again = Parts(tmp_path)
    keys, expected, _ = cases(1, 2, 3, 4, 5)
    assert not placed(again, "another", keys).known.any()
    assert placed(again, "metric", np.append(keys, cases(0)[0])).known.tolist() == [True] * 5 + [False]
    place = placed(again, "metric", keys)
    assert place.column("gain").tolist() == expected["gain"].tolist()
    assert place.column("reason").tolist() == expected["reason"].tolist()


def placed(parts, item, keys):
    (place,) = parts.places([item], keys)
    return place


@pytest.mark.parametrize("order", [(1, 2, 3, 4, 5), (4, 1, 2, 5), (5, 4, 3, 2, 1), (2,), (3, 1)])
def test_states_are_read_in_the_order_of_the_cases_that_are_asked_for(tmp_path, order):
    kept = Parts(tmp_path)
    for numbers in ((5, 1, 4), (2, 3)):
        keys, columns, states = cases(*numbers)
        kept.add(keys, columns, ITEMS, states)
    stored = StateRows(placed(Parts(tmp_path), "states", cases(*order)[0]))
    expected = [(case, float(number)) for case, number in enumerate(order) for _ in range(number % 3)]
    assert stored.total == len(expected)
    for start in range(stored.total):
        for stop in range(start + 1, stored.total + 1):
            case, columns = stored.between(start, stop)
            assert list(zip(case.tolist(), columns["x_m"].to_pylist(), strict=True)) == expected[start:stop]


def test_of_several_parts_that_hold_an_item_the_last_counts(tmp_path):
    kept = Parts(tmp_path)
    for numbers, item, shift in (((1, 2, 3), "metric", 0), ((4, 2), "metric", 10), ((2, 3), "another", 20)):
        keys, columns, _ = cases(*numbers)
        kept.add(keys, columns | {"gain": columns["gain"] + shift}, dict.fromkeys(columns, item), None)
    keys, columns, _ = cases(3, 2, 4, 1, 2)
    assert placed(kept, "metric", keys).column("gain").tolist() == (columns["gain"] + [0, 10, 10, 0, 10]).tolist()
    assert placed(kept, "metric", cases(3, 5)[0]).known.tolist() == [True, False]


def test_of_another_studys_parts_those_alone_are_copied_that_hold_what_a_case_lacks(tmp_path):
    other, mine = Parts(tmp_path / "other"), Parts(tmp_path / "mine")
    for numbers, item in (((1, 2), "metric"), ((3, 4), "metric"), ((3, 5), "another"), ((4, 6), "metric")):
        keys, columns, _ = cases(*numbers)
        other.add(keys, columns, dict.fromkeys(columns, item), None)
    keys, lacks = cases(1, 3, 5)[0], np.array([[False, True], [True, False], [True, False]])  # metric, another
    assert mine.adopt(["metric", "another"], keys, lacks)
    assert [part.path.name for part in mine.parts] == [other.parts[1].path.name]
    assert placed(mine, "metric", keys).known.tolist() == [False, True, False]
    assert not placed(mine, "another", keys).known.any()
    assert not Parts(tmp_path / "third").adopt(["metric", "another"], cases(7)[0], np.ones((1, 2), bool))


def test_states_may_be_written_in_blocks_of_which_one_that_is_damaged_or_missing_spoils_all(tmp_path):
    kept = Parts(tmp_path)
    keys, columns, _ = cases(1, 2)
    stem = part_name(keys, ["metric", "metric", "states"])
    kept.add_block(stem, 0, {"x_m": np.arange(4.0)})
    kept.add_block(stem, 1, {"x_m": np.arange(4.0, 9.0)})
    kept.add(keys, columns, ITEMS, States("states", np.array([2, 7]), None, (4, 5)))
    again = Parts(tmp_path)
    assert placed(again, "states", keys).known.all()
    _, states = StateRows(placed(again, "states", keys)).between(1, 8)
    assert states["x_m"].to_pylist() == [1, 2, 3, 4, 5, 6, 7]
    kept.add_block("of-a-run-that-was-killed", 3, {"x_m": np.zeros(3)})
    again.clear(lambda item: False)
    assert sorted(path.name for path in kept.home.iterdir()) == [f"{stem}-1.states", f"{stem}.cases", f"{stem}.states"]
    block = kept.home / f"{stem}-1.states"
    block.write_bytes((kept.home / f"{stem}.states").read_bytes())
    assert not placed(Parts(tmp_path), "states", keys).known.any()
    assert placed(Parts(tmp_path), "metric", keys).known.all()
    block.unlink()
    assert not placed(Parts(tmp_path), "states", keys).known.any()


def test_a_damaged_or_exchanged_part_is_no_part(tmp_path):
    kept = Parts(tmp_path)
    for numbers in ((1, 2), (3, 4)):
        keys, columns, states = cases(*numbers)
        kept.add(keys, columns, ITEMS, states)
    keys, _, _ = cases(1, 2, 3, 4)
    first, second = sorted(kept.home.glob("*.cases"))
    first.write_bytes(second.read_bytes())
    assert placed(Parts(tmp_path), "metric", keys).known.sum() == 2
    second.with_suffix(".states").write_bytes(second.read_bytes())
    assert placed(Parts(tmp_path), "metric", keys).known.sum() == 2
    assert not placed(Parts(tmp_path), "states", keys).known.any()
    kept.discard()
    assert list(tmp_path.iterdir()) == []


def test_what_no_program_asks_for_any_more_is_cleared_away(tmp_path):
    kept = Parts(tmp_path)
    for item, number in (("old", 1), ("new", 2)):
        keys, columns, _ = cases(number)
        kept.add(keys, columns, dict.fromkeys(columns, item), None)
    (kept.home / "x.cases.12.tmp").write_text("")
    kept.clear(lambda item: item == "old")
    assert len(list(kept.home.iterdir())) == 1
    assert placed(Parts(tmp_path), "new", cases(2)[0]).known.all()


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
