"""A run resumes, repairs, repeats to the byte and loses nothing."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from prb3r.errors import SpecError
from prb3r.present.figure_files import save_figure
from prb3r.present.study import pictures
from prb3r.present.study.current import publish_what_changed
from prb3r.runs.tasks import Piece, Workers
from prb3r.study.compute import computed_columns
from prb3r.study.plan import plan_study
from prb3r.study.run import Options, solve_study
from prb3r.study.work import solve_chunk

ROOT = Path(__file__).parents[2]
SPEC = f"""
name = "trial"
title = "A trial"
manipulator = "{ROOT}/studies/manipulators/two-segment.toml"
states = "path"
chunk = 3
[[factor]]
name = "mu"
path = "friction.coefficient"
values = [0.0, 0.1, 0.2, 0.3]
[[factor]]
name = "cable_1_n"
path = "step.1.cable_1_n"
values = [20, 60]
[initial]
cable_3_n = 30
[[step]]
cable_1_n = 0
[[metric]]
kind = "shift"
disk = 7
[[comparison]]
name = "more_shift_m"
kind = "difference"
of = "disk7_shift_m"
to = {{ mu = 0.0 }}
"""


@pytest.fixture
def spec(tmp_path):
    path = tmp_path / "trial.toml"
    path.write_text(SPEC)
    return path


def go(spec, out, jobs=1, **more):
    return solve_study(spec, Options(out, Workers(jobs=jobs), **more))


def content(folder):
    return {name: (folder / name).read_bytes() for name in ("cases.parquet", "states.parquet")}


def test_bytes_do_not_depend_on_workers_or_on_resuming_and_a_damaged_part_is_repaired(spec, tmp_path):
    one = go(spec, tmp_path / "one")
    two = go(spec, tmp_path / "two", jobs=2)
    assert (one.computed, one.failed) == (8, 0)
    expected = content(one.folder)
    assert content(two.folder) == expected
    assert go(spec, tmp_path / "one").computed == 0
    assert content(one.folder) == expected
    part = sorted(two.folder.glob(".parts/*.cases"), key=lambda path: path.stat().st_size)[-1]
    part.write_bytes(part.read_bytes()[:100])
    (two.folder / "cases.parquet").unlink()
    assert go(spec, tmp_path / "two").computed == 3
    assert content(two.folder) == expected


def test_a_changed_spec_is_a_new_result_and_says_what_changed(spec, tmp_path):
    go(spec, tmp_path / "out")
    spec.write_text(SPEC.replace("values = [20, 60]", "values = [20, 70]"))
    changed = go(spec, tmp_path / "out")
    assert changed.computed == 4  # the cases with 20 N are those of before
    assert changed.manifest["changed"] == ["study factor.1.values.1: 60 -> 70"]
    spec.write_text(SPEC)
    assert go(spec, tmp_path / "out").computed == 0  # nothing already computed was lost


def test_figures_and_report_are_made_again_only_where_something_changed(spec, tmp_path, monkeypatch):
    plot = '[[plot]]\nname = "shifts"\nkind = "lines"\nx = "mu"\ny = ["disk7_shift_m"]\ncaption = "How far."\n'
    drawn = []

    def published():
        drawn.clear()
        return sorted(path.name for path in publish_what_changed(go(spec, tmp_path)))

    monkeypatch.setattr(pictures, "save_figure", lambda *to: (drawn.append(to[2]), save_figure(*to))[1])
    spec.write_text(SPEC + plot)
    files, folder = published(), tmp_path / "trial"
    assert files == ["report.html", "shifts.png", "shifts.svg", "summary.md"]
    assert drawn == ["shifts"]
    content = {name: (folder / name).read_bytes() for name in files}
    assert published() == files
    assert not drawn
    (folder / "shifts.png").unlink()
    (folder / "report.html").write_text("torn")
    assert published() == files
    assert drawn == ["shifts"]
    assert {name: (folder / name).read_bytes() for name in files if name.startswith("shifts")} == {
        name: content[name] for name in files if name.startswith("shifts")
    }
    assert (folder / "report.html").read_text().startswith("<!")
    spec.write_text(SPEC + plot.replace("How far", "How near"))
    published()
    assert drawn == ["shifts"]
    assert "How near" in (folder / "report.html").read_text()
    with matplotlib.rc_context({"axes.facecolor": "#ffeedd"}):
        published()
        assert drawn == ["shifts"]
        published()
        assert not drawn


def test_tables_say_what_they_hold_and_other_tools_read_them(spec, tmp_path):
    import duckdb  # here alone, as no other test of this file needs them
    import polars

    folder = go(spec, tmp_path / "out").folder
    schema = pq.read_schema(folder / "cases.parquet")
    assert schema.field("disk7_shift_m").metadata[b"unit"] == b"m"
    assert b"friction.coefficient" in schema.field("mu").metadata[b"description"]
    assert json.loads(schema.metadata[b"prb3r"])["study"] == "trial"
    frame = pd.read_parquet(folder / "states.parquet")
    assert len(frame) == 8 * 2 * 15
    assert sorted(frame["step"].unique()) == [0, 1]
    assert polars.read_parquet(folder / "cases.parquet")["case_id"].to_list() == list(range(8))
    assert duckdb.sql(f"select count(*) from '{folder}/cases.parquet' where outcome = 'converged'").fetchall() == [(8,)]
    manifest = json.loads((folder / "manifest.json").read_text())
    assert {"study", "key", "versions", "platform", "git", "run", "outcomes"} <= set(manifest)


def test_an_impossible_case_is_a_row_with_its_reason(spec, tmp_path):
    spec.write_text(SPEC.replace("values = [20, 60]", "values = [20, 1e6]"))
    result = go(spec, tmp_path / "out")
    rows = result.cases.set_index(["mu", "cable_1_n"])
    assert result.failed == 4
    assert (rows["outcome"].xs(1e6, level=1) == "no equilibrium").all()
    assert rows["reason"].xs(1e6, level=1).str.len().gt(20).all()
    assert np.isnan(rows["disk7_shift_m"].xs(1e6, level=1)).all()
    assert rows["disk7_shift_m"].xs(20.0, level=1).notna().all()


def test_results_that_cannot_be_written_are_refused_before_work(spec, tmp_path):
    (tmp_path / "file").write_text("taken")
    with pytest.raises(SpecError, match="is a file"):
        go(spec, tmp_path / "file")


@pytest.mark.long
def test_an_interrupted_run_keeps_what_it_has_and_goes_on(tmp_path):
    spec, out = tmp_path / "trial.toml", tmp_path / "out"
    many = SPEC.replace("values = [20, 60]", "linspace = { from = 1, to = 60, count = 600 }").replace(
        "chunk = 3", "chunk = 20"
    )
    spec.write_text(many)
    command = [sys.executable, "-m", "prb3r", "run", str(spec), "-o", str(out), "-j", "2"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    parts, end = lambda: list(out.glob("trial/.parts/*.states")), time.monotonic() + 200
    while len(parts()) < 3 and process.poll() is None and time.monotonic() < end:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=100)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert "run the same command to go on" in said
    stored = len(parts())
    assert 3 <= stored < 120
    spec.write_text(many)
    result = go(spec, out, jobs=os.cpu_count())
    assert 0 < result.computed <= 2400 - 20 * (stored - 1)
    assert result.failed == 0


def test_a_case_whose_worker_died_is_a_row_with_its_reason(spec, tmp_path):
    plan = plan_study(spec, tmp_path)
    (chunk,) = plan.chunks(np.ones((8, 3), bool))[:1]
    dead, *rest = chunk.single()
    solved = [Piece(one, "done", solve_chunk(one)) for one in rest]
    cases, states = computed_columns([Piece(dead, "crashed", reason="its worker died (SIGKILL)"), *solved], chunk)
    assert cases["outcome"].tolist() == ["crashed", "converged", "converged"]
    assert cases["reason"][0] == "its worker died (SIGKILL)"
    assert np.isnan(cases["disk7_shift_m"][0])
    assert set(states["case_id"]) == {1, 2}


def test_a_case_beyond_its_limit_says_so_and_one_before_it_says_how_far_it_is(spec, tmp_path):
    """Tip load against cables: the branch ends at 0.728 of the larger loads."""
    level = (
        "[[factor.level]]\nlabel = '{}'\nstep = [{{ cable_3_n = {}, cable_4_n = {}, tip_x_n = {}, tip_y_n = {} }}]\n"
    )
    levels = level.format("half", 30, 75, 1.5, 5) + level.format("whole", 60, 150, 3, 10)
    head = f'name = "limit"\ntitle = "Limit"\nmanipulator = "{ROOT}/studies/manipulators/two-segment.toml"\n'
    model = 'model = "prb3r"\nset = { "friction.coefficient" = 0.0 }\n[[factor]]\nname = "loads"\n'
    spec.write_text(head + model + levels + '[[step]]\ncable_1_n = 0\n[[metric]]\nkind = "limit-load"\n')
    rows = go(spec, tmp_path / "out").cases.set_index("loads")
    assert rows.loc["half", "limit_load_factor"] == pytest.approx(2 * 0.7283, rel=1e-3)
    assert rows.loc["half", "outcome"] == "converged"
    assert rows.loc["whole", "outcome"] == "limit point"
    assert "would jump; reached 72.8 % of the step" in rows.loc["whole", "reason"]
    assert np.isnan(rows.loc["whole", "limit_load_factor"])
