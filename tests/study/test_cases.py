"""Factors become cases: counts, order, zips, samples, ratios, structural levels; and everything that can be wrong."""

import copy
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from prb3r.errors import SpecError
from prb3r.study.plan import plan_study
from prb3r.study.resolve import resolve
from prb3r.study.spec import load_study

ROOT = Path(__file__).parents[2]
BASE = {
    "name": "trial",
    "title": "A trial",
    "manipulator": str(ROOT / "studies/manipulators/two-segment.toml"),
    "step": [{"cable_1_n": 10.0}],
    "metric": [{"kind": "position"}],
}
MU = {"name": "mu", "path": "friction.coefficient", "values": [0.1]}
COUPLING = {"kind": "coupling", "cable": "1", "disk": 7}


def setting(path, value):
    return {"name": "level", "level": [{"label": "a", "set": {path: value}}]}


@pytest.fixture
def study(tmp_path):
    def write(**changes) -> Path:
        path = tmp_path / "trial.toml"
        path.write_text(tomli_w.dumps(copy.deepcopy(BASE) | changes))
        return path

    return write


def cases(path):
    return resolve(path, load_study(path))


def refusal(path) -> str:
    with pytest.raises(SpecError) as error:
        plan_study(path)
    return str(error.value)


def test_grid_crosses_and_zip_pairs(study):
    factors = [
        {"name": "mu", "path": "friction.coefficient", "values": [0.1, 0.2]},
        {"name": "cable_1_n", "path": "step.1.cable_1_n", "values": [10, 20, 30], "zip": "load"},
        {"name": "cable_4_n", "path": "step.1.cable_4_n", "linspace": {"from": 1, "to": 3, "count": 3}, "zip": "load"},
    ]
    found = cases(study(factor=factors))
    assert [tuple(case.factors.values()) for case in found] == [
        (mu, pull, other) for mu in (0.1, 0.2) for pull, other in ((10, 1), (20, 2), (30, 3))
    ]
    assert found[4].settings["step"] == [{"cable_1_n": 20, "cable_4_n": 2}]
    assert found[4].manipulator().friction.coefficient == 0.2


def test_ratio_multiplies_and_levels_replace(study):
    thickness = ["segment.1.thickness_m", "segment.2.thickness_m"]
    levels = [{"label": "whole"}, {"label": "cut", "broken": ["2"], "set": {"cable.3.offset_m": -0.02}}]
    factors = [{"name": "ratio", "ratio": thickness, "values": [2.0]}, {"name": "case", "level": levels}]
    whole, cut = cases(study(factor=factors))
    assert whole.manipulator().segment[0].thickness_m == pytest.approx(0.0016)
    assert whole.settings["broken"] == []
    assert cut.settings["broken"] == ["2"]
    assert cut.manipulator().cable[2].offset_m == -0.02


@pytest.mark.parametrize("method", ["sobol", "latin-hypercube"])
def test_samples_fill_the_ranges_evenly_and_repeat_with_the_seed(study, method):
    factors = [
        {"name": "mu", "path": "friction.coefficient", "range": {"low": 0.0, "high": 0.4}},
        {"name": "thickness_m", "path": "segment.1.thickness_m", "range": {"low": 5e-4, "high": 1e-3}},
    ]
    path = study(factor=factors, sampling={"method": method, "count": 64}, seed=3)
    points = np.array([list(case.factors.values()) for case in cases(path)])
    again = np.array([list(case.factors.values()) for case in cases(path)])
    other = np.array(
        [list(c.factors.values()) for c in cases(study(factor=factors, sampling={"method": method, "count": 64}))]
    )
    assert np.array_equal(points, again)
    assert not np.array_equal(points, other)
    for column, low, high in ((0, 0.0, 0.4), (1, 5e-4, 1e-3)):
        cells = np.floor((points[:, column] - low) / (high - low) * 8).astype(int)
        assert np.array_equal(np.bincount(cells, minlength=8), np.full(8, 8))


def test_all_problems_are_told_at_once_with_their_lines(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(
        'name = "bad"\ntitle = "Bad"\nmanipulator = "m.toml"\nstats = "final"\n\n[[factor]]\nname = "mu"\n'
        'path = "friction.coefficient"\nvalues = [0.1, nan]\n\n[[metric]]\nkind = "positon"\n\n'
        '[[plot]]\nname = "p"\nkind = "lines"\n'
    )
    text = refusal(path)
    assert f"{path}:4 stats: unknown key 'stats'; did you mean 'states'?" in text
    assert f"{path}:9 factor.mu.values.2: nan is not allowed" in text
    assert "did you mean 'position'?" in text
    assert "plot.p: 'x' is missing" in text
    assert "plot.p: 'y' is missing" in text
    assert len(text.splitlines()) == 5


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"factor": [{"name": "h", "path": "segment.1.thicknes_m", "values": [1.0]}]}, "must end in '_m'"),
        ({"factor": [{"name": "h_m", "path": "segment.1.thicknes_m", "values": [1.0]}]}, "did you mean 'thickness_m'"),
        ({"factor": [{"name": "h_m", "path": "segment.3.thickness_m", "values": [1.0]}]}, "not a number from 1 to 2"),
        ({"factor": [{"name": "h_m", "path": "segment.1.thickness_m", "values": [-1.0]}]}, "greater than 0, not -1"),
        ({"factor": [{"name": "d_m", "path": "cable.5.offset_m", "values": [0.1]}]}, "there is no cable '5'"),
        ({"factor": [{"name": "a_m", "path": "segment.1.clamp_m", "values": [0.02]}]}, "leave nothing of a plate"),
        ({"factor": [{"name": "end", "path": "cable.1.ends_at_segment", "values": [3]}]}, "ends at segment 3"),
        ({"factor": [{"name": "b", "level": [{"label": "x", "broken": ["7"]}]}]}, "there is no cable '7' to break"),
        ({"factor": [{"name": "mu", "path": "friction.coefficient", "values": []}]}, "at least 1"),
        ({"step": [{"cable_9_n": 1.0}]}, "unknown column"),
        ({"step": [{"cable_1_n": -5.0}]}, "a cable cannot push"),
        ({"step": []}, "no loads"),
        ({"manipulator": "nowhere.toml"}, "no such file"),
        ({"metric": [{"kind": "position"}, {"kind": "position"}]}, "two metrics give the column 'tip_x_m'"),
        ({"fit": [{"x": "mu", "y": "tip_x_m"}]}, "there is no column 'mu'"),
        ({"factor": [MU | {"name": "case_id"}]}, "factor.case_id: is the name of a column of every study"),
        ({"factor": [MU | {"name": "outcome"}]}, "factor.outcome: is the name of a column of every study"),
        ({"factor": [MU | {"name": "tip_x_m"}]}, "factor.tip_x_m: is the name of a column of a metric"),
        ({"factor": [setting("step", 5)]}, "step must be a list"),
        ({"factor": [setting("step", [5])]}, "step.1 must be a table of loads"),
        ({"factor": [setting("initial", 5)]}, "initial must be a table of loads"),
        ({"factor": [setting("broken", 5)]}, "broken must be a list"),
        ({"factor": [setting("broken", [[1]])]}, "there is no cable [1] to break"),
        ({"factor": [setting("step.1.cable_1_n", "much")]}, "holds 'much', not a number"),
        ({"set": {"step": 5}}, "step must be a list"),
        ({"set": {"segment": 5}}, "manipulator segment must be a list, not 5"),
        (
            {"factor": [{"name": "f_n", "path": "step.1.cable_1_n", "values": [int("9" * 400)]}]},
            "write a finite number",
        ),
        ({"metric": [{"kind": "position", "disk": 99}]}, "metric position: there is no disk 99, the tip is disk 14"),
        ({"metric": [{"kind": "changing-point", "cable": "9"}]}, "metric changing-point: there is no cable '9'"),
        ({"metric": [COUPLING | {"disk": 20}]}, "metric coupling: there is no disk 20"),
        ({"metric": [{"kind": "workspace"}]}, "metric workspace: needs tension_n, as there is no cloud of loads"),
        ({"step": [], "cloud": {"count": 16, "tension_n": {"1": 5.0}}}, "metric position: needs load steps"),
        ({"state_disks": [0, 15]}, "state_disks: there is no disk 15, the tip is disk 14"),
    ],
)
def test_what_is_wrong_is_said(study, changes, said):
    assert said in refusal(study(**changes))


def test_an_astronomic_grid_is_refused_without_being_made(study):
    factors = [
        {"name": f"f{k}", "path": "friction.coefficient", "linspace": {"from": 0, "to": 1, "count": 1000}}
        for k in range(4)
    ]
    assert "1e+12 cases" in refusal(study(factor=factors))


def test_a_step_keeps_what_it_does_not_name(study):
    from prb3r.study.loads import steps_frame

    frame = steps_frame({"initial": {"cable_3_kg": 5.0}, "step": [{"cable_1_n": 2.0, "slip_3": 1}, {"cable_3_n": 1.0}]})
    assert frame.to_dict("records") == [
        {"cable_3_kg": 5.0, "cable_1_n": 0.0, "slip_3": -1.0, "cable_3_n": 0.0},
        {"cable_3_kg": 5.0, "cable_1_n": 2.0, "slip_3": 1.0, "cable_3_n": 0.0},
        {"cable_3_kg": 0.0, "cable_1_n": 2.0, "slip_3": 1.0, "cable_3_n": 1.0},
    ]


def test_the_shipped_manipulator_is_the_papers():
    data = tomllib.loads((ROOT / "studies/manipulators/two-segment.toml").read_text())
    assert data["segment"][0] == data["segment"][1]
    assert 187e9 * data["segment"][0]["width_m"] * data["segment"][0]["thickness_m"] ** 3 / 12 == pytest.approx(
        187e9 * 1.28e-12
    )  # Table 3


@pytest.mark.parametrize("changes", [{}, {"cloud": {"count": 16, "tension_n": {"1": 50.0}}, "step": []}])
def test_workspaces_that_would_be_empty_are_refused(study, changes):
    if changes:
        changes = changes | {"states": "final", "metric": [{"kind": "workspace"}]}
    path = study(plot=[{"name": "reach", "kind": "workspace"}], **changes)
    assert "plot.reach: a plot of a workspace needs [cloud] and states = 'path'" in refusal(path)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        (
            {"kind": "shapes", "y": ["tip_y_m"]},
            "y: unknown key 'y'; kind 'shapes' takes name, caption, where, by, panel, note, style, reference",
        ),
        ({"kind": "bars", "x": "mu", "y": ["tip_y_m"], "panel": "mu"}, "unknown key 'panel'; kind 'bars' takes name, "),
        ({"kind": "bars", "x": "mu", "y": []}, "plot.p.y: must be a list of at least 1"),
        ({"kind": "lines", "x": "mu", "y": ["tip_y_m"], "log_x": True}, "did you mean 'log_y'?"),
        ({"kind": "shape"}, "unknown kind 'shape'; did you mean 'shapes'?"),
        ({"kind": "pie"}, "unknown kind 'pie'; valid: bars, lines, loops, path, shapes, workspace"),
        ({}, "plot.p: 'kind' is missing"),
        ({"kind": "lines", "x": "tip_x_m", "y": ["tip_y_m", "tip_angle_rad"]}, "columns of several units (m, rad)"),
    ],
)
def test_a_plot_takes_the_fields_of_its_kind_alone(study, fields, said):
    assert said in refusal(study(plot=[{"name": "p", **fields}]))


def test_a_second_plot_of_one_name_is_told_at_its_line(study):
    plot = {"name": "reach", "kind": "lines", "x": "tip_x_m", "y": ["tip_y_m"]}
    path = study(plot=[plot, plot])
    number = [k for k, line in enumerate(path.read_text().split("\n"), 1) if "reach" in line][1]
    assert f"{path}:{number} plot.reach.name: two plots are named 'reach'" in refusal(path)
