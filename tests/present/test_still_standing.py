"""A study of which nothing has changed is not loaded again, one of which anything has is run as ever."""

import shutil
import subprocess
import sys

import pandas as pd
import pytest
from command import PROTOTYPE, prb3r

from prb3r.present.study.current import still_standing

STUDY = """
name = "three"
title = "three"
manipulator = "rig.toml"
step = [{ cable_1_n = 20 }]
factor = [{ name = "load_n", path = "step.1.cable_1_n", values = [20, 40, 60] }]
metric = [{ kind = "position", disk = 7 }]
"""


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    folder = tmp_path_factory.mktemp("standing")
    shutil.copy(PROTOTYPE, folder / "rig.toml")
    (folder / "three.toml").write_text(STUDY)
    done = prb3r("run", "three.toml", "-o", "out", "-j", 1, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "3 computed" in done.stdout
    return folder


@pytest.fixture
def here(ran, tmp_path, monkeypatch):
    shutil.copytree(ran, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_an_unchanged_study_is_told_without_the_libraries_that_solve_and_draw(here):
    script = (
        "import sys\nfrom prb3r.cli import main\ntry: main(['run', 'three.toml', '-o', 'out'])\n"
        "except SystemExit as end: print(end.code, {'numpy', 'pandas', 'numba', 'matplotlib'} & set(sys.modules))"
    )
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert said.stdout.splitlines()[0].startswith("three: 3 cases (unchanged)"), said.stderr
    assert said.stdout.splitlines()[1] == "0 set()"


@pytest.mark.parametrize(
    ("file", "before", "after"),
    [
        ("three.toml", "values = [20, 40, 60]", "values = [20, 40, 80]"),
        ("rig.toml", "clamp_m = 0.008", "clamp_m = 0.009"),
        ("out/three/summary.md", "three", "four"),
        ("out/three/manifest.json", "converged", "diverged"),
        ("out/three/.ended.json", "[", "{"),
        ("out/three/.ended.json", '"said": ', '"unsaid": '),
    ],
)
def test_what_differs_in_any_file_is_run_again(here, file, before, after):
    assert still_standing("three.toml", "out").said.startswith("three: 3 cases (unchanged)")
    text = (here / file).read_text()
    assert before in text
    (here / file).write_text(text.replace(before, after, 1))
    assert still_standing("three.toml", "out") is None


def test_a_table_that_is_lost_or_damaged_is_written_again(here):
    table = here / "out/three/cases.parquet"
    whole = table.read_bytes()
    for damage in (lambda: table.unlink(), lambda: table.write_bytes(whole[:-9] + b"x" + whole[-8:])):
        damage()
        assert still_standing("three.toml", "out") is None
        assert "3 cases (unchanged)" in prb3r("run", "three.toml", "-o", "out", cwd=here).stdout
        assert table.read_bytes() == whole
    assert len(pd.read_parquet(table)) == 3


def test_another_file_of_the_same_name_and_other_libraries_are_no_earlier_run(here, monkeypatch):
    shutil.copy(here / "three.toml", here / "copy.toml")
    assert still_standing("copy.toml", "out") is None
    assert prb3r("run", "copy.toml", "-o", "out", cwd=here).returncode == 2  # two files of one name
    assert still_standing("three.toml", "elsewhere") is None
    monkeypatch.setattr("prb3r.runs.provenance.PACKAGES", ("numpy",))
    assert still_standing("three.toml", "out") is None


def test_a_run_that_is_asked_for_is_done(here):
    assert "3 computed" in prb3r("run", "three.toml", "-o", "out", "--fresh", "-j", 1, cwd=here).stdout
    assert "nothing to compute" in prb3r("run", "three.toml", "-o", "out", "--dry-run", cwd=here).stdout


def test_a_study_with_failed_cases_ends_with_1_each_time(here):
    (here / "three.toml").write_text(STUDY.replace("60]", "1e6]"))
    first, second = (prb3r("run", "three.toml", "-o", "out", "-j", 1, cwd=here) for _ in range(2))
    assert (first.returncode, second.returncode) == (1, 1)
    assert "1 without a stable equilibrium" in second.stdout
    assert "(unchanged)" in second.stdout
