"""Figures of shapes and of where they reach."""

from dataclasses import replace

import matplotlib
import numpy as np
import pandas as pd
import pytest
import scipy
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.contour import QuadContourSet
from matplotlib.image import imread
from present.frames import MANIPULATOR, SCENE, cases_of, plot_of, polygons, states_of, texts

from prb3r.present import style
from prb3r.present.figure_files import save_figure
from prb3r.present.spots import spots_of
from prb3r.present.study.figures import study_figure
from prb3r.present.study.shapes import body, straight
from prb3r.present.study.workspace import occupancy


def test_disks_and_holes_are_drawn_where_they_are():
    state = states_of([[60.0, 0, 0, 0]])
    drawn = body(MANIPULATOR, state)
    np.testing.assert_allclose(drawn.disks.mean(1), state[["x_m", "y_m"]], atol=1e-12)
    first, outer = drawn.cables[1], drawn.cables[0]
    assert (len(first), len(outer)) == (2 * 7 + 2, 2 * 14 + 2)
    np.testing.assert_allclose(outer[1], [0.0, 0.0255], atol=1e-12)
    centre = state[["x_m", "y_m"]].to_numpy()
    distance = np.hypot(*(outer[2::2] - centre[1:]).T)
    np.testing.assert_allclose(distance, np.hypot(0.0255, 0.002), rtol=1e-9)
    assert np.all(np.diff(drawn.tensions[0]) <= 0)
    assert drawn.tensions[0][0] == 60.0


def test_plates_are_as_long_as_they_are():
    bent = body(MANIPULATOR, states_of([[100.0, 0, 0, 0]]))
    for drawn in (bent, straight(MANIPULATOR)):
        length = np.hypot(*np.moveaxis(np.diff(drawn.plates, axis=1), -1, 0)).sum(1)
        np.testing.assert_allclose(length, 0.030, rtol=2e-3)


def test_shapes_show_every_case_to_scale():
    cases, states = cases_of(cable_1_n=[20.0, 60.0, 100.0]), states_of([[20.0, 0, 0, 0], [60.0, 0, 0, 0]])
    cases.loc[2, "outcome"] = "no equilibrium"
    figure = study_figure(plot_of(name="s", kind="shapes", by="cable_1_n"), cases, states, SCENE)
    axes = figure.axes[0]
    disks = [one for one in axes.collections if isinstance(one, PolyCollection)]
    assert [len(one.get_paths()) for one in disks] == [15, 15]
    assert any(isinstance(one, LineCollection) for one in axes.collections)
    assert axes.get_aspect() == 1.0
    assert axes.get_ylabel() == "$y$ (mm)"
    assert any("no equilibrium" in text for text in texts(figure))


def test_of_manipulators_that_coincide_the_second_leaves_the_first_to_be_seen():
    """Backbones of 14 plates: at 60 and 60.1 N one within the other, at 60 and 100 N apart and alike."""

    def widths(*tensions):
        states = states_of([[tension, 0, 0, 0] for tension in tensions])
        figure = study_figure(
            plot_of(name="s", kind="shapes", by="cable_1_n"), cases_of(cable_1_n=[*tensions]), states, SCENE
        )
        lines = [one for one in figure.axes[0].collections if isinstance(one, LineCollection)]
        return [float(one.get_linewidths()[0]) for one in lines if len(one.get_paths()) == 14]

    under, over = widths(60.0, 60.1)
    assert over < 0.5 * under
    assert widths(60.0, 100.0) == [under, under]


def test_shapes_need_all_disks():
    states = states_of([[20.0, 0, 0, 0]])
    with pytest.raises(ValueError, match="all its disks, 0 to 14"):
        study_figure(plot_of(name="s", kind="shapes"), cases_of(cable_1_n=[20.0]), states[states["disk"] > 6], SCENE)


def test_occupancy_has_the_area_of_its_region():
    rng = np.random.default_rng(3)
    radius, angle = np.sqrt(rng.uniform(0.5, 1, 40_000)), rng.uniform(0, 2 * np.pi, 40_000)
    x, y, _, inside = occupancy(np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1))
    area = (inside > 0.5).sum() * (x[1] - x[0]) * (y[1] - y[0])
    assert area == pytest.approx(np.pi / 2, rel=0.05)


def test_every_point_of_a_workspace_is_within_its_outline_however_thin_it_gets():
    """A disc with a tail one cell wide, of a fiftieth of the points, straight or aslant, as where cables are broken."""
    rng = np.random.default_rng(5)
    radius, angle = np.sqrt(rng.uniform(0, 1, 20_000)), rng.uniform(0, 2 * np.pi, 20_000)
    disc = np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)
    for slope in (0.0, 0.6, 1.0):
        tail = np.linspace(0.5, 2.5, 400)
        points = np.concatenate([disc, np.stack([tail, slope * tail], 1)])
        *_, filled, inside = occupancy(points)
        assert (inside[filled > 0] > 0.5).all()
        assert scipy.ndimage.label(inside > 0.5)[1] == 1  # in one piece
        states = pd.DataFrame(
            {"case_id": 0, "step": range(20_400), "disk": 14, "x_m": points[:, 0], "y_m": points[:, 1]}
        )
        figure = study_figure(plot_of(name="w", kind="workspace"), cases_of(design=["a"]), states, SCENE)
        (outline,) = [one for one in figure.axes[0].collections if isinstance(one, QuadContourSet) and not one.filled]
        assert 1e-3 * outline.get_paths()[0].vertices[:, 0].max() > 2.5


def test_workspaces_are_told_apart_and_small(tmp_path):
    rng = np.random.default_rng(2)
    tips = [
        pd.DataFrame({"case_id": case, "step": range(20_000), "disk": 14, "x_m": x, "y_m": y})
        for case in range(3)
        for x, y in [rng.uniform([[0.1 * case], [-0.3]], [[0.4], [0.3]], (2, 20_000))]
    ]
    states = pd.concat(tips)
    states.iloc[:7, 3:] = np.nan
    cases = cases_of(design=["a", "b", "c"])
    overlaid = study_figure(plot_of(name="w", kind="workspace", by="design"), cases, states, SCENE)
    panels = study_figure(plot_of(name="w", kind="workspace", panel="design"), cases, states, SCENE)
    assert "a: 7 of 20,000 loads without equilibrium" in texts(overlaid)
    outlines = [one for one in overlaid.axes[0].collections if isinstance(one, QuadContourSet) and not one.filled]
    assert len({str(one.get_linestyle()) for one in outlines}) == 3
    assert len({patch.get_hatch() for patch in overlaid.legends[0].get_patches()}) == 3
    assert len(panels.axes) == 3
    for name, figure in (("overlaid", overlaid), ("panels", panels)):
        assert save_figure(figure, tmp_path, name)[1].stat().st_size < 400_000


def test_workspaces_of_other_numbers_of_disks_and_thin_ones_are_drawn():
    """Of a line nothing can be filled: its points are seen; a region needs none, and each arm has its own tip."""
    angle = np.linspace(-1, 1, 2000)
    line = pd.DataFrame({"case_id": 0, "step": range(2000), "disk": 5, "x_m": np.cos(angle), "y_m": np.sin(angle)})
    square = np.random.default_rng(4).uniform(-1, 1, (2, 2000))
    wide = pd.DataFrame({"case_id": 1, "step": range(2000), "disk": 14, "x_m": square[0], "y_m": square[1]})
    states = pd.concat([line, wide])
    figure = study_figure(
        plot_of(name="w", kind="workspace", panel="design"), cases_of(design=["a", "b"]), states, SCENE
    )
    seen = [sum(len(mark.get_xydata()) for mark in axes.lines if mark.get_marker() == ".") for axes in figure.axes]
    assert seen[0] > 1500
    assert seen[1] == 0
    assert texts(figure) == []


def test_a_reference_stands_behind_every_panel_and_titles_carry_a_note():
    states = pd.concat(states_of([[20.0 * case, 0, 0, 0]], case) for case in range(3))
    cases = cases_of(effect=["none", "this", "that"], tip_shift_m=[0.0, 0.01234, 0.2])
    given = {"panel": "effect", "note": "tip_shift_m", "reference": {"effect": "none"}}
    figure = study_figure(plot_of(name="a", kind="shapes", **given), cases, states, SCENE)
    assert [axes.get_title("left") for axes in figure.axes] == ["this, 12 mm", "that, 200 mm"]
    assert [len(polygons(axes)) for axes in figure.axes] == [2, 2]
    assert texts(figure) == ["none"]


def test_a_reference_that_each_panel_has_stands_in_its_own_panel_alone():
    """One of the two is the reference, and it differs from panel to panel."""
    states = pd.concat(states_of([[20.0 * case, 0, 0, 0]], case) for case in range(4))
    cases = cases_of(effect=["none", "none", "this", "this"], payload=["light", "heavy"] * 2)
    given = {"panel": "payload", "reference": {"effect": "none"}}
    figure = study_figure(plot_of(name="a", kind="shapes", **given), cases, states, SCENE)
    assert [len(polygons(axes)) for axes in figure.axes] == [2, 2]
    ghosts = [np.max(polygons(axes)[0].get_paths()[-1].vertices[:, 1]) for axes in figure.axes]
    assert ghosts[0] != ghosts[1]


def test_of_many_shapes_some_are_drawn_and_that_is_said():
    count = 200
    states = pd.concat([states_of(np.zeros((1, 4)), first_case=number) for number in range(count)])
    plot = plot_of(name="a", kind="shapes")
    figure = study_figure(plot, cases_of(tip_shift_m=np.zeros(count)), states, SCENE)
    assert sum(len(part.get_paths()) == 15 for part in polygons(figure.axes[0])) == 48
    assert texts(figure) == ["48 of 200 drawn"]


def test_factors_that_a_plot_does_not_name_are_told_apart_or_said_to_look_alike():
    cases = pd.DataFrame([(t, m, b) for t in (20.0, 60.0) for m in (0.1, 0.3) for b in (1.0, 2.0)])
    cases = cases_of(cable_1_n=cases[0], friction_coefficient=cases[1], other=cases[2])
    states = pd.concat(states_of([[pull, 0, 0, 0]], case) for case, pull in enumerate(cases["cable_1_n"]))
    scene = replace(SCENE, factors=("cable_1_n", "friction_coefficient", "other"))
    figure = study_figure(plot_of(name="s", kind="shapes"), cases, states, scene)
    assert texts(figure) == ["$T_1$ = 20 N", "60 N", "$μ$ = 0.1", "0.3", "alike whatever the other"]
    colours = {tuple(part.get_edgecolor()[0]) for part in polygons(figure.axes[0])}
    assert len(colours) == 2
    named = study_figure(plot_of(name="s", kind="shapes", panel="friction_coefficient"), cases, states, scene)
    assert texts(named) == ["$T_1$ = 20 N", "60 N", "Other 1", "2"]


def test_a_legend_of_very_many_values_names_some_from_the_first_to_the_last():
    count = 200
    states = pd.concat([states_of(np.zeros((1, 4)), first_case=number) for number in range(count)])
    plot = plot_of(name="a", kind="shapes", by="load_n")
    figure = study_figure(plot, cases_of(load_n=np.arange(count, dtype=float)), states, SCENE)
    named = texts(figure)
    assert len(named) < 12
    assert (named[0].split()[-2], named[-3].split()[-2]) == ("0", "199")
    assert named[-2:] == ["and 193 more values", "48 of 200 drawn"]


def test_what_can_be_pointed_at_is_where_the_picture_has_it(tmp_path):
    """Pixels at the spots of manipulators have the colours of their marks, whatever moved them as it was saved; of the
    nine at a spot five at least, as matplotlib before 3.11 puts marks a pixel aside."""
    tensions = np.zeros((4, 4))
    tensions[:, 0] = [20, 40, 60, 80]
    states = pd.concat([states_of(tensions[k : k + 1], k) for k in range(4)])
    figure = study_figure(plot_of(name="s", kind="shapes", by="design"), cases_of(design=list("abcd")), states, SCENE)
    save_figure(figure, tmp_path, "s")
    spots, pixels = spots_of(figure), imread(tmp_path / "s.png")
    assert [case for *_, case, _ in spots["points"]] == [0, 1, 2, 3]
    height, width = pixels.shape[:2]
    for (x, y, *_), look in zip(spots["points"], style.looks(list("abcd")).values(), strict=True):
        around = pixels[int(y * height) - 1 : int(y * height) + 2, int(x * width) - 1 : int(x * width) + 2, :3]
        assert np.median(around, (0, 1)) == pytest.approx(matplotlib.colors.to_rgb(look.colour), abs=0.05)
