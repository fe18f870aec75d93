"""Every kind of plot that a study file may name is drawn."""

import io
from typing import get_args

import numpy as np
import pytest
from present.frames import OWN_FIELDS, SCENE, cases_of, plot_of, states_of

from prb3r.present import style
from prb3r.present.study.figures import DRAWN_BY, study_figure
from prb3r.present.study.sheet import Scene
from prb3r.study.plots import AnyPlot

KINDS = get_args(get_args(AnyPlot)[0])


def test_every_kind_of_plot_has_a_drawing_of_its_own():
    assert set(DRAWN_BY) == set(KINDS)
    assert len(set(DRAWN_BY.values())) == len(KINDS)


def test_nothing_is_in_the_legend_of_a_path_that_is_not_drawn():
    """All targets are missed: none is drawn as reached."""
    states = states_of(np.array([[0.0, 0, 0, 0], [20.0, 0, 0, 0]])).assign(step=lambda t: t["case_id"] + 1, case_id=0)
    labels = []
    for at in (1.0, 0.0):
        tips = states[states["disk"] == 14]
        targets = [{"x_m": x + at, "y_m": y} for x, y in zip(tips["x_m"], tips["y_m"], strict=True)]
        scene = Scene(SCENE.manipulator, reach=lambda case, to=targets: {"disk": "tip", "target": to})
        cases = cases_of(cable_1_n=[20.0], tip_y_m=[0.0])
        figure = study_figure(plot_of(name="a", kind="path", **OWN_FIELDS["path"]), cases, states, scene)
        labels.append([text.get_text() for text in figure.legends[0].get_texts()])
    assert "target" not in labels[0]
    assert "not reached, and the way to it" in labels[0]
    assert "target" in labels[1]
    assert "not reached, and the way to it" not in labels[1]


def test_titles_of_panels_to_scale_stand_a_millimetre_below_the_edge():
    pulls = np.linspace(0, 40, 6)[:, None] * [1.0, 0, 0, 0]
    cases = cases_of(case_id=range(6), cable_1_n=pulls[:, 0])
    figure = study_figure(plot_of(name="s", kind="shapes", panel="cable_1_n"), cases, states_of(pulls), SCENE)
    figure.savefig(io.BytesIO())
    tops = [axes._left_title.get_window_extent().y1 for axes in figure.axes]
    assert max(tops) < figure.bbox.y1 - style.MM * figure.dpi


@pytest.mark.parametrize("kind", [get_args(kind.model_fields["kind"].annotation)[0] for kind in KINDS])
def test_every_kind_of_plot_shows_what_is_in_the_tables(kind):
    pulls = np.concatenate([np.linspace(0, 40, 5), np.linspace(30, 10, 3), np.linspace(20, 40, 3)])
    states = states_of(pulls[:, None] * [1.0, 0, 0, 0]).assign(step=lambda table: table["case_id"], case_id=0)
    tips = states[states["disk"] == 14]
    cases = cases_of(cable_1_n=[40.0], tip_y_m=tips["y_m"].to_numpy()[-1:])
    targets = [{"x_m": x, "y_m": y} for x, y in zip(tips["x_m"], tips["y_m"], strict=True)]
    scene = Scene(SCENE.manipulator, reach=lambda case: {"disk": "tip", "target": targets})
    (axes,) = study_figure(plot_of(name="a", kind=kind, **OWN_FIELDS[kind]), cases, states, scene).axes
    height = 1e3 * tips["y_m"].iloc[-1]
    assert axes.dataLim.y0 <= height <= axes.dataLim.y1 + 1e-9
    assert "mm" in axes.get_ylabel() + axes.get_title("left")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "plot",
    [
        {"kind": "lines", "x": "cable_1_n", "y": ["safety_factor"]},
        {"kind": "bars", "x": "cable_1_n", "y": ["safety_factor"]},
    ],
)
def test_a_value_without_bound_is_a_triangle_at_the_upper_edge_with_a_word_on_it(plot):
    """An arm at rest has no stress: its safety factor is infinite, and no axis reaches so far."""
    cases = cases_of(case_id=range(3), cable_1_n=[0.0, 20.0, 40.0], safety_factor=[np.inf, 6.0, 3.0])
    figure = study_figure(plot_of(name="a", **plot), cases, None, SCENE)
    figure.savefig(io.BytesIO())
    (axes,) = figure.axes
    triangles = [line for line in axes.lines if line.get_marker() == "^" and line.get_markerfacecolor() == "white"]
    assert [len(line.get_xdata()) for line in triangles] == [1]
    assert triangles[0].get_transform() == axes.get_xaxis_transform()
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "at the upper edge: without bound (1 case)" in words
    assert axes.get_ylim()[1] < 10
