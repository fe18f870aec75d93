"""What commands refuse before they compute anything: files that they would overwrite, targets in other units, and
options that mean nothing."""

import pandas as pd
import pytest
from command import PROTOTYPE, ROOT, prb3r

from prb3r import SpecError, load_recording
from prb3r.diagnosis.run import diagnosis_of
from prb3r.study.plan import plan_study

EXAMPLE = ROOT / "studies/recordings/bench-example"
STEPS = "sequence,step,cable_1_n\na,1,10\n"


def refusal(*arguments, cwd=ROOT):
    done = prb3r(*arguments, cwd=cwd)
    assert done.returncode == 2
    assert done.stdout == ""
    return done.stderr


def test_no_command_writes_over_what_it_reads(tmp_path):
    steps, targets, design = tmp_path / "steps.csv", tmp_path / "targets.csv", tmp_path / "m.toml"
    steps.write_text(STEPS)
    targets.write_text("x_m,y_m\n0.4,0.1\n")
    design.write_text(PROTOTYPE.read_text())
    (tmp_path / "link.csv").symlink_to(steps)
    kept = {path: path.read_bytes() for path in (steps, targets, design)}
    for command in (
        ("solve", PROTOTYPE, steps, "-o", steps),
        ("solve", PROTOTYPE, steps, "-o", tmp_path / "link.csv"),
        ("reach", PROTOTYPE, "--path", targets, "-o", targets),
        ("predict", tmp_path, design, "-o", design),
        ("predict", tmp_path, design, steps, "-o", steps),
    ):
        assert "is read by this command; write to another file" in refusal(*command)
    assert {path: path.read_bytes() for path in kept} == kept


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ([], "say where to: --x and --y, --angle, or all of them, or --path TABLE"),
        (["--x", "nan", "--y", "0.1"], "x_m = nan is not allowed; give a finite number"),
    ],
)
def test_targets_that_nobody_means_are_refused(tmp_path, asked, said):
    assert said in refusal("reach", PROTOTYPE, *asked, cwd=tmp_path)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--x", "30", "--y", "5"], "target: x_m = 30 m is far beyond the manipulator, which is 0.476 m long; lengths"),
        pytest.param(
            ["--angle", "30"],
            "target: angle_rad = 30 rad is 4.8 turns; angles are given in radians: 30 degrees is 0.5236",
            marks=pytest.mark.long,
        ),
        pytest.param(
            ["--path", "mm.csv"],
            "mm.csv: y_m = -120 m is far beyond the manipulator, which is 0.476 m long; lengths",
            marks=pytest.mark.long,
        ),
        (
            ["--path", "deg.csv", "--disk", "7"],
            "deg.csv: angle_rad = -20 rad is 3.2 turns; angles are given in radians",
        ),
    ],
)
def test_targets_in_another_unit_get_the_nearest_point_and_are_said_before_the_search(tmp_path, asked, said):
    (tmp_path / "mm.csv").write_text("x_m,y_m\n0.4,0.1\n410,-120\n")
    (tmp_path / "deg.csv").write_text("angle_rad\n0.2\n-20\n")
    done = prb3r("reach", PROTOTYPE, *asked, cwd=tmp_path)
    assert done.returncode == 1
    before, _, _ = done.stderr.partition("is not reached; nearest is")
    assert said in before
    assert "is not reached; nearest is" in done.stderr
    assert done.stdout.startswith("sequence,step,cable_1_n")


def test_far_targets_of_a_study_are_refused_and_every_problem_is_said_once(tmp_path):
    limp = tmp_path / "limp.toml"
    sizes = "width_m = 0.030\nthickness_m = 0.0008"
    assert PROTOTYPE.read_text().count(sizes) == 2
    limp.write_text(PROTOTYPE.read_text().replace(sizes, "bending_stiffness_n_m2 = 0.24"))
    study = tmp_path / "reach.toml"
    asked = '[reach]\nleast = "stress"\ntarget = [{ x_m = 450.0 }]\n'
    study.write_text(f'name = "reach"\ntitle = "t"\nmanipulator = "{limp}"\n{asked}')
    with pytest.raises(SpecError) as caught:
        plan_study(study)
    told = str(caught.value)
    assert told.count("x_m = 450 m is far beyond the manipulator") == 1
    assert told.count("least = 'stress' needs thickness_m or outer_fibre_m of a segment") == 1


@pytest.mark.parametrize("scheduler", [[], ["--scheduler", "banana"]])
def test_dask_without_an_address_is_refused_before_anything_is_planned(scheduler):
    said = refusal("run", ROOT / "studies/tilt.toml", "--backend", "dask", *scheduler)
    assert said == "prb3r: --scheduler: --backend dask needs the address of one, such as tcp://host:8786\n"


def test_classes_of_recordings_are_listed_where_none_is_close(tmp_path):
    assert "the classes are clean, single, pair" in refusal("prove", "--class", "banana", "-o", tmp_path / "proof")


def test_a_recording_is_not_held_out_from_itself():
    recording = load_recording(EXAMPLE)
    with pytest.raises(SpecError, match="bench example has the readings that are diagnosed, which confirm nothing"):
        diagnosis_of(recording, holdout=[EXAMPLE])


def test_names_that_files_cannot_have_are_refused_in_words(tmp_path):
    study = tmp_path / "s.toml"
    study.write_text(f'name = "Tilt 1"\ntitle = "t"\nmanipulator = "{PROTOTYPE}"\n[[step]]\ncable_1_n = 1\n')
    assert 'name: must be lower-case letters, digits and hyphens, no hyphen first, not "Tilt 1"' in refusal(
        "check", study
    )


def test_a_manipulator_named_twice_is_one(tmp_path):
    steps = tmp_path / "steps.csv"
    pd.DataFrame({"sequence": ["a"], "step": [1], "cable_9_n": [1.0]}).to_csv(steps, index=False)
    assert "there is no cable 9" in prb3r("check", PROTOTYPE, PROTOTYPE, steps).stderr


def test_what_a_run_answers_follows_what_failed(tmp_path):
    study = tmp_path / "s.toml"
    study.write_text(
        f'name = "s"\ntitle = "t"\nmanipulator = "{PROTOTYPE}"\n[[step]]\ncable_1_n = 1\n'
        '[[factor]]\nname = "cable_1_n"\npath = "step.1.cable_1_n"\nvalues = [1.0, 1e6]\n'
        '[[factor]]\nname = "ratio"\nratio = ["segment.1.thickness_m", "segment.2.thickness_m"]\nvalues = [1.0, 1.2]\n'
        '[[metric]]\nkind = "position"\n[[requirement]]\nmetric = "tip_y_m"\nat_least = 0.0\n'
    )
    done = prb3r("run", study, "-o", tmp_path / "out", "-j", 1)
    assert done.returncode == 1
    first, answer = done.stdout.splitlines()
    assert "; 2 without a stable equilibrium, first case 2: No equilibrium was found" in first
    assert answer.startswith("  No design keeps every requirement")
    assert "without a stable equilibrium" not in answer
    study.write_text(study.read_text().replace("1e6", '"a"'))
    assert "column cable_1_n: row 1 holds 'a', not a number" in prb3r("check", study).stderr
