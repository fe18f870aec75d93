"""Sweeps and the loops they make: laws of dry friction seen from outside."""

import copy
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from prb3r.errors import SpecError
from prb3r.model.solve import solve
from prb3r.study.cases import Family
from prb3r.study.loads import steps_frame
from prb3r.study.measure import measured_columns
from prb3r.study.metrics.response import Loop, last_loop
from prb3r.study.plan import plan_study
from prb3r.study.resolve import resolve
from prb3r.study.spec import load_study
from prb3r.study.work import solve_cases

ROOT = Path(__file__).parents[2]
STUDY = {
    "name": "trial",
    "title": "A trial",
    "manipulator": str(ROOT / "studies/manipulators/two-segment.toml"),
    "sweep": {"column": "cable_1_n", "turns": [40.0, 10.0, 40.0], "count": 6},
}
LEVER, RIGIDITY = 0.02, 0.24
ONE_PLATE = {
    "name": "one plate",
    "youngs_modulus_pa": 1e11,
    "model": "elastica",
    "disk": {"thickness_m": 0.004},
    "segment": [{"plates": 1, "length_m": 0.03, "clamp_m": 0.008, "bending_stiffness_n_m2": RIGIDITY}],
    "cable": [{"name": "1", "offset_m": LEVER, "ends_at_segment": 1}],
}


def solved_row(settings, metric):
    """A single case solved, and its row."""
    family = Family(np.zeros(1, int), settings)
    manipulator = family.manipulator()
    solved = solve_cases(family, manipulator, manipulator.chain())
    columns = measured_columns(family.numbers, solved, (metric,))
    return solved, {name: values[0] for name, values in columns.items()}


def loop(manipulator, turns, count, share=0.05, **friction):
    """A case and its row, of a manipulator with friction along a sweep of cable 1."""
    data = copy.deepcopy(manipulator) | {"friction": {"direction": "history"} | friction}
    sweep = {"column": "cable_1_n", "turns": list(turns), "count": count}
    loads = {"broken": [], "initial": {}, "step": [], "sweep": sweep, "cloud": {}, "reach": {}}
    solved, row = solved_row({"manipulator": data} | loads, Loop(kind="loop", cable="1", share=share))
    assert row["outcome"] == "converged", row["reason"]
    return solved, row


def refusal(tmp_path, **changes):
    path = tmp_path / "trial.toml"
    path.write_text(tomli_w.dumps(STUDY | changes))
    with pytest.raises(SpecError) as error:
        plan_study(path)
    return str(error.value)


def test_a_sweep_goes_on_from_the_steps_before_it_in_equal_parts():
    sweep = {"column": "cable_1_n", "turns": [4.0, 1.0], "count": 2}
    frame = steps_frame({"initial": {}, "step": [{"cable_1_n": 2.0, "cable_3_n": 5.0}], "sweep": sweep})
    assert frame["cable_1_n"].tolist() == [2.0, 3.0, 4.0, 2.5, 1.0]
    assert (frame["cable_3_n"] == 5.0).all()
    alone = steps_frame({"initial": {}, "step": [], "sweep": sweep})
    assert alone["cable_1_n"].tolist() == [2.0, 4.0, 2.5, 1.0]


def test_a_factor_may_set_parts_of_a_sweep(tmp_path):
    path = tmp_path / "trial.toml"
    path.write_text(tomli_w.dumps(STUDY | {"factor": [{"name": "count", "path": "sweep.count", "values": [2, 3]}]}))
    cases = resolve(path, load_study(path))
    assert [len(steps_frame(case.settings)) for case in cases] == [6, 9]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sweep": {"column": "cable_1_n", "turns": [], "count": 3}}, "at least 1"),
        ({"sweep": {"column": "cable_1_n", "turns": [5.0, 5.0], "count": 3}}, "turns must differ"),
        ({"sweep": {"column": "cable_9_n", "turns": [5.0], "count": 3}}, "unknown column"),
        ({"sweep": {"column": "cable_1_n", "turns": [-5.0], "count": 3}}, "a cable cannot push"),
        ({"step": [{"cable_1_kg": 1.0}]}, "the sweep of cable_1_n goes on from cable_1_kg"),
        ({"cloud": {"count": 16, "tension_n": {"1": 5.0}}}, "cloud excludes initial, step and sweep"),
        ({"factor": [{"name": "count", "path": "sweep.count", "values": [0.5]}]}, "sweep count"),
        (
            {
                "plot": [{"name": "p", "kind": "loops", "x": "cable_1_n", "y": ["tip_y_m"]}],
                "metric": [{"kind": "position"}],
            },
            "a plot of loops needs states = 'path'",
        ),
    ],
)
def test_what_is_wrong_with_a_sweep_is_said(changes, said, tmp_path):
    assert said in refusal(tmp_path, **changes)


def test_a_plot_of_loops_needs_the_states_it_draws(tmp_path):
    plot = {"name": "p", "kind": "loops", "x": "step", "y": ["tip_angle_rad", "disk7_y_m", "reason"]}
    metrics = [{"kind": "position"}, {"kind": "position", "disk": 7}]
    said = refusal(tmp_path, plot=[plot], metric=metrics, states="path", state_disks=[0, 14])
    assert "x must be the tension of a cable" in said
    assert "needs disks 0 and 7 in state_disks" in said
    assert "y must be positions of disks" in said


def test_the_last_loop_is_the_last_fall_and_rise():
    assert last_loop(np.array([1.0, 3, 2, 1, 2, 2, 3])) == (1, 3, 6)
    assert last_loop(np.array([3.0, 3, 1, 2])) == (0, 2, 3)
    assert last_loop(np.array([1.0, 2, 3])) == (0, 0, 2)


def test_a_rise_alone_is_no_loop():
    settings = {
        "manipulator": ONE_PLATE,
        "broken": [],
        "initial": {},
        "step": [{"cable_1_n": 1.0}],
        "cloud": {},
        "reach": {},
    }
    _, row = solved_row(settings, Loop(kind="loop", cable="1"))
    assert np.isnan(row["tip_loop_area_n_m"])
    assert "does not fall and rise" in row["reason of tip_loop_area_n_m"]


def test_without_friction_loops_have_no_area_and_a_linear_plate_follows_at_once():
    solved, row = loop(ONE_PLATE, (2.0, 1.0, 2.0), 8, coefficient=0.0)
    assert row["tip_loop_area_n_m"] < 1e-12
    assert row["tip_loop_opening_m"] < 1e-12
    assert row["tip_dead_band_n"] == pytest.approx(0.05 * 1.0, rel=1e-3)
    assert solved.states.y[-1, -1] > 0


def test_the_dead_band_of_one_plate_is_the_capstans():
    """The span keeps its tension while the base hole goes over from rubbing one way to the other:
    T0 e^(-mu phi) = T e^(mu phi).  That takes twice the presliding length of travel, 0.04 % of the way back.
    """
    mu, top = 0.8, 200.0
    solved, row = loop(ONE_PLATE, (top, 40.0, top), 640, share=0.001, coefficient=mu, presliding_m=1e-6)
    states, at = solved.states, 639
    axis = np.exp(1j * states.angle[at, 1])
    arrival = states.x[at, 1] + 1j * states.y[at, 1] + (-0.002 + 1j * LEVER) * axis
    turning = np.angle(arrival - 1j * LEVER)
    assert turning > 0.1
    assert row["tip_dead_band_n"] == pytest.approx(top * (1 - np.exp(-2 * mu * turning)), rel=0.005)
    held = (solved.loads.tension[at:1280, 0] > top * np.exp(-2 * mu * turning)).sum()
    assert held > 100
    assert states.angle[at : at + held, 1] == pytest.approx(states.angle[at, 1], rel=5e-4)


def test_loops_do_not_depend_on_how_finely_or_how_fast_they_are_gone_through():
    manipulator = plan_study(ROOT / "studies/hysteresis.toml").cases[0].settings["manipulator"]
    coarse, fine = (
        loop(manipulator, (50.0, 10.0, 50.0), count, coefficient=0.3, presliding_m=3e-4)[0] for count in (4, 20)
    )
    assert fine.loads.tension[4::5] == pytest.approx(coarse.loads.tension)
    assert fine.states.y[4::5] == pytest.approx(coarse.states.y, abs=2e-6)


def test_a_loop_gone_through_twice_is_the_same_loop():
    turns = (30.0, 10.0, 30.0, 10.0, 30.0)
    solved, _ = loop(ONE_PLATE, turns, 5, coefficient=0.5, presliding_m=1e-4)
    y = solved.states.y[:, -1]
    assert y[14:] == pytest.approx(y[4:15], abs=1e-8)


def test_every_case_of_a_family_begins_with_its_own_travel():
    """Cases that are solved together are each as that table of steps alone, in which cables slip from rest."""
    sticks = {"kind": "breakaway_friction", "excess": 0.8, "decay_n": 20.0}
    data = copy.deepcopy(ONE_PLATE) | {"friction": {"coefficient": 0.3}, "effect": [sticks]}
    pulls = np.array([[30.0, 60.0], [10.0, 25.0], [50.0, 55.0]])
    steps = [{"cable_1_n": pull} for pull in pulls.T]
    settings = {"manipulator": data, "broken": [], "initial": {}, "step": steps, "sweep": {}, "cloud": {}, "reach": {}}
    family = Family(np.arange(3), settings)
    manipulator = family.manipulator()
    solved = solve_cases(family, manipulator, manipulator.chain())
    for case, pull in enumerate(pulls):
        alone = solve(manipulator, {"sequence": "a", "step": [1, 2], "cable_1_n": pull})
        np.testing.assert_allclose(solved.states.y[2 * case : 2 * case + 2].ravel(), alone["y_m"], rtol=0, atol=1e-12)


LOOPS = {"metric": [{"kind": "loop", "cable": "1"}, {"kind": "position"}], "states": "path"}
LOOP_PLOT = {"plot": [{"name": "loops", "kind": "loops", "x": "cable_1_n", "y": ["tip_y_m"]}]}
BACK = [{"cable_1_n": 40.0}, {"cable_1_n": 10.0, "slip_1": 1.0}, {"cable_1_n": 40.0, "slip_1": -1.0}]
DISSIPATES = {"kind": "hysteretic_plate", "slipping_share": 0.2, "yield_per_m": 1.0}
BREAKS_AWAY = {"kind": "breakaway_friction", "excess": 0.5, "decay_n": 5.0}


def test_a_loop_that_declared_slip_keeps_closed_is_refused_with_the_line_that_opens_it(tmp_path):
    """At equal tension and equal slip there is one state: every opening would be 0."""
    said = refusal(tmp_path, **LOOPS | LOOP_PLOT)
    assert "metric.1: no case opens a loop: slip is declared" in said
    assert "plot.loops: no case opens a loop" in said
    assert 'set = { "friction.direction" = "history" }' in said


@pytest.mark.parametrize(
    "changes",
    [
        {"set": {"friction.direction": "history"}},
        {"set": {"effect": [DISSIPATES]}},
        {"set": {"effect": [BREAKS_AWAY]}},
        {"sweep": None, "step": BACK},
        {"sweep": None, "step": [row | {"tip_y_n": y} for row, y in zip(BACK, (0.0, 1.0, 2.0), strict=True)]},
        {"factor": [{"name": "slip", "path": "friction.direction", "values": ["declared", "history"]}]},
        {"sweep": None, "step": [{"cable_1_n": 40.0}]},
    ],
    ids=["history", "plates", "breakaway", "slips", "another load", "one of two", "no loop"],
)
def test_loops_that_something_opens_are_not_refused(tmp_path, changes):
    spec = {name: value for name, value in (STUDY | LOOPS | LOOP_PLOT | changes).items() if value is not None}
    path = tmp_path / "trial.toml"
    path.write_text(tomli_w.dumps(spec))
    plan_study(path)
