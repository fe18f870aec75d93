"""What comes back from the front door: short to print, at home in a notebook, with tables, figures and files."""

import dataclasses
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import prb3r
from prb3r.model.effects import EFFECT_KINDS

ROOT = Path(__file__).parents[1]
ARM = ROOT / "studies/manipulators/two-segment.toml"
STUDY = f"""
name = "trial"
title = "A trial"
question = "Which thickness, if $5 < 6$ matters?"
manipulator = "{ARM}"
states = "final"
[[factor]]
name = "thickness_m"
path = "segment.1.thickness_m"
values = [0.0008, 0.001, 0.0012]
[[factor]]
name = "mu"
path = "friction.coefficient"
values = [0.1, 0.3]
[[step]]
cable_1_n = 40
[[metric]]
kind = "shift"
disk = 7
[[metric]]
kind = "safety"
[[plot]]
name = "drag"
kind = "lines"
x = "thickness_m"
y = ["disk7_shift_m"]
by = "mu"
[[plot]]
name = "shapes"
kind = "shapes"
panel = "mu"
by = "thickness_m"
[designs]
factors = ["thickness_m"]
[[requirement]]
metric = "safety_factor"
at_least = 1.5
[[preference]]
metric = "disk7_shift_m"
better = "less"
[[preference]]
metric = "safety_factor"
better = "greater"
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("front")
    (folder / "trial.toml").write_text(STUDY)
    return prb3r.run_study(folder / "trial.toml", output=folder / "results")


@pytest.fixture(scope="module")
def counsel(study):
    return prb3r.compare(study)


@pytest.fixture(scope="module")
def reached():
    return prb3r.reach(ARM, path=pd.DataFrame({"x_m": [0.45, 0.41, 0.9], "y_m": [0.1, 0.2, 0.0]}))


class Balanced(HTMLParser):
    """Every tag that is opened is closed, in its turn."""

    def __init__(self, text):
        super().__init__()
        self.open, self.seen = [], set()
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.seen.add(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.mark.parametrize("name", ["study", "counsel", "reached"])
def test_results_are_frozen_short_and_at_home_in_a_notebook(name, request):
    result = request.getfixturevalue(name)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(result, dataclasses.fields(result)[0].name, None)
    assert 20 < len(repr(result)) < 700
    assert {"p", "td"} <= Balanced(result._repr_html_()).seen
    assert "**" not in repr(result) + result._repr_html_()
    assert isinstance(result.frame, pd.DataFrame)


def test_a_study_has_its_tables_and_what_the_command_writes(study, tmp_path):
    assert set(study.tables) == {"cases", "states"}
    assert study.tables["cases"].equals(study.frame)
    assert "6 cases, all in stable equilibrium" in repr(study)
    assert "$5 &lt; 6$" in study._repr_html_()
    names = {path.name for path in study.report(tmp_path / "copy")}
    assert {"cases.parquet", "states.parquet", "manifest.json", "report.html", "drag.svg", "shapes.png"} <= names
    assert {path.name for path in study.files} <= names == {path.name for path in (tmp_path / "copy").iterdir()}
    assert (tmp_path / "copy/report.html").read_bytes() == (study.folder / "report.html").read_bytes()


def drawn(axes):
    return sum(len(part) for part in (axes.lines, axes.collections, axes.patches))


def test_plots_are_drawn_on_given_axes_as_on_their_own(study, counsel, reached):
    for draw, count in (
        (lambda axes: study.plot(axes=axes), 1),
        (lambda axes: study.plot("shapes", axes=axes), 2),
        (lambda axes: counsel.plot(axes=axes), 2),
        (lambda axes: counsel.plot("front", axes=axes), 1),
        (lambda axes: reached.plot(axes=axes), 1),
    ):
        alone = draw(None)
        mine = Figure()
        axes = np.atleast_1d(mine.subplots(1, count))
        assert draw(axes if count > 1 else axes[0]) is mine
        assert [drawn(one) for one in axes] == [drawn(one) for one in alone.axes]
        assert len(mine.axes) == count
        assert axes[-1].get_legend() is not None or not alone.legends
        mine.savefig("/dev/null", format="png")
        assert draw(None) is not mine


def test_axes_that_do_not_fit_and_plots_that_are_not_there_are_told(study, counsel):
    with pytest.raises(ValueError, match="2 panels: give as many axes, not 1"):
        study.plot("shapes", axes=Figure().subplots())
    with pytest.raises(ValueError, match="the study has drag, shapes"):
        study.plot("sahpes")
    with pytest.raises(ValueError, match="the kinds are decision, front"):
        counsel.plot("fornt")


def test_what_is_reached_is_told_shown_and_written(reached, tmp_path):
    assert reached.table["reached"].tolist() == [True, True, False]
    assert repr(reached).splitlines() == reached.sentences
    assert reached.sentences[3:] == [reached.applied]
    assert "safety factor" in repr(reached)
    assert {path.name for path in reached.report(tmp_path)} == {"steps.csv", "targets.csv", "reach.png", "reach.svg"}
    again = prb3r.solve(ARM, tmp_path / "steps.csv").query("disk == 14")
    assert again["x_m"].to_numpy() == pytest.approx(reached.table["x_m"].to_numpy(), abs=1e-9)


def test_effects_are_offered_by_name_and_know_their_kind():
    classes = {getattr(prb3r.effects, name) for name in prb3r.effects.__all__}
    assert classes - {prb3r.effects.MomentTerm} == set(EFFECT_KINDS.values())
    weak = prb3r.effects.WeakenedPlate(plate=4, factor=0.8)
    manipulator = prb3r.load_manipulator(ARM).replace("effect", [weak])
    assert manipulator.effect == [weak]
    assert 'kind = "weakened_plate"' in manipulator.to_toml()
    with pytest.raises(ValueError, match="factor"):
        prb3r.effects.WeakenedPlate(plate=4)
