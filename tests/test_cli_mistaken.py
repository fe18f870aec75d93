"""What a new user gets wrong: a file in the place of another, capitals, spaces in names; and counts."""

import re
import shutil

import pandas as pd
import pytest
from command import PROTOTYPE, ROOT, prb3r

from prb3r import solve
from prb3r.model.files.kinds import FILE_KINDS, WISHES, kind_of_keys
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import RecordingFile
from prb3r.study.spec import Study
from prb3r.study.wishes import Wishes

EXAMPLE = ROOT / "studies/recordings/bench-example"
STUDY = f'name = "s"\ntitle = "t"\nmanipulator = "{PROTOTYPE}"\n[[step]]\ncable_1_n = 1\n'
METRIC = '[[metric]]\nkind = "position"\ndisk = "tip"\n'
STEPS = "sequence,step,cable_1_n\na,1,10\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY + METRIC)
    (tmp_path / "manipulator.toml").write_text(PROTOTYPE.read_text())
    (tmp_path / "steps.csv").write_text(STEPS)
    (tmp_path / "wishes.toml").write_text('[[requirement]]\nmetric = "safety_factor"\nat_least = 1.5\n')
    (tmp_path / "empty").mkdir()
    shutil.copytree(EXAMPLE, tmp_path / "recording")
    return tmp_path


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("solve study.toml steps.csv", "study.toml: is a study, not a manipulator; the manipulator that it names is '"),
        ("reach wishes.toml --x 0.4", "wishes.toml: is a file of requirements, not a manipulator"),
        ("solve recording/recording.toml steps.csv", "recording.toml: is a recording, not a manipulator; the manipul"),
        ("solve steps.csv manipulator.toml", "steps.csv: is a table; a manipulator is a .toml file"),
        ("run manipulator.toml", "manipulator.toml: is a manipulator, not a study"),
        ("run recording/recording.toml", "recording.toml: is a recording, not a study"),
        ("run steps.csv", "steps.csv: is a table; a study is a .toml file"),
        ("diagnose manipulator.toml", "manipulator.toml: is a manipulator, not a recording"),
        ("diagnose study.toml", "study.toml: is a study, not a recording"),
        ("diagnose recording --assume study.toml", "study.toml: is a study, not a manipulator"),
        ("diagnose empty", "empty: holds no recording: that is a folder with recording.toml, and steps and markers"),
        ("check empty", "empty: holds no recording: that is a folder with recording.toml, and steps and markers"),
        (
            "predict manipulator.toml manipulator.toml",
            "give the folder that prb3r diagnose wrote, or its diagnosis.json",
        ),
        ("report study.toml", "study.toml: is a file; give a folder of results"),
        ("solve manipulator.toml empty", "empty: is a folder, not a table; a table is a .csv or a .parquet file"),
        ("solve manipulator.toml steps.csv -o empty", "empty: is a folder, not a table"),
    ],
)
def test_a_file_in_the_place_of_another_is_called_what_it_is(folder, command, said):
    done = prb3r(*command.split(), cwd=folder)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert said in line


def test_files_are_told_by_keys_that_they_have():
    models = {"recording": RecordingFile, "manipulator": Manipulator, "study": Study}
    assert FILE_KINDS.keys() == models.keys()
    for kind, model in models.items():
        assert FILE_KINDS[kind] <= model.model_fields.keys()
        assert kind_of_keys([name for name, field in model.model_fields.items() if field.is_required()]) == kind
    assert Wishes.model_fields.keys() == WISHES


@pytest.mark.parametrize(
    "words", [["report", ""], ["solve", "manipulator.toml", "steps.csv", "-o", ""], ["check", ""], ["run", ""]]
)
def test_an_empty_argument_is_no_name_of_this_folder(folder, words):
    before = sorted(folder.iterdir())
    done = prb3r(*words, cwd=folder)
    assert done.returncode == 2
    assert "an argument is empty; is a variable of the shell not set?" in done.stderr
    assert done.stdout == ""
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize(
    ("effect", "said"),
    [
        ('kind = "disk_contact"\nangle_rad = 30\nstiffness_n_m_per_rad = 9', "30 degrees is 0.523599"),
        (
            'kind = "superelastic_plate"\nplateau_strain = 0.0075\ntube_outer_m = 1.2\ntube_inner_m = 0.9\n'
            "notch_depth_m = 0.8",
            "effect.1.tube_outer_m: 1.2 m is not what rigs are made with (up to 0.2 m); lengths are given in metres: "
            "1.2 mm is 0.0012",
        ),
        (
            'kind = "hole_offset"\ncable = "1"\noffset_m = 0.5',
            "effect.1.offset_m: 0.5 m is not what rigs are made with",
        ),
        ('kind = "hole_clearance"\nclearance_m = 0.3', "0.3 mm is 0.0003"),
    ],
)
def test_effects_in_other_units_are_refused(folder, effect, said):
    manipulator = folder / "manipulator.toml"
    manipulator.write_text(f"{manipulator.read_text()}\n[[effect]]\n{effect}\n")
    done = prb3r("check", manipulator)
    assert done.returncode == 2
    assert said in done.stderr


@pytest.mark.parametrize(
    ("effects", "masses", "said"),
    [
        (['kind = "gravity"\ny_m_s2 = -9.81'], 0, "effect gravity changes nothing: nothing has a mass (disk.mass_kg"),
        (['kind = "gravity"'], 0.05, "effect gravity changes nothing: x_m_s2 and y_m_s2 are 0"),
        (['kind = "tip_mass"\nmass_kg = 0.1'], 0.05, "effect tip_mass changes nothing: there is no effect gravity"),
        (['kind = "tip_mass"\nmass_kg = 0.1', 'kind = "gravity"\ny_m_s2 = -9.81'], 0, ""),
        (['kind = "gravity"\ny_m_s2 = -9.81'], 0.05, ""),
    ],
)
def test_effects_that_change_nothing_are_told(folder, effects, masses, said):
    manipulator = folder / "manipulator.toml"
    text = re.sub(r"(?m)^mass_kg = .*$", "", manipulator.read_text())
    text = text.replace("[disk]", f"[disk]\nmass_kg = {masses}", 1)
    manipulator.write_text("\n".join([text, *(f"[[effect]]\n{effect}" for effect in effects), ""]))
    done = prb3r("check", manipulator)
    assert done.returncode == 0, done.stderr
    assert said in done.stdout
    assert bool(said) == ("changes nothing" in done.stdout)


def test_an_effect_of_a_recordings_manipulator_that_changes_nothing_is_told(folder):
    manipulator = folder / "recording/manipulator.toml"
    manipulator.write_text(f'{manipulator.read_text()}\n[[effect]]\nkind = "tip_mass"\nmass_kg = 0.1\n')
    done = prb3r("check", folder / "recording")
    assert done.returncode == 0, done.stderr
    assert "\n  effect tip_mass changes nothing: there is no effect gravity beside it\n" in done.stdout


def test_a_study_with_a_stray_key_of_another_file_is_still_a_study(folder):
    study = folder / "study.toml"
    study.write_text("disk = 3\n" + study.read_text())
    done = prb3r("run", study)
    assert done.returncode == 2
    assert "study.toml:1 disk: unknown key 'disk'" in done.stderr


def test_suffixes_may_be_in_capitals(folder):
    (folder / "STEPS.CSV").write_text(STEPS)
    (folder / "steps.csv").rename(folder / "other.csv")
    (folder / "MANIPULATOR.TOML").write_text(PROTOTYPE.read_text())
    plain = prb3r("solve", "manipulator.toml", "other.csv", cwd=folder).stdout
    assert prb3r("solve", "MANIPULATOR.TOML", "STEPS.CSV", cwd=folder).stdout == plain
    assert prb3r("solve", "manipulator.toml", "STEPS.CSV", "-o", "out.PARQUET", cwd=folder).returncode == 0
    assert len(pd.read_parquet(folder / "out.PARQUET")) == len(plain.splitlines()) - 1
    assert "table of 1 step in 1 sequence" in prb3r("check", "STEPS.CSV", "MANIPULATOR.TOML", cwd=folder).stdout
    for name in ("steps", "markers"):
        (folder / f"recording/{name}.csv").rename(folder / f"recording/{name}.CSV")
    assert "recording, 6 sequences" in prb3r("check", "recording", cwd=folder).stdout


def test_space_at_the_ends_of_a_cables_name_survives_a_csv(folder):
    text = PROTOTYPE.read_text()
    assert 'name = "1"' in text
    (folder / "space.toml").write_text(text.replace('name = "1"', 'name = " a "'))
    assert prb3r("reach", "space.toml", "--y", "0.05", "-o", "pull.csv", cwd=folder).returncode == 0
    named = prb3r("solve", "space.toml", "pull.csv", cwd=folder)
    assert prb3r("reach", "manipulator.toml", "--y", "0.05", "-o", "same.csv", cwd=folder).returncode == 0
    assert named.returncode == 0
    assert named.stdout == prb3r("solve", "manipulator.toml", "same.csv", cwd=folder).stdout


def test_a_tension_below_zero_is_said_beside_one_that_is_no_number(folder):
    (folder / "steps.csv").write_text("sequence,step,cable_1_n\na,1,inf\na,2,-5\n")
    said = prb3r("solve", "manipulator.toml", "steps.csv", cwd=folder).stderr
    assert "row 1 is infinite" in said
    assert "row 2 is -5: a cable cannot push" in said


def test_one_thing_is_not_several(folder):
    done = prb3r("run", "study.toml", "-o", "results", "-j", "1", cwd=folder)
    assert "s: 1 case (1 computed, 0 from earlier runs)" in done.stdout
    assert "s: 1 case\n" in done.stderr
    assert "1 of 1 case in" in done.stderr
    assert "s: 1 case, 1 of them stored" in prb3r("run", "study.toml", "-o", "results", "--dry-run", cwd=folder).stdout
    assert prb3r("solve", "manipulator.toml", "steps.csv", "-o", "x.csv", cwd=folder).stdout.startswith(
        "1 step, 0 with"
    )
    (folder / "steps.csv").write_text("sequence,step,cable_1_n,slip_1\na,1,9e9,-1\n")
    said = prb3r("solve", "manipulator.toml", "steps.csv", cwd=folder).stderr
    assert "1 of 1 step has no stable equilibrium" in said


def test_a_value_of_a_factor_stands_there_once(folder):
    factor = '[[factor]]\nname = "cable_1_n"\npath = "step.1.cable_1_n"\nvalues = [1, 2.0, 1.0]\n'
    study = folder / "study.toml"
    study.write_text(STUDY + METRIC + factor)
    done = prb3r("check", study)
    assert done.returncode == 2
    assert "factor 'cable_1_n': the value 1.0 stands there twice; give each once" in done.stderr


def test_of_zipped_factors_the_pairs_differ(folder):
    first, second = (
        f'[[factor]]\nname = "cable_{k}_n"\npath = "step.1.cable_{k}_n"\nzip = "z"\nvalues = {{}}\n' for k in (1, 2)
    )
    study = folder / "study.toml"
    study.write_text(STUDY + METRIC + first.format([1.0, 1.0, 2.0]) + second.format([1.0, 2.0, 1.0]))
    assert "study of 3 cases" in prb3r("check", study).stdout
    study.write_text(STUDY + METRIC + first.format([1.0, 1.0, 2.0]) + second.format([2.0, 2.0, 1.0]))
    done = prb3r("check", study)
    said = "factors zipped as 'z': the values 1.0, 2.0 stand there twice; give each once"
    assert f"study.toml:9 factor.cable_1_n: {said}" in done.stderr


def test_a_level_that_stands_there_twice_beside_a_value_is_called_by_its_label(folder):
    levels = 2 * '[[factor.level]]\nlabel = "slack"\nstep = [{ cable_1_n = 5.0 }]\n'
    zipped = '[[factor]]\nname = "mu"\npath = "friction.coefficient"\nvalues = [0.1, 0.1]\nzip = "z"\n'
    study = folder / "study.toml"
    study.write_text(STUDY + METRIC + '[[factor]]\nname = "pull"\nzip = "z"\n' + levels + zipped)
    assert "factors zipped as 'z': the values slack, 0.1 stand there twice" in prb3r("check", study).stderr


def test_cases_that_only_repeat_others_are_not_said_to_be_stored(folder):
    """Two cables that are broken in either order: two cases by name, one to compute."""
    levels = "".join(f'[[factor.level]]\nlabel = "{k}"\nstep = [{{ cable_1_n = 5.0 }}]\n' for k in "ab")
    (folder / "study.toml").write_text(STUDY.partition("[[step]]")[0] + METRIC + '[[factor]]\nname = "pull"\n' + levels)
    done = prb3r("run", "study.toml", "-o", "results", "-j", "1", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "s: 2 cases, 1 to compute" in done.stderr


def test_play_is_refused_where_a_study_with_targets_is_checked(folder):
    play = '\n[[effect]]\nkind = "tension_play"\nplay_n = 4.0\n'
    (folder / "manipulator.toml").write_text(PROTOTYPE.read_text() + play)
    study = folder / "study.toml"
    reach = '[reach]\ntarget = [{ y_m = 0.05 }]\n[[metric]]\nkind = "follow"\n'
    study.write_text(f'name = "s"\ntitle = "t"\nmanipulator = "manipulator.toml"\n{reach}')
    done = prb3r("check", study)
    assert done.returncode == 2
    assert "reach: tension_play: which tension to pull with depends on the way it changes" in done.stderr


@pytest.mark.parametrize(
    "loads", ["[[step]]\ncable_1_n = 1\n" + METRIC, "[reach]\ntarget = [{ y_m = 0.05 }]\n" + METRIC]
)
def test_too_many_plates_for_friction_along_the_path_are_said_where_a_study_is_checked(folder, loads):
    text = PROTOTYPE.read_text()
    assert text.count("plates = 7") == 2
    assert "coefficient = 0.3" in text
    text = text.replace("plates = 7", "plates = 501").replace(
        "coefficient = 0.3", 'coefficient = 0.3\ndirection = "history"'
    )
    (folder / "manipulator.toml").write_text(text)
    study = folder / "study.toml"
    study.write_text(f'name = "s"\ntitle = "t"\nmanipulator = "manipulator.toml"\n{loads}')
    done = prb3r("check", study)
    assert done.returncode == 2
    assert "1,002 plates with friction that follows the cables' travel: at most 1,000" in done.stderr


def test_a_missing_manipulator_is_told_with_the_line_that_names_it(folder):
    (folder / "study.toml").write_text((STUDY + METRIC).replace(str(PROTOTYPE), "manipulatr.toml"))
    said = prb3r("check", "study.toml", cwd=folder).stderr
    assert "study.toml:3 manipulator: manipulatr.toml: no such file; did you mean 'manipulator.toml'?" in said


def test_text_without_quotes_is_told_to_need_them(folder):
    (folder / "study.toml").write_text("name = s\n")
    said = prb3r("check", "study.toml", cwd=folder).stderr
    assert 'study.toml:1: not valid TOML: invalid value; text needs quotes: "..."' in said
    (folder / "study.toml").write_text("name = 1..2\n")
    assert "quotes" not in prb3r("check", "study.toml", cwd=folder).stderr


@pytest.mark.parametrize(("column", "kind"), [("coupling_m_per_n", "coupling"), ("safety_factor", "safety")])
def test_a_column_that_a_metric_would_make_is_told_with_its_kind(folder, column, kind):
    wish = f'[[requirement]]\nmetric = "{column}"\nat_least = 1\n'
    factor = '[[factor]]\nname = "length_m"\npath = "segment.1.length_m"\nvalues = [0.03, 0.032]\n'
    (folder / "study.toml").write_text(STUDY + METRIC + factor + wish)
    said = prb3r("check", "study.toml", cwd=folder).stderr
    assert f"there is no column {column!r}; a metric of the kind {kind!r} makes it" in said


def test_single_values_are_one_step():
    one = solve(str(PROTOTYPE), {"sequence": "a", "step": 1, "cable_1_n": 5.0})
    assert one.equals(solve(str(PROTOTYPE), {"sequence": ["a"], "step": [1], "cable_1_n": [5.0]}))
