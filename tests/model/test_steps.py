"""Tables of load steps: what a user reads of a bad one, and that no cell is lost on the way in."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from prb3r.errors import SpecError
from prb3r.model.files.cells import ranges
from prb3r.model.files.table import read_table
from prb3r.model.manipulator import load_manipulator
from prb3r.model.steps import loads_of, sequences_of

PROTOTYPE = load_manipulator(Path(__file__).parents[2] / "studies/manipulators/two-segment.toml")


def refusal(path, text):
    path.write_text(text)
    with pytest.raises(SpecError) as caught:
        sequences_of(PROTOTYPE, path)
    return str(caught.value).replace(f"{path}", "steps")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "sequence,step,cable_1_n\na,1,ten\na,2,1\na,3,x\n",
            "row 1 holds 'ten', not a number (and 1 more row like it)",
        ),
        ('sequence,step,cable_1_n\na,1,"1,5"\n', "row 1 holds '1,5', not a number; write a decimal point"),
        ("sequence,step,cable_1_n\na,1,inf\n", "column cable_1_n: row 1 is infinite"),
        ("sequence,step,cable_1_n\na,1,\n", "row 1: empty; write 0 for no load"),
        ("sequence,step,cable_1_n\na,1,30\na,2,-2\n", "row 2 is -2: a cable cannot push"),
        ("sequence,step,cable_1_n\n,1,30\n", "column sequence: row 1: empty; every row needs its sequence"),
        ("sequence,step,cable_1_n\n \u2003,1,30\n", "column sequence: row 1: empty; every row needs its sequence"),
        ("sequence,step,cable_1_n\na,first,30\n", "column step: row 1 holds 'first', not a number"),
        ("sequence,step,cable_1_n,slip_1\na,1,3,0.5\n", "row 1: must be -1"),
        ("sequence,step,cable_1_n,cable_1_kg\na,1,3,3\n", "cable_1_n and cable_1_kg exclude each other"),
        ("sequence,step,disk15_x_n\na,1,3\n", "there is no disk 15, disks that can carry loads are 1 to 14"),
        (
            "sequence,step,cable_1_n\na,1,3\na,1,4\n",
            "sequence a: step 1 stands in rows 1-2, with different loads; a sequence that is",
        ),
        ("sequence;step;cable_1_n\na;1;0,5\n", "columns are separated by semicolons; write commas"),
        ("sequence,step,cable_1_n\na,1,3,4\na,2,3,4\n", "rows have more cells than the header has names"),
    ],
)
def test_what_is_wrong_is_said_with_its_row(tmp_path, text, said):
    assert said in refusal(tmp_path / "steps.csv", text)


def test_a_sensor_at_rest_may_read_slightly_negative_on_an_idle_cable_too():
    steps = pd.DataFrame({"sequence": "a", "step": [1, 2], "cable_1_n": [0.0, 30.0], "cable_2_n": [-0.01, 0.02]})
    (sequence,) = sequences_of(PROTOTYPE, steps)
    assert sequence.loads.tension[:, 1].tolist() == [0, 0.02]


def test_steps_sort_by_number_and_rows_of_any_index_are_taken():
    steps = pd.DataFrame({"sequence": [7.0] * 3, "step": [10, 2, 1], "cable_1_n": [3.0, 2.0, 1.0]}, index=list("xyz"))
    (sequence,) = sequences_of(PROTOTYPE, steps)
    assert sequence.name == "7"
    assert sequence.loads.tension[:, 0].tolist() == [1, 2, 3]


def test_trailing_commas_and_an_index_in_parquet_shift_nothing(tmp_path):
    (tmp_path / "a.csv").write_text("sequence,step,cable_1_n\na,1,3\nb,2,4\n")
    (tmp_path / "b.csv").write_text("sequence,step,cable_1_n,\na,1,3,\nb,2,4,\n")
    frame = pd.DataFrame({"sequence": list("ab"), "step": [1, 2], "cable_1_n": [3.0, 4.0]})
    frame.set_index("sequence").to_parquet(tmp_path / "a.parquet")
    for name in ("a.csv", "b.csv", "a.parquet"):
        pd.testing.assert_frame_equal(read_table(tmp_path / name), frame, check_dtype=False)


def test_a_sequence_may_have_any_name(tmp_path):
    (tmp_path / "a.csv").write_text("sequence,step,x_m\nNA,1,NA\n007,2,0\n")
    frame = read_table(tmp_path / "a.csv")
    assert frame["sequence"].tolist() == ["NA", "007"]
    assert frame["x_m"].isna().tolist() == [True, False]


def test_cells_of_any_type_become_numbers():
    from decimal import Decimal

    frame = pd.DataFrame({"cable_1_n": pd.Series([Decimal("0.5"), np.int64(2), "3 "], dtype=object)})
    assert loads_of(PROTOTYPE, PROTOTYPE.chain(), frame).tension[:, 0].tolist() == [0.5, 2, 3]


def test_ranges_are_short():
    assert ranges([3, 1, 2, 7]) == "1-3, 7"
    assert ranges(range(1, 40, 2)) == "1, 3, 5, 7, 9, 11 and 14 more"
