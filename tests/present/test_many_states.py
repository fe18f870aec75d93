"""A page of a study with many states holds some of them, and never needs all in memory unless a plot draws them."""

import json
import subprocess
import sys

import pytest
from command import PROTOTYPE

from prb3r.present.study import thinning
from prb3r.present.study.firsts import tensions_in_words
from prb3r.present.study.publish import publish
from prb3r.study import run as running
from prb3r.study.run import Options, solve_study

STUDY = f"""
name = "many"
title = "many"
manipulator = "{PROTOTYPE}"
states = "final"
step = [{{ cable_1_n = 20 }}]
factor = [{{ name = "load_n", path = "step.1.cable_1_n", values = [10, 20, 30, 40, 50, 60] }}]
metric = [{{ kind = "position", disk = 14 }}]
"""
LINES = """[[plot]]
name = "tips"
kind = "lines"
x = "load_n"
y = ["disk14_y_m"]
"""


@pytest.fixture
def solved(tmp_path):
    def solve(text):
        (tmp_path / "many.toml").write_text(text)
        return solve_study(tmp_path / "many.toml", Options(tmp_path / "out"))

    return solve


def test_a_page_without_plots_needs_no_states(solved, monkeypatch):
    monkeypatch.setattr(running.Result, "states", lambda self: pytest.fail("states were read"))
    assert thinning.states_to_draw(solved(STUDY)) is None


def test_of_many_cases_a_page_shows_the_states_of_the_first(solved, monkeypatch):
    result = solved(STUDY + LINES)
    every = result.states()
    assert thinning.states_to_draw(result).equals(every)
    monkeypatch.setattr(thinning, "MOST_ROWS", 3 * 15)
    monkeypatch.setattr(running.Result, "states", lambda self: pytest.fail("all states were read"))
    assert thinning.states_to_draw(result).equals(every[every["case_id"] < 3])
    publish(result)
    assert "many" in (result.folder / "report.html").read_text()


def test_a_plot_of_states_is_drawn_from_all(solved, monkeypatch):
    result = solved(STUDY + LINES.replace("lines", "shapes").replace('x = "load_n"\ny = ["disk14_y_m"]', ""))
    monkeypatch.setattr(thinning, "MOST_ROWS", 3 * 15)
    assert thinning.states_to_draw(result)["case_id"].nunique() == 6


CLOUD = f"""
name = "many"
title = "many"
manipulator = "{PROTOTYPE}"
states = "path"
state_disks = [14]
metric = [{{ kind = "workspace" }}]
[cloud]
count = 64
tension_n = {{ 1 = 30.0, 3 = 30.0 }}
"""


def test_of_a_cloud_only_the_columns_that_are_drawn_are_read(solved, monkeypatch):
    monkeypatch.setattr(running.Result, "states", lambda self: pytest.fail("all columns were read"))
    assert thinning.states_to_draw(solved(CLOUD)) is None
    tips = thinning.states_to_draw(solved(CLOUD + '[[plot]]\nname = "reach"\nkind = "workspace"\n'))
    assert list(tips) == ["case_id", "step", "disk", "x_m", "y_m"]
    assert tips["step"].tolist() == list(range(1, 65))


def test_of_each_load_of_a_cloud_that_is_pointed_at_the_page_tells_the_tensions(solved):
    result = solved(CLOUD + '[[plot]]\nname = "reach"\nkind = "workspace"\n')
    publish(result)
    page = (result.folder / "report.html").read_text()
    states = json.loads(page.split('id="pointed">')[1].split("</script>")[0])["states"]
    loads = result.states().set_index("step")
    assert sorted(states) == sorted(f"0:{step}" for step in loads.index)
    for key, (_, said) in states.items():
        row = loads.loc[int(key.removeprefix("0:"))]
        pulls = {name: row[f"cable_{name}_n"] for name in "1234"}
        assert said == tensions_in_words(pulls)


def test_manipulators_of_a_cloud_are_drawn_with_the_angles_of_their_disks(solved):
    shapes = '[[plot]]\nname = "arms"\nkind = "shapes"\n'
    result = solved(CLOUD.replace("state_disks = [14]\n", "") + shapes)
    assert result.folder / "arms.png" in publish(result)


@pytest.mark.long
def test_a_page_without_pictures_loads_no_library_that_draws(tmp_path):
    (tmp_path / "many.toml").write_text(STUDY)
    script = (
        "import sys; from pathlib import Path; from prb3r.present.study.publish import publish; "
        "from prb3r.study.run import Options, solve_study; "
        "publish(solve_study('many.toml', Options(Path('out')))); print('matplotlib.figure' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
    assert (tmp_path / "out/many/report.html").exists()
