"""Metrics that solve further loads: what they tell is what a solve of these loads tells."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import prb3r
from prb3r.study.chunk import Chunk
from prb3r.study.plan import plan_study
from prb3r.study.work import solve_cases, solve_chunk

MANIPULATOR = Path(__file__).parents[2] / "studies" / "manipulators" / "two-segment.toml"
NAMES = ["cable_1_n", "cable_3_n"]
LETTING_GO = [(20.0, 5.0), (40.0, 9.0), (25.0, 9.0)]
"""Tensions of cables 1 and 3, N; cable 1 is paid out in the last step."""
EXCESS = {"kind": "breakaway_friction", "excess": 1.5, "decay_n": 10.0}
PLAY = {"kind": "tension_play", "play_n": 3.0}


def rig(effect):
    return prb3r.load_manipulator(MANIPULATOR).replace("effect", [effect])


def measured(folder, effect, metric, last=""):
    """The row of the case that is pulled as `LETTING_GO`, with `last` in the last step, and measured by `metric`."""
    (folder / "rig.toml").write_text(rig(effect).to_toml())
    steps = [f"[[step]]\ncable_1_n = {one}\ncable_3_n = {three}\n" for one, three in LETTING_GO]
    text = 'name = "further"\ntitle = "Further"\nmanipulator = "rig.toml"\n' + "".join(steps) + f"slip_1 = 1\n{last}\n"
    (folder / "further.toml").write_text(f"{text}[[metric]]\n{metric}")
    plan = plan_study(folder / "further.toml")
    columns, _ = solve_chunk(Chunk(plan.cases.families, tuple(plan.study.metric), "none", None, plan.cables))
    return pd.DataFrame(columns).iloc[0]


def tips(effect, pulls, slips):
    """(s, 2) where a solve of steps, pulls and slips of cables 1 and 3, brings the tip, m."""
    table = pd.DataFrame(pulls, columns=NAMES).assign(sequence="a", step=range(len(pulls)), slip_1=slips[0])
    states = prb3r.solve(rig(effect), table.assign(slip_3=slips[1]))
    return states.loc[states["disk"] == 14, ["x_m", "y_m"]].to_numpy()


@pytest.mark.parametrize("effect", [EXCESS, PLAY], ids=["excess", "play"])
def test_coupling_is_what_one_more_newton_does(effect, tmp_path):
    row = measured(tmp_path, effect, 'kind = "coupling"\ncable = "3"\ndisk = "tip"\nload_n = 6.0')
    tip = tips(effect, [*LETTING_GO, (25.0, 15.0)], [[-1, -1, 1, 1], -1])
    assert row["coupling_m_per_n"] == pytest.approx(np.hypot(*(tip[-1] - tip[-2])) / 6.0, rel=1e-6)


def test_compliance_is_what_a_small_force_does(tmp_path):
    row = measured(tmp_path, PLAY, 'kind = "tip-compliance"\nload_n = 0.01')
    table = pd.DataFrame(LETTING_GO + LETTING_GO[-1:], columns=NAMES).assign(slip_1=[-1, -1, 1, 1], step=range(4))
    ends = []
    for column in ("tip_x_n", "tip_y_n"):
        for push in (0.01, -0.01):
            states = prb3r.solve(rig(PLAY), table.assign(sequence="a", **{column: [0, 0, 0, push]}))
            ends.append(states.loc[states["disk"] == 14, ["x_m", "y_m"]].to_numpy()[-1])
    moved = np.array([ends[0] - ends[1], ends[2] - ends[3]]) / 0.02
    assert row["tip_compliance_m_per_n"] == pytest.approx(np.linalg.norm(moved, 2), rel=1e-6)


@pytest.mark.parametrize("initial", ["", "[initial]\ncable_1_n = 10.0\n"], ids=["from rest", "from an initial load"])
def test_the_last_loads_once_more_move_nothing(initial, tmp_path):
    """Under slip that remembers the path and moments that grow with time, of which no more passes."""
    grows = {"kind": "empirical_moment", "terms": [{"of": "time", "coefficient": 1.0}]}
    (tmp_path / "rig.toml").write_text(rig(grows).replace("friction.direction", "history").to_toml())
    steps = "".join(f"[[step]]\ncable_1_n = {one}\ncable_3_n = {three}\n" for one, three in LETTING_GO)
    head = 'name = "further"\ntitle = "Further"\nmanipulator = "rig.toml"\n'
    (tmp_path / "further.toml").write_text(head + initial + steps)
    (family,) = plan_study(tmp_path / "further.toml").cases.families
    manipulator = family.manipulator()
    solved = solve_cases(family, manipulator, manipulator.chain())
    again = solved.continued(solved.last)
    assert again.y[0] == pytest.approx(solved.states.y[-1], abs=1e-9)
    assert np.abs(np.diff(solved.states.y[-2:, -1])) > 1e-3


@pytest.mark.parametrize("effect", [EXCESS, PLAY], ids=["excess", "play"])
def test_reversed_friction_begins_anew(effect, tmp_path):
    row = measured(tmp_path, effect, 'kind = "friction-direction"')
    ends = [tips(effect, LETTING_GO + LETTING_GO[-1:], [[-1, -1, 1, s], [-1, -1, -1, s]])[-1] for s in (-1, 1)]
    assert row["friction_direction_shift_m"] == pytest.approx(np.hypot(*(ends[1] - ends[0])), rel=1e-6)


def test_at_the_changing_point_a_pull_from_rest_leaves_the_segment_straight(tmp_path):
    row = measured(tmp_path, EXCESS, 'kind = "changing-point"\ncable = "3"\nsegment = 1', last="tip_y_n = 2.0")
    table = pd.DataFrame([[25.0, row["changing_point_n"]]], columns=NAMES).assign(sequence="a", step=1, tip_y_n=2.0)
    states = prb3r.solve(rig(EXCESS), table)
    assert states.loc[states["disk"] == 7, "angle_rad"].item() == pytest.approx(0.0, abs=1e-8)


CREEP = {"kind": "plate_relaxation", "share": 0.8, "steps": 0.5}


@pytest.mark.parametrize("most", [800, 2000])
def test_a_drive_tension_is_that_of_one_step_from_rest_however_far_it_is_sought(tmp_path, most):
    """Of plates that creep, too: whatever tensions were tried before, they have relaxed for one step."""
    metric = f'kind = "drive-tension"\ncable = "1"\nsegment = 1\nbend_rad = 0.3\nup_to_n = {most}'
    pull = measured(tmp_path, CREEP, metric)["drive_tension_n"]
    held = prb3r.solve(rig(CREEP), {"sequence": "a", "step": [1], "cable_1_n": [pull]})
    assert abs(held.set_index("disk").loc[7, "angle_rad"]) == pytest.approx(0.3, abs=1e-8)


def test_coupling_of_plates_that_creep_does_not_depend_on_the_load_that_shows_it(tmp_path):
    """Neither the state it is held against nor the one that is pulled harder relaxes any further."""
    metric = 'kind = "coupling"\ncable = "1"\ndisk = 7\nload_n = '
    small, large = (measured(tmp_path, CREEP, metric + load)["coupling_m_per_n"] for load in ("0.00001", "0.1"))
    assert small == pytest.approx(large, rel=5e-3)


def test_where_friction_remembers_compliance_is_the_largest_over_all_directions(tmp_path):
    """Cables that have been drawn in give way less to a push that pays them out: push and pull differ."""
    text = prb3r.load_manipulator(MANIPULATOR).replace("friction.direction", "history").to_toml()
    (tmp_path / "rig.toml").write_text(text)
    pulls = [(20.0, 0.0), (20.0, 30.0)]
    steps = "".join(f"[[step]]\ncable_1_n = {one}\ncable_3_n = {three}\n" for one, three in pulls)
    head = 'name = "further"\ntitle = "Further"\nmanipulator = "rig.toml"\n'
    (tmp_path / "further.toml").write_text(f'{head}{steps}[[metric]]\nkind = "tip-compliance"\nload_n = 0.5\n')
    plan = plan_study(tmp_path / "further.toml")
    columns, _ = solve_chunk(Chunk(plan.cases.families, tuple(plan.study.metric), "none", None, plan.cables))
    told = pd.DataFrame(columns).iloc[0]["tip_compliance_m_per_n"]
    table = pd.DataFrame([*pulls, pulls[-1]], columns=NAMES).assign(sequence="a", step=range(3))
    shifts = []
    for angle in np.radians(np.arange(0, 360, 5)):
        pushed = table.assign(tip_x_n=[0, 0, 0.5 * np.cos(angle)], tip_y_n=[0, 0, 0.5 * np.sin(angle)])
        states = prb3r.solve(tmp_path / "rig.toml", pushed)
        tip = states.loc[states["disk"] == 14, ["x_m", "y_m"]].to_numpy()
        shifts.append(np.hypot(*(tip[-1] - tip[-2])) / 0.5)
    assert told == pytest.approx(max(shifts), rel=0.003)
    assert max(shifts) > 1.01 * shifts[(int(np.argmax(shifts)) + 36) % 72]  # the other way
