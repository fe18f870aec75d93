"""Paths of targets in a study."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import prb3r
from prb3r.errors import SpecError
from prb3r.inverse import search
from prb3r.present.study.publish import publish
from prb3r.study.metrics.reach import Follow
from prb3r.study.plan import plan_study
from prb3r.study.run import Options, Workers, solve_study
from prb3r.study.work import solve_cases

MANIPULATOR = Path(__file__).parents[2] / "studies" / "manipulators" / "two-segment.toml"
STUDY = f"""
name = "way"
title = "Way"
manipulator = "{MANIPULATOR}"
states = "path"
[reach]
disk = 7
most_n = 60
REST
[[metric]]
kind = "follow"
[[plot]]
name = "path"
kind = "path"
"""
TURN = "target = [{ angle_rad = 0.1 }, { angle_rad = 0.3 }]\ncount = 2"
BREAK = """
[[factor]]
name = "broken"
[[factor.level]]
label = "none"
[[factor.level]]
label = "3 and 4"
broken = ["3", "4"]
[[factor.level]]
label = "1 and 2"
broken = ["1", "2"]
"""


def test_a_study_follows_targets_as_reach_does_and_says_where_it_cannot(tmp_path):
    (tmp_path / "way.toml").write_text(STUDY.replace("REST", TURN + BREAK))
    result = solve_study(tmp_path / "way.toml", Options(tmp_path / "out", Workers(jobs=1)))
    cases = result.cases.set_index("broken")
    assert cases["reached_share"].tolist() == [1.0, 1.0, 0.0]
    assert np.isnan(cases.loc["none", "first_missed"])
    assert cases.loc["1 and 2", "first_missed"] == 1
    assert cases.loc["1 and 2", "most_turned_off_rad"] >= 0.3  # nothing pulls to that side
    states = result.states()
    angle = states[(states["case_id"] == 0) & (states["disk"] == 7)].set_index("step")["angle_rad"]
    assert angle.to_dict() == pytest.approx({1: 0.1, 2: 0.2, 3: 0.3}, abs=1e-6)

    wanted = pd.DataFrame({"angle_rad": [0.1, 0.2, 0.3]})
    alone = prb3r.reach(MANIPULATOR, disk=7, path=wanted, most_n=60)
    assert cases.loc["none", "highest_sum_n"] == pytest.approx(alone.table["total_n"].max(), rel=1e-6)

    publish(result)
    summary = (result.folder / "summary.md").read_text()
    assert "All 3 targets reached" in summary
    assert "0 of 3 targets reached; the first that is not is number 1 (angle 0.1 rad)" in summary
    assert (result.folder / "path.svg").exists()


def test_a_target_counts_only_with_friction_that_goes_with_the_travel(tmp_path, monkeypatch):
    """Figures tell from the states what is reached: where no such pull is found, the disk stays."""
    found = search.pull_with_slip
    drawn_in = lambda pull, *rest: found(pull, *rest) if (pull.slip == -1).all() else None  # noqa: E731
    monkeypatch.setattr(search, "pull_with_slip", drawn_in)
    back = STUDY.replace("REST", "target = [{ angle_rad = 0.3 }, { angle_rad = 0.1 }]")
    (tmp_path / "way.toml").write_text('broken = ["3", "4"]\n' + back)
    (family,) = plan_study(tmp_path / "way.toml").cases.families
    manipulator = family.manipulator()
    solved = solve_cases(family, manipulator, manipulator.chain(family.settings["broken"]))
    assert list(Follow(kind="follow").values(solved))[:2] == [0.5, 2]
    assert solved.states.angle[:, 7] == pytest.approx([0.3, 0.3], abs=1e-6)


def test_targets_may_stand_in_a_table(tmp_path):
    (tmp_path / "targets.csv").write_text("x_m,y_m\n0.2,0.05\n0.2,\n")
    (tmp_path / "way.toml").write_text(STUDY.replace("REST", 'path = "targets.csv"'))
    (case,) = plan_study(tmp_path / "way.toml").cases
    assert case.settings["reach"]["target"] == [{"x_m": 0.2, "y_m": 0.05}, {"x_m": 0.2}]
    (tmp_path / "targets.csv").write_text("x_mm\n200\n")
    with pytest.raises(SpecError, match="unknown column 'x_mm'"):
        plan_study(tmp_path / "way.toml")


@pytest.mark.parametrize(
    ("rest", "what"),
    [
        ("", "give one of path and target"),
        ("target = [{}]", "say where to"),
        ("target = [{ x_m = 0.2 }, { y_m = 0.1 }]\ncount = 3", "between targets that ask for different coordinates"),
        (TURN + "\n[[step]]\ncable_1_n = 3", "reach excludes initial, step, sweep and cloud"),
        (TURN + '\n[[factor]]\nname = "disk"\npath = "reach.disk"\nvalues = [99]', "there is no disk 99"),
        (TURN + '\n[[metric]]\nkind = "workspace"', "needs tension_n"),
        ('path = "absent.csv"', "no such file"),
    ],
)
def test_a_wrong_path_is_refused(tmp_path, rest, what):
    (tmp_path / "way.toml").write_text(STUDY.replace("REST", rest))
    with pytest.raises(SpecError) as error:
        plan_study(tmp_path / "way.toml")
    assert what in str(error.value)


def test_following_needs_a_path(tmp_path):
    (tmp_path / "way.toml").write_text(
        STUDY.partition("[reach]")[0] + '[[step]]\ncable_1_n = 5\n[[metric]]\nkind = "follow"'
    )
    with pytest.raises(SpecError, match=r"metric follow: needs \[reach\]"):
        plan_study(tmp_path / "way.toml")
