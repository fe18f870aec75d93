import io
import itertools
from dataclasses import replace
from types import SimpleNamespace

import matplotlib
import numpy as np
import pandas as pd
import pytest
from cycler import cycler
from present.frames import OWN_FIELDS, SCENE, cases_of, plot_of, states_of, texts

from prb3r.present import rc, style
from prb3r.present.figure_files import save_figure
from prb3r.present.legends import SHORT_HANDLE, legend_shape
from prb3r.present.study.figures import study_figure
from prb3r.present.study.front import legend_names
from prb3r.present.study.sheet import Scene

SHIFTS = {"x": "cable_2_n", "y": ["tip_shift_m"]}


@pytest.fixture
def coupling() -> pd.DataFrame:
    rows = list(itertools.product([0.0, 0.3], ["thin", "thick"], np.linspace(0, 100, 6)))
    mu, design, tension = zip(*rows, strict=True)
    table = cases_of(friction_coefficient=mu, design=design, cable_2_n=tension)
    return table.assign(tip_shift_m=0.05 + 0.0002 * table["cable_2_n"], changing_point_n=60.7)


def curves(axes) -> list:
    """Drawn lines with a mark or a dash, without crosses of failed cases."""
    return [line for line in axes.lines if line.get_marker() != "x" and len(line.get_xdata()) > 2]


def test_every_group_is_a_line_and_axes_say_units(coupling):
    plot = plot_of(name="a", kind="lines", by="design", panel="friction_coefficient", **SHIFTS)
    figure = study_figure(plot, coupling, None, SCENE)
    assert [len(curves(axes)) for axes in figure.axes] == [2, 2]
    assert figure.axes[0].get_ylabel() == "Tip shift (mm)"
    assert all(axes.get_xlabel() == "Cable 2 (N)" for axes in figure.axes)
    assert curves(figure.axes[0])[0].get_ydata()[0] == pytest.approx(50.0)
    assert texts(figure) == ["thin", "thick"]


def test_groups_differ_without_colour():
    looks = list(style.looks([f"design {i}" for i in range(8)]).values())
    for one, other in itertools.combinations(looks, 2):
        assert one.marker != other.marker
        assert one.line != other.line
        assert one.hatch != other.hatch
    weights = np.array([0.299, 0.587, 0.114])
    lightness = [weights @ matplotlib.colors.to_rgb(look.colour) for look in looks]
    assert np.abs(np.diff(lightness)).min() > 0.08
    ramp = [weights @ matplotlib.colors.to_rgb(look.colour) for look in style.looks([0.1, 0.2, 0.3, 0.4, 0.5]).values()]
    assert np.diff(ramp).min() > 0.08


def test_what_the_user_says_of_style_stands_and_all_else_is_ours(coupling):
    plot = plot_of(name="a", kind="lines", by="design", **SHIFTS)
    with matplotlib.rc_context({"axes.facecolor": "#ffeedd", "font.size": 12, "axes.prop_cycle": cycler(color="rg")}):
        (axes,) = study_figure(plot, coupling, None, SCENE).axes
    assert matplotlib.colors.to_hex(axes.get_facecolor()) == "#ffeedd"
    assert axes.yaxis.label.get_size() == 12
    assert [line.get_color() for line in curves(axes)] == ["r", "g"]
    assert not axes.spines["top"].get_visible()
    (axes,) = study_figure(plot, coupling, None, SCENE).axes
    assert axes.yaxis.label.get_size() == 7.5
    assert [line.get_color() for line in curves(axes)] == list(style.PALETTE[:2])


def test_style_is_a_second_distinction(coupling):
    plot = plot_of(name="a", kind="lines", **SHIFTS, by="design", style="friction_coefficient", y_unit="cm")
    drawn = curves(study_figure(plot, coupling, None, SCENE).axes[0])
    assert len({(line.get_color(), line.get_linestyle()) for line in drawn}) == 4


def test_failed_cases_are_crosses(coupling):
    coupling.loc[3, ["outcome", "tip_shift_m"]] = ["no equilibrium", np.nan]
    coupling.loc[5, "outcome"] = "unstable"
    plot = plot_of(name="a", kind="lines", by="design", **SHIFTS)
    figure = study_figure(plot, coupling, None, SCENE)
    crosses = {float(x) for line in figure.axes[0].lines if line.get_marker() == "x" for x in line.get_xdata()}
    assert crosses == {60.0, 100.0}
    assert {"no equilibrium (1 case, at the lower edge: without a value)", "unstable (1 case)"} <= set(texts(figure))


def test_words_stand_beside_each_other_on_the_axis(coupling):
    plot = plot_of(name="a", kind="lines", x="design", y=["tip_shift_m"], by="friction_coefficient", note="reason")
    coupling["reason"] = "all pulled, $"
    (axes,) = study_figure(plot, coupling, None, SCENE).axes
    assert [label.get_text() for label in axes.get_xticklabels()] == ["thin", "thick"]
    assert axes.get_title(loc="left") == r"all pulled, \$"
    marks = [line for line in axes.lines if line.get_marker() not in ("x", "None")]
    assert len(marks) == 2
    middle = 1e3 * coupling["tip_shift_m"].median()
    for line in marks:
        assert line.get_xydata() == pytest.approx(np.array([[0, middle], [1, middle]]))


def test_a_logarithmic_axis_of_less_than_a_decade_has_ticks(coupling):
    coupling["tip_shift_m"] = 0.004 + 0.0002 * coupling["cable_2_n"]  # 4 to 24 mm
    figure = study_figure(plot_of(name="a", kind="lines", log_y=True, by="design", **SHIFTS), coupling, None, SCENE)
    figure.canvas.draw()
    low, high = figure.axes[0].get_ylim()
    ticks = [
        t.get_text()
        for y, t in zip(figure.axes[0].get_yticks(), figure.axes[0].get_yticklabels(), strict=True)
        if low <= y <= high
    ]
    assert ticks == ["5", "10", "20"]


def test_tensions_over_steps_are_those_that_are_applied():
    pulls = np.array([[10.0, 0, 0, 0], [20.0, 0, 0, 0], [15.0, 0, 0, 0]])
    states = states_of(pulls, 0).assign(step=lambda t: t["case_id"] + 1, case_id=0)
    states.loc[states["disk"] > 0, "cable_1_n"] *= 0.9
    figure = study_figure(plot_of(name="a", kind="lines", x="step", y=["cable_1_n"]), cases_of(mu=[0.3]), states, SCENE)
    assert figure.axes[0].lines[0].get_xydata().tolist() == [[1, 10], [2, 20], [3, 15]]
    assert texts(figure) == []


def test_fit_vertical_and_published_points_are_named(coupling):
    law = {"slope": 2e-4, "intercept": 0.05, "largest_deviation": 1.1e-3, "where": {"design": "thin"}}
    scene = Scene(SCENE.manipulator, SCENE.quantities, ({"x": "cable_2_n", "y": "tip_shift_m", **law},))
    plot = plot_of(
        name="a", kind="lines", **SHIFTS, by="design", fit=True, vertical="changing_point_n",
        mark=[{"x": 50.0, "y": 0.06, "label": "published"}],
    )  # fmt: skip
    figure = study_figure(plot, coupling, None, scene)
    assert {"changing point, 60.7 N", "published"} <= set(texts(figure))
    assert [text.get_text() for text in figure.axes[0].texts] == ["thin: 0.2 mm per N, within 1.1 mm"]
    point = next(line for line in figure.axes[0].lines if line.get_markerfacecolor() == "white")
    assert (point.get_xdata()[0], point.get_ydata()[0]) == pytest.approx((50.0, 60.0))


@pytest.mark.parametrize(("shares", "below"), [([0.0, 0.0], False), ([0.0, 0.2], False), ([-0.1, 0.2], True)])
def test_bars_begin_at_zero_also_where_all_of_them_are_zero(shares, below):
    cases = cases_of(ratio=[1.0, 2.0], lost_share=shares)
    (panel,) = study_figure(plot_of(name="b", kind="bars", x="ratio", y=["lost_share"]), cases, None, SCENE).axes
    assert (panel.get_ylim()[0] < 0) == below
    assert below or panel.get_ylim()[0] == 0


def test_bars_have_a_panel_and_a_unit_for_each_metric():
    cases = cases_of(design=["a", "a", "b", "b"], ratio=[1.0, 2.0, 1.0, 2.0], area_m2=[0.3, 0.2, 0.1, np.nan])
    cases = cases.assign(peak_stress_pa=[5e8, 4e8, 3e8, 2e8])
    cases.loc[3, "outcome"] = "no equilibrium"
    figure = study_figure(
        plot_of(name="b", kind="bars", x="ratio", y=["area_m2", "peak_stress_pa"], by="design"), cases, None, SCENE
    )
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["Area (m²)", "Peak stress (MPa)"]
    assert [len(axes.patches) for axes in figure.axes] == [4, 4]
    assert figure.axes[1].patches[0].get_height() == pytest.approx(500.0)
    assert any(line.get_marker() == "x" for line in figure.axes[0].lines)


def test_bars_of_a_comparison_leave_out_the_cases_that_others_are_compared_with():
    """Their 0 says nothing, and would be in the median; a bar of their own they keep."""
    cases = cases_of(order=["first", "first", "last", "last"], mu=[0.1, 0.3, 0.1, 0.3], shift_m=[0.0, 0.0, 2.0, 4.0])
    scene = replace(SCENE, compared={"shift_m": {"order": "first"}})
    over = plot_of(name="b", kind="bars", x="mu", y=["shift_m"], y_unit="m")
    assert heights(study_figure(over, cases, None, scene)) == [2.0, 4.0]
    apart = plot_of(name="b", kind="bars", x="order", y=["shift_m"], y_unit="m")
    figure = study_figure(apart, cases, None, scene)
    assert heights(figure) == [0.0, 3.0]
    assert "from least to greatest; bar: median" in texts(figure)
    assert "from least to greatest; bar: median" not in texts(study_figure(over, cases, None, scene))


def heights(figure):
    return [patch.get_height() for patch in figure.axes[0].patches]


def test_loops_are_drawn_over_the_applied_tension_with_a_row_for_each_disk():
    pulls = np.concatenate([np.linspace(10, 40, 4), np.linspace(30, 10, 3), np.linspace(20, 40, 3)])
    states = pd.concat(
        states_of(pulls[:, None] * [1.0, 0, 0, 0], 0).assign(step=lambda t: t["case_id"], case_id=case)
        for case in (0, 1)
    )
    cases = cases_of(friction_coefficient=[0.1, 0.3], tip_y_m=0.1, disk7_y_m=0.1)
    plot = plot_of(name="a", kind="loops", x="cable_1_n", y=["tip_y_m", "disk7_y_m"], panel="friction_coefficient")
    figure = study_figure(plot, cases, states, SCENE)
    assert len(figure.axes) == 4
    assert [axes.get_ylabel() for axes in figure.axes] == ["Tip y (mm)", "", "Disk 7 y (mm)", ""]
    assert [axes.get_xlabel() for axes in figure.axes] == ["", "", "Cable 1 (N)", "Cable 1 (N)"]
    loop = figure.axes[2].lines[1]
    assert loop.get_xdata().tolist() == pulls[3:].tolist()
    disk = states[(states["case_id"] == 0) & (states["disk"] == 7)]
    assert loop.get_ydata() == pytest.approx(1e3 * disk["y_m"].to_numpy()[3:])


def test_saved_files_are_whole_and_reproducible(tmp_path, coupling):
    plot = plot_of(name="a", kind="lines", by="design", **SHIFTS)
    first = [path.read_bytes() for path in save_figure(study_figure(plot, coupling, None, SCENE), tmp_path, "a")]
    again = [path.read_bytes() for path in save_figure(study_figure(plot, coupling, None, SCENE), tmp_path, "a")]
    assert first == again
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "a.svg"]


def test_files_hold_what_matplotlib_saves_and_figures_stay_as_they_were(coupling, tmp_path):
    plot = plot_of(name="a", kind="lines", by="design", **SHIFTS)
    figure, other = (study_figure(plot, coupling, None, SCENE) for _ in range(2))
    was = figure.canvas, figure.dpi, figure.get_layout_engine()
    png, svg = (path.read_bytes() for path in save_figure(figure, tmp_path, "a"))
    assert (figure.canvas, figure.dpi, figure.get_layout_engine()) == was
    with rc.in_use():
        for written, kind, unsaid in ((png, "png", {"Software": None}), (svg, "svg", {"Date": None, "Creator": None})):
            saved = io.BytesIO()
            other.savefig(saved, format=kind, dpi=200, metadata=unsaid)
            assert written == saved.getvalue()
            other.set_layout_engine("none")


def test_designs_with_long_names_are_called_by_their_places_and_the_others_by_their_names():
    long = [f"Segment 1 thickness {k} mm, Segment 2 thickness {k + 1} mm, Plates 6" for k in range(3)]
    ranked = SimpleNamespace(designs=long, ranking=[2, 0])
    assert legend_names(ranked, [2, 0, 1]) == ["best", "second", long[1]]
    short = SimpleNamespace(designs=["Thickness 1 mm", "Thickness 2 mm"], ranking=[1, 0])
    assert legend_names(short, [1, 0]) == ["Thickness 2 mm", "1 mm"]


def test_lines_of_a_legend_are_short_where_that_saves_a_third_row():
    """Six models of the plates in a column of a paper, 85 mm; two of them have room."""
    names = ["elastica", "PRB 3R (Chen)", "PRB 3R (Su)", "PRB 1R", "PRB 1R (tip force)", "constant curvature"]
    usual = matplotlib.rcParams["legend.handlelength"]
    with rc.in_use():
        assert legend_shape(names, 85.0) == (3, SHORT_HANDLE)
        assert legend_shape(names[:2], 85.0) == (2, matplotlib.rcParams["legend.handlelength"])
        assert matplotlib.rcParams["legend.handlelength"] > SHORT_HANDLE
    assert matplotlib.rcParams["legend.handlelength"] == usual


def test_legend_fits_the_figure(coupling):
    plot = plot_of(name="a", kind="lines", by="design", **SHIFTS)
    coupling["design"] = coupling["design"] + " plates at the base, cables sound"
    figure = study_figure(plot, coupling, None, SCENE)
    figure.savefig(io.BytesIO())
    assert figure.legends[0].get_window_extent().width < figure.bbox.width


def test_a_legend_says_no_word_twice_and_takes_two_rows_of_a_column_of_a_paper(coupling):
    coupling = coupling.assign(presliding_m=np.tile([3e-5, 1e-3, 5e-3], 8), disk7_shift_m=coupling["tip_shift_m"] / 2)
    both = {"x": "cable_2_n", "y": ["tip_shift_m", "disk7_shift_m"]}
    figure = study_figure(plot_of(name="a", kind="lines", by="presliding_m", **both), coupling, None, SCENE)
    figure.savefig(io.BytesIO())
    assert texts(figure) == ["Presliding 0.03 mm", "1 mm", "5 mm", "Tip", "Disk 7"]
    assert figure.axes[0].get_ylabel() == "Shift (mm)"
    (legend,) = figure.legends
    assert len({round(text.get_window_extent().y0) for text in legend.get_texts()}) == 2
    assert legend.get_window_extent().width < figure.bbox.width


def test_unknown_column_is_named(coupling):
    with pytest.raises(ValueError, match="no column colour"):
        study_figure(plot_of(name="a", kind="lines", by="colour", **SHIFTS), coupling, None, SCENE)


def test_selecting_no_case_is_an_error(coupling):
    plot = plot_of(name="a", kind="lines", **SHIFTS, where={"design": "none such"})
    with pytest.raises(ValueError, match="no case has"):
        study_figure(plot, coupling, None, SCENE)


@pytest.mark.parametrize("kind", ["lines", "shapes", "workspace", "bars", "loops"])
def test_studies_in_which_everything_failed_still_have_figures(kind, tmp_path):
    cases = cases_of(cable_1_n=[20.0, 60.0]).assign(outcome="crashed", tip_y_m=np.nan, limit_n=np.nan)
    states = states_of([[20.0, 0, 0, 0]])[:0]
    fields = OWN_FIELDS[kind] | ({"vertical": "limit_n"} if kind == "lines" else {})
    figure = study_figure(plot_of(name="a", kind=kind, by="cable_1_n", **fields), cases, states, SCENE)
    assert any("crashed" in text for text in texts(figure))
    assert len(save_figure(figure, tmp_path, "a")) == 2


def test_samples_are_marks_and_not_joined(coupling):
    scene = Scene(SCENE.manipulator, SCENE.quantities, sampled=frozenset({"cable_2_n"}))
    plot = plot_of(name="a", kind="lines", by="design", **SHIFTS)
    (axes,) = study_figure(plot, coupling, None, scene).axes
    clouds = [line for line in axes.lines if len(line.get_xdata()) > 2]
    assert [len(line.get_xdata()) for line in clouds] == [12, 12]  # every case by itself, not medians
    assert {line.get_linestyle() for line in clouds} == {"None"}


@pytest.mark.parametrize(
    ("symbol", "text"),
    [
        ("μ", "$μ$"),
        ("T_1", "$T_1$"),
        ("T_up", r"$T_{\mathrm{up}}$"),
        ("F_12y", r"$F_{\mathrm{12y}}$"),
        ("T_a$b", r"T a\$b"),
        ("T_left 2", "T left 2"),
    ],
)
def test_the_index_of_a_symbol_is_the_whole_of_it(symbol, text):
    assert style.symbol_text(symbol) == text
