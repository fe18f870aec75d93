"""Studies of unusual but sensible kinds: what they say is what a solve says, and what makes no sense is refused."""

from pathlib import Path

import numpy as np
import pytest

import prb3r
from prb3r.errors import SpecError
from prb3r.present.study.current import publish_what_changed
from prb3r.runs.store import read_arrow
from prb3r.study.compare import fitted_lines
from prb3r.study.plan import plan_study
from prb3r.study.run import Options, Workers, solve_study

MANIPULATOR = Path(__file__).parents[2] / "studies" / "manipulators" / "two-segment.toml"
HEAD = f'name = "unusual"\ntitle = "Unusual"\nmanipulator = "{MANIPULATOR}"\n'
PATHS = 'states = "path"\n'
HISTORY = 'set = { "friction.direction" = "history" }\n'
THICKNESS = '[[factor]]\nname = "thickness_m"\npath = "segment.1.thickness_m"\nvalues = [8e-4, 1e-3]\n'
POSITION = '[[step]]\ncable_1_n = 30.0\n[[metric]]\nkind = "position"\n'
CLOUD = "[cloud]\ncount = 32\n[cloud.tension_n]\n1 = 20.0\n"
REACH = '[reach]\n[[reach.target]]\nx_m = 0.45\ny_m = 0.05\n[[metric]]\nkind = "follow"\n'


def solved(folder, text):
    (folder / "unusual.toml").write_text(HEAD + text)
    return solve_study(folder / "unusual.toml", Options(folder / "out", Workers(jobs=1)))


def refused(folder, text):
    (folder / "unusual.toml").write_text(HEAD + text)
    with pytest.raises(SpecError) as error:
        plan_study(folder / "unusual.toml")
    return str(error.value)


def test_coupling_along_a_path_goes_on_from_that_path(tmp_path):
    """As much as a solve of the whole path with the further load behind it."""
    sweep = '[sweep]\ncolumn = "cable_1_n"\nturns = [60, 20]\ncount = 4\n'
    metric = '[[metric]]\nkind = "coupling"\ncable = "1"\ndisk = "tip"\nload_n = 1.0\n'
    factor = '[[factor]]\nname = "turn_n"\npath = "sweep.turns.2"\nvalues = [20.0]\n'
    found = solved(tmp_path, PATHS + HISTORY + sweep + factor + metric)
    states = read_arrow(found.folder / "states.parquet").to_pandas()
    pulls = states.query("disk == 0")["cable_1_n"].tolist()
    rig = prb3r.load_manipulator(MANIPULATOR).replace("friction.direction", "history")
    steps = {"sequence": "a", "step": range(1, len(pulls) + 2), "cable_1_n": [*pulls, 21.0]}
    tip = prb3r.solve(
        rig, {name: list(v) if name != "sequence" else ["a"] * (len(pulls) + 1) for name, v in steps.items()}
    )
    tip = tip.query("disk == 14").tail(2)
    moved = np.hypot(*np.diff(tip[["x_m", "y_m"]], axis=0)[0])
    assert found.cases["coupling_m_per_n"].item() == pytest.approx(moved, rel=1e-6)
    assert "needs declared slip" in refused(tmp_path, HISTORY + POSITION + '[[metric]]\nkind = "friction-direction"\n')


def test_what_is_sampled_beside_errors_has_indices_too(tmp_path):
    ranges = '[[factor]]\nname = "mu"\npath = "friction.coefficient"\nrange = { low = 0.1, high = 0.3 }\n'
    errors = '[[factor]]\nname = "arm_error_m"\nadded_to = "cable.1.offset_m"\nnormal = { sd = 1e-4 }\n'
    sampling = '[sampling]\nmethod = "saltelli"\ncount = 8\n'
    for factors, names in ((ranges + errors, {"mu", "arm_error_m"}), (ranges, {"mu"})):
        indices = solved(tmp_path, sampling + factors + POSITION).rigs.indices
        assert set(indices["error"]) == names
        assert indices["total"].notna().all()


def test_numbers_of_loads_and_disks_may_be_factors(tmp_path):
    count = '[[factor]]\nname = "count"\npath = "cloud.count"\nvalues = [16, 32]\n'
    assert (solved(tmp_path, count + CLOUD + '[[metric]]\nkind = "workspace"\n').cases["outcome"] == "converged").all()
    disk = '[[factor]]\nname = "disk"\npath = "reach.disk"\nvalues = [13, 14]\n'
    assert (solved(tmp_path, disk + REACH).cases["outcome"] == "converged").all()


@pytest.mark.parametrize(("loads", "kind"), [(CLOUD + '[[metric]]\nkind = "workspace"\n', "cloud"), (REACH, "reach")])
def test_loads_that_would_not_act_are_refused(tmp_path, loads, kind):
    push = '[[factor]]\nname = "push_n"\npath = "initial.tip_y_n"\nvalues = [0.0, -5.0]\n'
    assert f"{kind} excludes initial" in refused(tmp_path, push + loads)


def test_a_path_without_states_is_drawn_as_missed(tmp_path, monkeypatch):
    """Play is refused as a study is checked, but between the corners of a search no case is."""
    monkeypatch.setattr("prb3r.study.case_problems.lag_problem", lambda chain: "")
    lags = 'set = { effect = [{ kind = "tension_play", play_n = 2.0 }] }\n'
    plot = '[[plot]]\nname = "way"\nkind = "path"\n'
    found = solved(tmp_path, PATHS + lags + THICKNESS + REACH + plot)
    assert (found.cases["outcome"] == "failed").all()
    assert (found.folder / "way.png") in publish_what_changed(found)


def test_a_line_through_a_single_place_is_open(tmp_path):
    fit = '[[fit]]\nx = "thickness_m"\ny = "tip_y_m"\nwhere = { thickness_m = 1e-3 }\n'
    friction = '[[factor]]\nname = "mu"\npath = "friction.coefficient"\nvalues = [0.1, 0.3]\n'
    found = solved(tmp_path, THICKNESS + friction + POSITION + fit)
    (law,) = fitted_lines(found.cases, found.plan.study)
    assert (law["points"], law["slope"]) == (2, None)


def test_a_figure_that_a_study_has_no_more_goes(tmp_path):
    plot = '[[plot]]\nname = "NAME"\nkind = "lines"\nx = "thickness_m"\ny = ["tip_y_m"]\n'
    for name in ("first", "second"):
        found = solved(tmp_path, THICKNESS + POSITION + plot.replace("NAME", name))
        publish_what_changed(found)
    assert {path.stem for path in found.folder.glob("*.png")} == {"second"}


def test_designs_tied_to_their_loads_are_refused(tmp_path):
    tied = (
        THICKNESS
        + 'zip = "a"\n[[factor]]\nname = "cable_1_n"\npath = "step.1.cable_1_n"\nvalues = [20.0, 30.0]\nzip = "a"\n'
    )
    wish = '[[preference]]\nmetric = "tip_y_m"\nbetter = "less"\n'
    assert "no two designs would have a case in common" in refused(tmp_path, tied + POSITION + wish)


def test_a_shift_is_from_the_unloaded_manipulator(tmp_path):
    """Which hangs under its own weight already."""
    heavy = 'set = { effect = [{ kind = "gravity", y_m_s2 = -9.81 }] }\n'
    rest = '[[step]]\ncable_1_n = 0.0\n[[metric]]\nkind = "shift"\ndisk = "tip"\n'
    assert solved(tmp_path, heavy + THICKNESS + rest).cases["tip_shift_m"].to_numpy() == pytest.approx(0.0, abs=1e-9)


def test_a_limit_is_not_told_of_moments_that_follow_the_state(tmp_path):
    law = 'set = { effect = [{ kind = "empirical_moment", terms = [{ of = "bend", coefficient = 6.0 }] }] }\n'
    found = solved(tmp_path, law + THICKNESS + '[[step]]\ntip_x_n = -2.0\n[[metric]]\nkind = "limit-load"\n')
    assert found.cases["outcome"].tolist() == ["failed"] * 2
    assert found.cases["reason"].str.contains("moments that follow the state").all()


def test_what_failed_is_told_by_its_reason(tmp_path):
    """A metric that does not fit the loads is no lack of equilibrium."""
    loads = '[[factor]]\nname = "pull_n"\npath = "step.2.cable_1_n"\nvalues = [10.0, 30.0, 40.0]\n'
    loop = "[[step]]\ncable_1_n = 20.0\n[[step]]\ncable_1_n = 10.0\n[[step]]\ncable_1_n = 20.0\n"
    history = 'set = { "friction.direction" = "history" }\n'
    found = solved(tmp_path, history + loads + loop + '[[metric]]\nkind = "loop"\ncable = "1"\n')
    publish_what_changed(found)
    outcomes = found.cases["outcome"].tolist()
    assert outcomes == ["converged", "failed", "failed"], found.cases["reason"].tolist()
    for name in ("summary.md", "report.html"):
        text = (found.folder / name).read_text()
        assert "3 cases, 2 of them failed" in text
        assert "without a stable equilibrium" not in text


def test_a_metric_that_fails_takes_nothing_from_the_others(tmp_path):
    """A design is judged by the columns that its requirements and preferences name."""
    wishes = (
        '[[requirement]]\nmetric = "tip_y_m"\nat_least = 0.01\n[[preference]]\nmetric = "tip_x_m"\nbetter = "less"\n'
    )
    found = solved(tmp_path, THICKNESS + POSITION + '[[metric]]\nkind = "loop"\ncable = "2"\ndisk = 7\n' + wishes)
    assert found.cases["outcome"].tolist() == ["failed", "failed"]
    publish_what_changed(found)
    summary = (found.folder / "summary.md").read_text()
    assert "Recommendation: Thickness 0.8 mm.** 2 of 2 designs keep every requirement" in summary


@pytest.mark.parametrize(("x", "y"), [("step", "tip_y_m"), ("cable_1_n", "tip_y_m"), ("thickness_m", "cable_1_n")])
def test_what_every_step_would_repeat_is_not_charted_over_steps(tmp_path, x, y):
    plot = f'[[plot]]\nname = "c"\nkind = "lines"\nx = "{x}"\ny = ["{y}"]\n'
    assert "one number for each case" in refused(tmp_path, PATHS + THICKNESS + POSITION + plot)
    (tmp_path / "unusual.toml").write_text(HEAD + THICKNESS + POSITION + plot)
    if x != "step":  # of final states a case has one
        assert plan_study(tmp_path / "unusual.toml")


def test_a_case_may_have_other_cables_than_the_first(tmp_path):
    """Of a cable that a case has not there is no tension; what the others have is what a solve says."""
    lone = '{ name = "1", offset_m = 0.0255, ends_at_segment = 2 }'
    more = f'{lone}, {{ name = "top", offset_m = 0.02, ends_at_segment = 1 }}'
    levels = "".join(
        f'[[factor.level]]\nlabel = "{label}"\n{change}\n'
        for label, change in (
            ("four", ""),
            ("one", f"set = {{ cable = [{lone}] }}"),
            ("two", f"set = {{ cable = [{more}] }}"),
        )
    )
    plot = '[[plot]]\nname = "shapes"\nkind = "shapes"\nby = "cables"\n'
    found = solved(tmp_path, f'[[factor]]\nname = "cables"\n{levels}' + POSITION + plot)
    assert (found.cases["outcome"] == "converged").all(), found.cases["reason"].tolist()
    states = found.states().query("disk == 14").set_index("case_id")
    assert states["cable_4_n"].isna().tolist() == [False, True, True]
    assert states["cable_top_n"].isna().tolist() == [True, True, False]
    alone = prb3r.solve(MANIPULATOR, {"sequence": "a", "step": [1], "cable_1_n": [30.0]})
    assert states["y_m"].tolist() == pytest.approx(alone["y_m"].iloc[-1:].tolist() * 3)
    assert (found.folder / "shapes.png") in publish_what_changed(found)


def test_factors_lead_to_cables_whose_names_hold_dots(tmp_path):
    named = 'set = { "cable.1.name" = "inner.1" }\n'
    factors = "".join(
        f'[[factor]]\nname = "{name}"\npath = "{path}"\nvalues = [{value}]\n'
        for name, path, value in (
            ("offset_m", "cable.inner.1.offset_m", 0.02),
            ("first_n", "step.1.cable_inner.1_n", 30.0),
        )
    )
    step = '[[step]]\n"cable_inner.1_n" = 10.0\n[[metric]]\nkind = "position"\n'
    (found,) = solved(tmp_path, named + factors + step).cases["tip_y_m"]
    rig = prb3r.load_manipulator(MANIPULATOR).replace("cable.1.offset_m", 0.02)
    told = prb3r.solve(rig, {"sequence": "a", "step": [1], "cable_1_n": [30.0]})["y_m"].iloc[-1]
    assert found == pytest.approx(told)
    cloud = '[[factor]]\nname = "most_n"\npath = "cloud.tension_n.inner.1"\nvalues = [5.0]\n'
    loads = '[cloud]\ncount = 32\n[cloud.tension_n]\n"inner.1" = 20.0\n[[metric]]\nkind = "workspace"\n'
    assert solved(tmp_path, named + cloud + loads).cases["workspace_tension_n"].item() <= 5.0
