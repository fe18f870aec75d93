"""CSV as people and spreadsheets write it: the same table, or a sentence that says where and what would be right."""

from pathlib import Path

import pandas as pd
import pytest

from prb3r.errors import SpecError
from prb3r.inverse.target import target_rows
from prb3r.model.files.comma_separated import csv_frame
from prb3r.model.manipulator import load_manipulator
from prb3r.model.steps import load_steps

PROTOTYPE = load_manipulator(Path(__file__).parents[2] / "studies/manipulators/two-segment.toml")


def steps_of(path, text):
    path.write_bytes(text.encode())
    return load_steps(PROTOTYPE, path)


@pytest.mark.parametrize(
    "text",
    [
        "sequence,step,cable_1_n,cable_2_n\na,1,10.5,0\na,2,20,1.5\n",
        "sequence,step,cable_1_n,cable_2_n\r\na,1,10.5,0\r\na,2,20,1.5\r\n",
        "\n \nsequence,step,cable_1_n,cable_2_n\n\na,1,10.5,0\n  \t\n\na,2,20,1.5\n\n",
        "sequence,step,cable_1_n,cable_2_n\n,,,\na,1,10.5,0\n , ,,\na,2,20,1.5\n,,,\n",
        "sequence , step , cable_1_n , cable_2_n \n a , 1 , 10.5 , 0 \na,2 , 20 , 1.5 \n",
        "sequence\t,step,cable_1_n\t,cable_2_n\na\t,\t1,\t10.5\t,0\na,2,20,1.5\n",
        "sequence,step,cable_1_n\xa0,cable_2_n\na\xa0,1,10.5\xa0,0\na,2,20,1.5\n",
        '"sequence","step","cable_1_n ","cable_2_n"\n"a ","1","10.5","0"\n"a","2","20 ","1.5"\n',
        "sequence,step,cable_1_n,cable_2_n,\na,1,10.5,0,\na,2,20,1.5,\n",
        "sequence,step,cable_1_n,cable_2_n\na,1,10.5,0,,\na,2,20,1.5,,\n",
        "sequence,step,cable_1_n,cable_2_n\na,1,10.5,0\na,2,20,1.5, ,\n",
        "sequence,step,cable_1_n,cable_2_n,,\na,1,10.5,0\na,2,20,1.5\n",
        "\ufeffsequence,step,cable_1_n,cable_2_n\na,1,10.5,0\na,2,20,1.5\n",
        '\ufeff\ufeff"sequence",step,cable_1_n,cable_2_n\na,1,10.5,0\na,2,20,1.5\n',
    ],
)
def test_blank_lines_spaces_and_commas_at_the_end_are_nothing(tmp_path, text):
    table = steps_of(tmp_path / "steps.csv", text)
    assert table.names.tolist() == ["a"]
    assert table.steps.tolist() == [1, 2]
    assert table.loads.tension[:, :2].tolist() == [[10.5, 0], [20, 1.5]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("sequence;step;cable_1_n\na;1;10,5\n", "separated by semicolons; write commas between cells, and points in"),
        ("sep=;\nsequence;step;cable_1_n\na;1;10,5\n", "separated by semicolons"),
        ("sequence;step;cable_1_n,cable_2_n\na;1;10,5\n", "separated by semicolons"),
        ("sequence\tstep\tcable_1_n\na\t1\t10\n", "separated by tabs"),
        ("sequence|step|cable_1_n\na|1|10\n", "separated by vertical bars"),
        ("sequence step cable_1_n\na 1 10\n", "separated by spaces"),
        (
            "sequence,step,cable_1_n\na,1,3\n\na,2,10,5\n",
            "header has names, first row 3: 4 instead of 3; the first line",
        ),
        (
            "sequence,step,cable_1_n,\na,1,10,5\n",
            "column 4 has no name in the header, but cells that hold something (5)",
        ),
        (
            'sequence,step,cable_1_n\na,1,3\na,2,"1.050,5"\n',
            "row 2 holds '1.050,5', not a number; write a decimal point",
        ),
        (
            "sequence,step,cable_1_n\na,1,1 000\n",
            "row 1 holds '1 000', not a number; write a decimal point, and nothing",
        ),
        ("sequence,step,tip_x_n\na,1,\u22125\n", "row 1 holds '\u22125', not a number; write a hyphen for minus"),
        ("sequence,step,cable_1_n\na,1,10 N\n", "holds '10 N', not a number; write the number alone, in the unit that"),
        ("sequence,step,cable_1_n\na,1,ten\n", "row 1 holds 'ten', not a number"),
        ("sequence,step,cable_1_n\na,1,True\n", "row 1 holds True, not a number"),
        ('sequence,step,cable_1_n\na,1,3\n\n"a,2,3\n', "a quotation mark opens in row 3 and is never closed"),
        ("sequence,step,cable_1_n,cable_1_n \na,1,3,4\n", "column 'cable_1_n' stands there twice"),
        ("\n\nsequence,step,cable_1_n\n\na,1,3\n\n\na,2,x\n", "cable_1_n: row 5 holds 'x'"),
    ],
)
def test_what_may_mean_two_things_is_refused_with_its_row_and_what_is_right(tmp_path, text, said):
    with pytest.raises(SpecError) as caught:
        steps_of(tmp_path / "steps.csv", text)
    assert said in str(caught.value)


def test_rows_are_counted_with_the_blank_ones_in_targets_too(tmp_path):
    (tmp_path / "path.csv").write_text("x_m, y_m \n\n0.4,0.1\n,\n0.4,far\n")
    with pytest.raises(SpecError, match="column y_m: row 4 holds 'far'"):
        target_rows(tmp_path / "path.csv")
    (tmp_path / "path.csv").write_text("x_m, y_m \n\n0.4,0.1\n,\n0.4,0.2\n")
    assert target_rows(tmp_path / "path.csv") == [{"x_m": 0.4, "y_m": 0.1}, {"x_m": 0.4, "y_m": 0.2}]


def test_cells_keep_what_is_inside_them():
    frame = csv_frame('sequence,step,note\n"pull, then\nlet go",1,\'=1+1\nNA,2, n/a \n', "t")
    expected = pd.DataFrame({"sequence": ["pull, then\nlet go", "NA"], "step": [1, 2], "note": ["=1+1", None]})
    pd.testing.assert_frame_equal(frame, expected, check_dtype=False)
