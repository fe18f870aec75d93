"""What users and machines do to studies: a sentence, or a result that is whole; never a traceback, never silence."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from in_process import InProcess

import prb3r
from prb3r.errors import EngineError, SpecError
from prb3r.model.files.comma_separated import csv_text
from prb3r.model.files.table import read_table, write_table
from prb3r.present.study.publish import publish
from prb3r.runs.engine import BACKENDS
from prb3r.study.plan import plan_study
from prb3r.study.run import Options, solve_study

ROOT = Path(__file__).parents[2]
PROTOTYPE = ROOT / "studies/manipulators/two-segment.toml"
SPEC = f"""
name = "trial"
title = "A trial of $\\\\foo$ and <b>"
manipulator = "{PROTOTYPE}"
chunk = 1
[[factor]]
name = "cable_1_n"
path = "step.1.cable_1_n"
values = [5, 20]
[[factor]]
name = "kind"
[[factor.level]]
label = "$\\\\foo$ & <i>"
[[factor.level]]
label = "costs $5"
set = {{ "friction.coefficient" = 0.1 }}
[[step]]
cable_1_n = 0
[[metric]]
kind = "position"
[[plot]]
name = "tips"
kind = "lines"
caption = "of $\\\\foo$"
x = "cable_1_n"
y = ["tip_y_m"]
by = "kind"
"""


@pytest.fixture
def spec(tmp_path):
    def write(text=SPEC, name="trial.toml") -> Path:
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def test_signs_of_formulas_and_markup_in_words_are_words(spec, tmp_path):
    result = solve_study(spec(), Options(tmp_path / "out"))
    publish(result)
    drawn = (result.folder / "tips.svg").read_text()
    assert "$\\foo$ &amp; &lt;i" in drawn
    page = (result.folder / "report.html").read_text()
    assert "<i>" not in page
    assert "$\\foo$ &amp; &lt;i&gt;" in page


def test_two_files_of_one_name_are_refused_and_overwrite_nothing(spec, tmp_path):
    first = solve_study(spec(), Options(tmp_path / "out"))
    before = (first.folder / "cases.parquet").read_bytes()
    with pytest.raises(SpecError, match=r"trial.toml is named 'trial' too, and its results are in .*; rename one"):
        solve_study(spec(SPEC.replace("[5, 20]", "[7]"), "other.toml"), Options(tmp_path / "out"))
    assert (first.folder / "cases.parquet").read_bytes() == before
    (tmp_path / "trial.toml").rename(tmp_path / "moved.toml")
    assert solve_study(tmp_path / "moved.toml", Options(tmp_path / "out")).computed == 0


class Remover:
    """Removes the results as soon as the first case is there."""

    def __init__(self, folder):
        self.folder, self.heard = folder, 0

    def begin(self, *_): ...

    def advance(self, cases, failed):
        self.heard += cases
        shutil.rmtree(self.folder)

    def end(self): ...


def test_results_that_are_removed_in_mid_run_are_told_with_the_next_case(spec, tmp_path, monkeypatch):
    monkeypatch.setitem(BACKENDS, "loky", InProcess)  # what fails would end the workers
    remover = Remover(tmp_path / "out" / "trial")
    with pytest.raises(EngineError, match="cannot be written: its folder is not there any more"):
        solve_study(spec(), Options(tmp_path / "out"), remover)
    assert remover.heard == 1
    assert solve_study(spec(), Options(tmp_path / "out")).computed == 4


@pytest.mark.parametrize("values", ["values = [1, inf]", "linspace = { from = 0, to = inf, count = 3 }"])
def test_infinity_in_a_grid_is_refused(spec, values):
    with pytest.raises(SpecError, match="inf is not allowed; write a finite number"):
        plan_study(spec(SPEC.replace("values = [5, 20]", values)))


def test_a_chain_too_long_for_what_its_holes_do_together_is_refused_with_the_limit(spec):
    text = SPEC.partition("[[plot]]")[0].replace(
        "chunk = 1", 'set = { "segment.1.plates" = 99_000, "friction.direction" = "history" }'
    )
    with pytest.raises(SpecError, match="99,007 plates with friction that follows the cables' travel: at most 1,000"):
        plan_study(spec(text))
    long = prb3r.load_manipulator(PROTOTYPE).replace("segment.1.plates", 99_000)
    long = long.replace("friction.direction", "history")
    with pytest.raises(SpecError, match="99,007 plates with friction that follows"):
        prb3r.solve(long, {"sequence": "a", "step": [1]})
    with pytest.raises(SpecError, match="more than 100000 plates"):
        plan_study(spec(text.replace("99_000", "99_994")))


RUN = ["=1+1", "+x", "-x", "@x", "\tx", "'=1", "''-x"]
KEPT = ["-3", "+1e5", "x=1", "'x", "", "a-b"]


def test_csv_holds_nothing_that_spreadsheets_run_and_reads_back_as_it_was(tmp_path):
    frame = pd.DataFrame({"sequence": [*RUN, *KEPT], "step": 1, "cable_1_n": np.arange(13) - 6.0})
    cells = [line.rpartition(",")[0].rpartition(",")[0].strip('"') for line in csv_text(frame).splitlines()[1:]]
    assert [cell[0] for cell in cells[: len(RUN)]] == ["'"] * len(RUN)
    assert cells[len(RUN) :] == KEPT
    write_table(frame, tmp_path / "t.csv")
    pd.testing.assert_frame_equal(read_table(tmp_path / "t.csv"), frame, check_dtype=False)
