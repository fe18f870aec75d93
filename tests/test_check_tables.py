"""`prb3r check` of single tables: each is told as what it is, or refused with what is missing."""

import pandas as pd
import pytest
from command import PROTOTYPE, ROOT, prb3r

from prb3r.check import check_file
from prb3r.errors import SpecError
from prb3r.model.manipulator import load_manipulator
from prb3r.model.solve import solve

EXAMPLE = ROOT / "studies/recordings/bench-example"
MANIPULATOR = load_manipulator(PROTOTYPE)


def check(path, text, manipulator=None):
    path.write_text(text)
    return check_file(path, manipulator)


@pytest.mark.parametrize("manipulator", [None, MANIPULATOR])
def test_every_table_of_the_command_line_is_told_as_what_it_is(tmp_path, manipulator):
    assert check_file(EXAMPLE / "steps.csv", manipulator).startswith("table of 42 steps in 6 sequences")
    readings = check_file(EXAMPLE / "markers.csv", manipulator)
    assert readings.startswith("table of readings (x_m, y_m, angle_rad) of disks 1-14 in 6 sequences")
    shapes = solve(MANIPULATOR, EXAMPLE / "steps.csv")[
        ["sequence", "step", "disk", "x_m", "y_m", "angle_rad", "outcome"]
    ]
    shapes.to_parquet(tmp_path / "shapes.parquet")
    assert "of disks 0-14 in 6 sequences, as `prb3r solve` writes" in check_file(
        tmp_path / "shapes.parquet", manipulator
    )
    path = check(tmp_path / "path.csv", "step,x_m,y_m\n1,0.4,0.1\n\n2,0.4,0.2\n", manipulator)
    assert path.startswith("2 targets for `prb3r reach --path`")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "time,force\n1,2\n",
            "holds the columns time, force; load steps have sequence, step and columns such as cable_",
        ),
        (
            "case_id,step\n1,2\n",
            "readings sequence, step, disk and some of x_m, y_m, angle_rad, bend_rad, targets some",
        ),
        ("step,cable_1_n\n1,2\n", "column 'sequence' is missing"),
        ("sequence,cable_1_n\na,2\n", "column 'step' is missing"),
        ("sequence,step,cabel_1_n\na,1,2\n", "column cabel_1_n: unknown column; did you mean 'cable_<name>_n'?"),
        ("sequence,step,cable_1_n\na,1,x\n", "column cable_1_n: row 1 holds 'x', not a number"),
        ("sequence,step,cable_1_n\n", "holds no steps"),
        ("sequence,step,x_m\na,1,0.1\n", "column 'disk' is missing"),
        ("disk,angle_rad\n1,0.1\n", "column 'sequence' is missing"),
        ("sequence,step,disk,angle_rad\na,1,1,12\n", "column angle_rad: row 1 is 12; degrees? write radians"),
        ("sequence,step,disk,angle_rad\na,1,1.5,0\n", "there is no disk 1.5 (row 1); disks are counted 0 (base), 1, 2"),
        (
            "sequence,step,disk\na,1,1\n",
            "records nothing: give at least one of the columns x_m, y_m, angle_rad, bend_rad",
        ),
        ("x_m,z_m\n1,2\n", "unknown column 'z_m'"),
    ],
)
def test_what_a_table_lacks_is_said_without_a_manipulator(tmp_path, text, said):
    with pytest.raises(SpecError) as caught:
        check(tmp_path / "t.csv", text)
    assert said in str(caught.value)
    assert str(tmp_path / "t.csv") in str(caught.value)


def test_steps_that_load_nothing_are_remarked(tmp_path):
    for manipulator in (None, MANIPULATOR):
        told = check(tmp_path / "t.csv", "sequence,step\na,1\n", manipulator)
        assert told.endswith("\n  no column of loads, such as cable_<name>_n: nothing pulls")


def test_readings_and_steps_are_checked_with_the_manipulator_beside_them(tmp_path):
    markers, steps = tmp_path / "markers.csv", tmp_path / "steps.csv"
    pd.DataFrame({"sequence": ["a"], "step": [1], "disk": [15], "x_m": [0.4]}).to_csv(markers, index=False)
    steps.write_text("sequence,step,cable_5_n\na,1,1\n")
    assert prb3r("check", markers, steps).returncode == 0
    done = prb3r("check", PROTOTYPE, markers, steps)
    assert done.returncode == 2
    assert "there is no disk 15 (row 1); disks are 0 (base) to 14" in done.stderr
    assert "there is no cable 5" in done.stderr
