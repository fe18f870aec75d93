"""Options and tables that make no sense together are refused with code 2, before anything is computed."""

from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

import prb3r
from prb3r.cli import main
from prb3r.recording.plausibility import implausible
from prb3r.recording.reading import load_recording

STUDIES = Path(__file__).parents[1] / "studies"
MANIPULATOR = str(STUDIES / "manipulators" / "two-segment.toml")
EXAMPLE = STUDIES / "recordings" / "bench-example"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["diagnose", str(EXAMPLE), "--seed", "-1"], "-1 is not in the range"),
        (["predict", str(EXAMPLE), MANIPULATOR, "--seed", "-1"], "-1 is not in the range"),
        (["run", str(STUDIES / "tilt.toml"), "--backend", "dusk"], "'dusk' is not one of"),
        (["run", str(STUDIES / "tilt.toml"), "--scheduler", "tcp://10.0.0.1:1"], "goes with --backend dask"),
        (["solve", MANIPULATOR, str(EXAMPLE / "steps.csv"), "--image-centre", "0", "0"], "goes with --as-measured"),
        (["reach", MANIPULATOR, "--disk", "²", "--x", "0.4", "--y", "0.1"], "no disk"),
        (["reach", MANIPULATOR, "--x", "0.4", "--y", "0.1", "-o", "pull.txt"], "a .csv or a .parquet file"),
    ],
)
def test_what_does_not_go_together_is_refused(arguments, said):
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2, result.output
    assert said in result.output


def test_a_column_that_stands_twice_and_one_that_is_not_known_are_told():
    steps = pd.DataFrame([["a", 1, 10.0, 20.0]], columns=["sequence", "step", "cable_1_n", "cable_1_n"])
    with pytest.raises(prb3r.SpecError, match="cable_1_n: stands there twice"):
        prb3r.solve(MANIPULATOR, steps)
    with pytest.raises(prb3r.SpecError, match="no column 'stress'; did you mean 'stress_pa'"):
        prb3r.solve(MANIPULATOR, {"sequence": ["a"], "step": [1], "cable_1_n": [10.0]}, also=["stress"])


def test_where_friction_follows_the_travel_nothing_is_said_of_declared_slip(tmp_path):
    for file in EXAMPLE.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    with (tmp_path / "manipulator.toml").open("a") as file:
        file.write('\n[[effect]]\nkind = "slip_history"\npresliding_m = 1e-4\n')
    steps = pd.read_csv(tmp_path / "steps.csv")
    slips = [name for name in steps if name.startswith("slip_")]
    steps.assign(**{name: -steps[name] for name in slips}).to_csv(tmp_path / "steps.csv", index=False)
    assert not [line for line in implausible(load_recording(tmp_path)) if "slip" in line]
