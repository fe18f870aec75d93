"""Whatever is given as a file: a sentence about it, never an internal error, and no reading without end."""

import os
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import prb3r
from prb3r.check import check_file
from prb3r.errors import SpecError
from prb3r.model.files.table import read_table
from prb3r.model.manipulator import load_manipulator

ROOT = Path(__file__).parents[2]
FILE = ROOT / "studies/manipulators/two-segment.toml"
TEXT = FILE.read_text()
WRIST = load_manipulator(FILE)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = " + "[" * 1000 + "]" * 1000, "nested more than 20 deep"),
        ("x = " + "[" * 100 + "]" * 100, "nested more than 20 deep"),
        (".".join("a" * 3000) + " = 1", "nested more than 20 deep"),
        (f"\n\ngravity_m_s2 = {'9' * 5000}", "m.toml:3: not valid TOML: a number has too many digits"),
        (f"gravity_m_s2 = {'9' * 400}", "9... is not allowed; write a finite number"),
        (f"[[segment]]\nplates = {'9' * 400}", "9... is not allowed; write a finite number"),
    ],
)
def test_a_manipulator_of_any_text_is_refused_in_a_sentence(tmp_path, text, said):
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(SpecError) as caught:
        load_manipulator(tmp_path / "m.toml")
    assert said in str(caught.value)
    with pytest.raises(SpecError):
        check_file(tmp_path / "m.toml")


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("/dev/zero", "no regular file"),
        ("a\0b.toml", "NUL"),
        ("fifo.toml", "no regular file"),
        ("fifo.csv", "no regular"),
    ],
)
def test_what_is_no_file_is_not_read(tmp_path, place, said):
    for name in ("fifo.toml", "fifo.csv"):
        os.mkfifo(tmp_path / name)
    read = read_table if place.endswith(".csv") else load_manipulator
    with pytest.raises(SpecError, match=said):
        read(tmp_path / place)


def test_a_file_that_is_too_large_is_refused_unread(tmp_path):
    with open(tmp_path / "m.toml", "wb") as file:
        file.truncate(2**40)
    with pytest.raises(SpecError, match="1,099,511,627,776 bytes, more than 16,777,216"):
        load_manipulator(tmp_path / "m.toml")


def test_a_byte_order_mark_is_nothing(tmp_path):
    (tmp_path / "m.toml").write_bytes(b"\xef\xbb\xbf" + TEXT.encode())
    assert load_manipulator(tmp_path / "m.toml") == WRIST
    assert "two" in load_manipulator(tmp_path / "m.toml").name
    assert check_file(tmp_path / "m.toml").startswith("manipulator")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"sequence,step,cable_1_n\na,1,{'9' * 400}\n", "cable_1_n: row 1 "),  # is infinite; to pandas 2.2 no number
        (f"sequence,step,cable_1_n\na,{'9' * 400},1\n", "step: row 1 "),
        (f"sequence,step,cable_1_n\na,1,{'9' * 5000}\n", "99..., not a number"),
        ("sequence,step,cable_1_n\na,1,1e308\n", "cable_1_n: row 1 is too large"),
        ("sequence,step,cable_1_kg\na,1,1e308\n", "cable_1_kg: row 1 is too large"),
        ("sequence,step,tip_x_n\na,1,-1e308\n", "tip_x_n: row 1 is too large"),
        (b"\xef\xbb\xbf", "is empty"),
        (
            b"sequence,step,cable_1_n\n\xe9,1,3\n",
            "is not UTF-8 text: line 2 is of another encoding; save it as CSV UTF-8",
        ),
        ("sequence,step,cable_1_n\na,1,3\n".encode("utf-16"), "is not UTF-8 text: it is UTF-16, which spreadsheets"),
        ("# pulled on Monday\nsequence,step,cable_1_n\na,1,3\n", "the first line, '# pulled on Monday', has to hold"),
        (
            ",sequence,step,cable_1_n\n7,a,1,3\n",
            "column 1 has no name in the header, but cells that hold something (7)",
        ),
    ],
)
def test_cells_that_cannot_be_computed_with_are_told(tmp_path, text, said):
    (tmp_path / "t.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(SpecError) as caught:
        prb3r.solve(WRIST, tmp_path / "t.csv")
    assert said in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize("pull", [[[1.0, 2.0]], [{"a": 1}], [b"3"], pd.to_datetime(["2020-01-01"]), [3j]])
def test_columns_of_other_things_than_numbers_are_told(pull):
    with pytest.raises(SpecError, match="cable_1_n: row 1 holds"):
        prb3r.solve(WRIST, pd.DataFrame({"sequence": ["a"], "step": [1], "cable_1_n": pull}))


@pytest.mark.parametrize(
    "metadata",
    [
        b"{",
        b"[]",
        b'{"index_columns": 5, "columns": [], "column_indexes": []}',
        b'{"index_columns": ["x"], "columns": [{"name": "x"}], "column_indexes": [{"a": 1}]}',
    ],
)
def test_damaged_metadata_of_pandas_is_told(tmp_path, metadata):
    table = pa.table({"sequence": ["a"], "step": [1], "cable_1_n": [3.0]}).replace_schema_metadata(
        {b"pandas": metadata}
    )
    pq.write_table(table, tmp_path / "t.parquet")
    with pytest.raises(SpecError, match="is not a readable table"):
        prb3r.solve(WRIST, tmp_path / "t.parquet")


def test_a_model_that_does_not_go_with_the_manipulator_is_told():
    history = WRIST.model_dump(exclude_none=True) | {"friction": {"coefficient": 0.3, "direction": "history"}}
    with pytest.raises(SpecError, match="'history' needs the model"):
        prb3r.solve(
            prb3r.Manipulator.model_validate(history),
            {"sequence": ["a"], "step": [1], "cable_1_n": [3.0]},
            model="constant-curvature",
        )
