"""Effects that few rigs have, against closed forms and other ways to say the same."""

import numpy as np
import pandas as pd
import pytest
from model.one_segment import PLATE, manipulator, same, state

from prb3r.errors import SpecError
from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.solve import solve as solve_steps


def test_a_load_cell_that_reads_wrong_leaves_another_tension():
    """Recorded 40 N: 1.1 x 40 N x (1 + 0.001 x 40) = 45.76 N."""
    wrong = {"kind": "load_cell", "gain": 1.1, "quadratic_per_n": 1e-3}
    assert same(state(manipulator(wrong, mu=0.2)), state(manipulator(mu=0.2), up=45.76))
    of_one = manipulator(wrong | {"cables": ["down"]}, {"kind": "tension_offset", "offset_n": 2.0}, mu=0.2)
    assert same(state(of_one, up=10.0, down=40.0), state(manipulator(mu=0.2), up=12.0, down=47.76))
    twice = manipulator(wrong, {"kind": "load_cell", "gain": 0.5, "quadratic_per_n": 2e-3}, mu=0.2)
    assert same(state(twice), state(manipulator(mu=0.2), up=0.55 * 40 * 1.12))


def test_a_gain_of_all_cables_is_a_softer_plate_unless_dead_loads_act():
    wrong = manipulator({"kind": "load_cell", "gain": 1.25})
    soft = manipulator(segment=[PLATE | {"bending_stiffness_n_m2": 0.24 / 1.25}])
    assert same(state(wrong, 60, 10), state(soft, 60, 10))
    assert not same(state(wrong, 60, 10, tip=(0, 1)), state(soft, 60, 10, tip=(0, 1)), within=1e-4)


def at_steps(*effects, **changes):
    """(4, 5, 3) positions and angles of all disks at two steps of two sequences each, the tip pushed."""
    steps = {"sequence": ["a", "a", "b", "b"], "step": [1, 2, 1, 2], "cable_up_n": [40.0, 40.0, 40.0, 30.0]}
    frame = solve_steps(manipulator(*effects, mu=0.2, **changes), pd.DataFrame(steps | {"tip_y_n": 0.4}))
    return frame[["x_m", "y_m", "angle_rad"]].to_numpy().reshape(4, 5, 3)


def test_the_zero_of_a_load_cell_drifts_from_step_to_step_of_the_table():
    """By 1.5 N a step: the fourth step of the table, recorded as 30 N, pulls with 34.5 N."""
    drift = at_steps({"kind": "tension_drift", "offset_n_per_step": 1.5, "cables": ["up"]})
    for step, offset in enumerate([0.0, 1.5, 3.0, 4.5]):
        beside = at_steps({"kind": "tension_offset", "offset_n": offset, "cables": ["up"]})
        assert drift[step] == pytest.approx(beside[step], abs=1e-9)


def test_a_tension_with_play_follows_late_and_stays_while_it_is_within_it():
    """A play of 5 N: 40 N pull with 35, which stay down to 30; 10 leave 15, and of 50 N 45 arrive.  A sequence begins
    with nothing, and what the other cable carries is as recorded."""
    read, arrives = [40.0, 32, 10, 12, 50, 0, 3], [35.0, 35, 15, 15, 45, 5, 5]
    steps = {
        "sequence": ["a"] * 7 + ["b"] * 2,
        "step": [*range(1, 8), 1, 2],
        "cable_down_n": [0.0, 0, 5, 8, 5, 0, 0, 0, 0],
    }
    lag = {"kind": "tension_play", "play_n": 5.0, "cables": ["up"]}
    late, plain = (
        solve_steps(manipulator(*effects, mu=0.2), pd.DataFrame(steps | {"cable_up_n": pulled}))
        for effects, pulled in (([lag], [*read, 4.0, 12]), ([], [*arrives, 0.0, 7]))
    )
    where = ["x_m", "y_m", "angle_rad"]
    assert late[where].to_numpy() == pytest.approx(plain[where].to_numpy(), abs=1e-9)


def test_a_hanger_pulls_with_the_weights_that_hang_on_it_and_not_where_none_does():
    """Of a cable that is let go to nothing it is taken off too; a load cell under it has its gain for the weights
    alone."""
    read, arrives = (
        {"cable_up_n": [40.0, 0, 10], "cable_down_n": [0.0, 5, 0]},
        {
            "cable_up_n": [47.0, 0, 14],
            "cable_down_n": [0.0, 8.5, 0],
        },
    )
    hangs, reads = {"kind": "hanger", "weight_n": 3.0}, {"kind": "load_cell", "gain": 1.1}
    steps = {"sequence": "a", "step": [1, 2, 3]}
    hung, plain = (
        solve_steps(manipulator(*effects, mu=0.2), pd.DataFrame(steps | pulled))
        for effects, pulled in (([hangs, reads], read), ([], arrives))
    )
    where = ["x_m", "y_m", "angle_rad"]
    assert hung[where].to_numpy() == pytest.approx(plain[where].to_numpy(), abs=1e-9)


def test_plates_soften_from_step_to_step_of_the_table():
    softer = at_steps({"kind": "plate_softening", "share_per_step": 0.02})
    for step, left in enumerate([1.0, 0.98, 0.96, 0.94]):
        plain = at_steps(segment=[PLATE | {"bending_stiffness_n_m2": 0.24 * left}])
        assert softer[step] == pytest.approx(plain[step], abs=1e-9)


def test_plates_creep_from_step_to_step_and_come_back():
    """In the end a steady pull bends 1 / (1 - share) times as far; let go, the arm keeps what has crept, and loses
    it."""
    steps = {"sequence": ["a"] * 4, "step": [1, 2, 3, 4], "time_s": [0.0, 300, 301, 601], "cable_up_n": [2.0, 2, 0, 0]}
    creeps, plain = (
        solve_steps(manipulator(*effects), pd.DataFrame(steps))[["step", "disk", "angle_rad"]].set_index(
            ["step", "disk"]
        )
        for effects in ([{"kind": "plate_relaxation", "share": 0.2, "steps": 0.1}], [])
    )
    tip = [float(table.loc[(step, 4), "angle_rad"]) for step in (1, 2, 3, 4) for table in (creeps, plain)]
    assert tip[2] / tip[3] == pytest.approx(1.25, rel=2e-3)  # large turns of disks aside
    assert 0.01 * tip[2] < tip[4] < 0.25 * tip[2]
    assert tip[6] == pytest.approx(0, abs=1e-3 * tip[2])


def test_friction_that_falls_with_the_load_integrates_to_a_power_of_the_tension():
    """Howell (J. Text. Inst. 44 (1953) T359): dT / d(angle) = -mu T (T / T0)^-p has T^p = T_0^p - p mu T0^p angle.

    Over forty holes the sum over holes is within 0.2 % of the integral; the coefficient at the base alone, 5 % off.
    """
    falls = {"kind": "load_dependent_friction", "exponent": 0.3, "tension_n": 20.0}
    found = state(manipulator(falls, mu=0.3, plates=40), up=40.0)
    turned = found.angle[0, -1] - np.diff(found.angle[0])[-1] / 2  # to the last span, half its plate's bend short
    assert turned > 1.2
    held = 40.0**0.3 - 0.3 * 0.3 * 20.0**0.3 * turned
    assert found.tension[0, -1, 0] == pytest.approx(held ** (1 / 0.3), rel=2e-3)


def test_at_its_own_tension_friction_that_falls_with_the_load_is_the_nominal_one():
    falls = {"kind": "load_dependent_friction", "exponent": 0.5, "tension_n": 40.0}
    base_hole = {"kind": "worn_hole", "disk": 0, "coefficient": 0.4}
    assert same(state(manipulator(falls, base_hole)), state(manipulator(base_hole)))
    assert not same(state(manipulator(falls, base_hole), up=20.0), state(manipulator(base_hole), up=20.0), 1e-5)


@pytest.mark.parametrize("edges", [False, True])
def test_of_every_turn_less_counts_the_larger_it_is(edges):
    """The turns are read off the disks: a span leads from hole to hole, 20 mm off the middle of faces 2 mm away."""
    saturates = {"kind": "wrap_saturation", "saturation_per_rad": 4.0}
    rig = manipulator(saturates, *[{"kind": "edge_wrap"}] * edges, mu=0.3, plates=2)
    found = state(rig, up=400.0)
    place, axis = found.x[0] + 1j * found.y[0], np.exp(1j * found.angle[0])
    spans = (place + axis * (-0.002 + 0.02j))[1:] - (place + axis * (0.002 + 0.02j))[:-1]
    before = np.angle(np.array([1.0, spans[0] / axis[1]]))
    after = np.angle(spans / axis[:-1])
    turns = np.abs([before, after]) if edges else np.abs(after - before)[None]
    assert turns.max() > 0.1
    wrap = np.cumsum((turns / (1 + 4.0 * turns)).sum(0))
    assert found.tension[0, :, 0] == pytest.approx(400.0 * np.exp(-0.3 * wrap), rel=1e-9)
    without = manipulator(saturates | {"saturation_per_rad": 1e9}, mu=0.3, plates=2)
    assert same(state(without, up=400.0), state(manipulator(plates=2), up=400.0))


def test_a_drag_in_the_holes_is_a_force_whatever_the_tension_is():
    """Of 40 N, drawn in over four holes of 0.5 N each, 38 N arrive; paid out, 42 N; of 2.5 N some 0.5 N."""
    drags = manipulator({"kind": "hole_drag", "drag_n": 0.5})
    for pull, within in ((400.0, 1e-6), (40.0, 1e-5), (2.5, 0.02)):
        drawn, paid = (state(drags, up=pull, slip=slip).tension[0, :, 0] for slip in (-1.0, 1.0))
        assert drawn[:3] == pytest.approx(pull - 0.5 * np.arange(1, 4), rel=within)
        assert paid == pytest.approx(pull + 0.5 * np.arange(1, 5), rel=within)
    assert 0.0 < drawn[3] < 0.6


def test_a_drag_in_the_holes_leaves_a_slack_cable_slack():
    """A tension far below the drag falls to 0.4 % at every hole or grows threefold; no tension stays none."""
    drags = manipulator({"kind": "hole_drag", "drag_n": 5.0})
    assert state(drags, up=1e-6, slip=-1.0).tension[0, 0, 0] == pytest.approx(0.3e-6 * np.exp(-1.3 / 0.3))
    assert state(drags, up=1e-9, slip=1.0).tension[0, :, 0] == pytest.approx(1e-9 * 3 ** np.arange(1.0, 5))
    assert not state(drags, up=0.0, slip=1.0).tension.any()


def test_a_drag_in_the_holes_comes_on_top_of_belt_friction():
    """Behind the base hole belt friction leaves a part of 40 N, and the drag of 1 N 39 / 40 of that."""
    turn = {"kind": "worn_hole", "disk": 0, "coefficient": 0.5}
    both = state(manipulator({"kind": "hole_drag", "drag_n": 1.0}, turn, plates=1), up=40.0)
    place = both.x[0] + 1j * both.y[0]
    turned = np.angle(place[1] + (-0.002 + 0.02j) * np.exp(1j * both.angle[0, 1]) - (place[0] + 0.002 + 0.02j))
    assert abs(turned) > 0.005
    assert both.tension[0, 0, 0] == pytest.approx(39.0 * np.exp(-0.5 * abs(turned)), rel=1e-5)


def test_friction_that_grows_with_the_load_has_the_other_sign_of_the_power():
    grows = {"kind": "load_dependent_friction", "exponent": -0.5, "tension_n": 10.0}
    twice = {"kind": "worn_hole", "disk": 0, "coefficient": 0.4}
    nominal = {"kind": "worn_hole", "disk": 0, "coefficient": 0.2}
    assert same(state(manipulator(grows, nominal), up=40.0), state(manipulator(twice), up=40.0))


def coefficient_over(steps, *effects, disks=5):
    """(s,) of every step what the cable's loss says by the capstan law, T = T_0 exp(-mu turns).

    The turns are read off the disks: a span leads from hole to hole, 20 mm off the middle of faces 2 mm away.
    """
    frame = solve_steps(manipulator(*effects, mu=0.3), pd.DataFrame(steps))
    x, y, angle, tension = (
        frame[name].to_numpy().reshape(-1, disks) for name in ("x_m", "y_m", "angle_rad", "cable_up_n")
    )
    place, axis = x + 1j * y, np.exp(1j * angle)
    spans = (place + axis * (-0.002 + 0.02j))[:, 1:] - (place + axis * (0.002 + 0.02j))[:, :-1]
    turns = np.abs(np.angle(spans / np.concatenate([np.ones((len(x), 1)), spans[:, :-1]], 1))).sum(1)
    return np.log(tension[:, 0] / tension[:, -1]) / turns


def test_friction_goes_with_the_logarithm_of_how_fast_a_cable_is_pulled():
    """From 20 to 40 N at 10 N/s and at 0.1 N/s, by hand: 0.3 (1 + 0.05 ln 10) = 0.3345, 0.3 (1 - 0.05 ln 10) = 0.2655.

    The first step of a sequence, after no other, has 0.3; at 10 N/s where the reference is 40 the logarithm is -ln 4.
    """
    steps = {"sequence": list("aabb"), "step": [1, 2, 1, 2], "cable_up_n": [20.0, 40.0] * 2, "time_s": [7, 9, 20, 220]}
    rubs = {"kind": "rate_dependent_friction", "rate": 0.05}
    found = coefficient_over(steps, rubs)
    assert found == pytest.approx([0.3, 0.33453878, 0.3, 0.26546122], rel=1e-6)
    assert coefficient_over(steps) == pytest.approx(0.3, rel=1e-6)
    of_another = coefficient_over(steps, rubs | {"reference_n_per_s": 40.0})
    assert of_another[1] == pytest.approx(0.3 * (1 - 0.05 * 1.38629436), rel=1e-6)


def test_static_friction_grows_alike_with_every_decade_of_dwell():
    """Dieterich (1972): the same for ten times as long, 0.3 x 0.02 x ln 10 = 0.013816; 0.1 N in 0.1 s is 1 N/s."""
    held = {"sequence": "a", "step": [1, 2, 3, 4, 5], "cable_up_n": 40.0, "time_s": [0, 0.1, 1.1, 11.1, 111.1]}
    found = coefficient_over(held, {"kind": "rate_dependent_friction", "rate": -0.02})
    assert found[:2] == pytest.approx(0.3, rel=1e-6)
    assert np.diff(found[1:]) == pytest.approx(0.01381551, rel=1e-5)


def test_no_rate_takes_all_friction_or_more():
    """1 + 0.5 ln(1e-3) is -2.45: a twentieth of 0.3 is left."""
    slow = {"sequence": "a", "step": [1, 2], "cable_up_n": 40.0, "time_s": [0, 100]}
    found = coefficient_over(slow, {"kind": "rate_dependent_friction", "rate": 0.5})
    assert found == pytest.approx([0.3, 0.015], rel=1e-6)


def test_pulleys_take_by_the_rate_too_and_idle_cables_disturb_nothing():
    steps = {"sequence": "a", "step": [1, 2], "cable_up_n": [20.0, 40.0], "time_s": [0, 2]}
    rubs, lossy = {"kind": "rate_dependent_friction", "rate": 0.05}, {"kind": "pulley_friction", "efficiency": 0.9}
    found = solve_steps(manipulator(rubs, lossy), pd.DataFrame(steps))
    takes = 0.9 ** (1 + 0.05 * np.log(10))
    same_pulley = solve_steps(manipulator(lossy | {"efficiency": takes}), pd.DataFrame(steps))
    at = found["step"] == 2
    assert found.loc[at, "y_m"].to_numpy() == pytest.approx(same_pulley.loc[at, "y_m"].to_numpy(), abs=1e-10)


def test_friction_grows_or_falls_from_step_to_step_of_the_table():
    """By a quarter of 0.3 a step through both sequences, and down to a twentieth of it."""
    steps = {"sequence": list("aabb"), "step": [1, 2, 1, 2], "cable_up_n": [40.0, 20, 40, 20]}
    found = coefficient_over(steps, {"kind": "friction_drift", "share_per_step": 0.25})
    assert found == pytest.approx([0.3, 0.375, 0.45, 0.525], rel=1e-6)
    found = coefficient_over(steps, {"kind": "friction_drift", "share_per_step": -0.4})
    assert found == pytest.approx([0.3, 0.18, 0.06, 0.015], rel=1e-6)
    rate = {"kind": "rate_dependent_friction", "rate": 0.05}
    both = coefficient_over(steps | {"time_s": [0, 2, 4, 6]}, {"kind": "friction_drift", "share_per_step": 0.25}, rate)
    assert both[1] == pytest.approx(0.375 * (1 + 0.05 * np.log(10)), rel=1e-6)  # 20 N in 2 s


def test_pulleys_take_more_as_friction_grows():
    steps = {"sequence": "a", "step": [1, 2], "cable_up_n": [20.0, 40.0]}
    grows, lossy = {"kind": "friction_drift", "share_per_step": 0.5}, {"kind": "pulley_friction", "efficiency": 0.9}
    found = solve_steps(manipulator(grows, lossy), pd.DataFrame(steps))
    by_hand = solve_steps(manipulator(lossy | {"efficiency": 0.9**1.5}), pd.DataFrame(steps))
    at = found["step"] == 2
    assert found.loc[at, "y_m"].to_numpy() == pytest.approx(by_hand.loc[at, "y_m"].to_numpy(), abs=1e-10)
    with pytest.raises(ValueError, match="goes with declared slip, not with direction"):
        manipulator(grows, friction={"coefficient": 0.3, "direction": "history"})


def test_friction_by_rates_is_refused_where_nothing_says_them():
    rubs = {"kind": "rate_dependent_friction", "rate": 0.05}
    with pytest.raises(SpecError, match="column 'time_s' is missing: the effect rate_dependent_friction goes by when"):
        solve_steps(manipulator(rubs, mu=0.3), {"sequence": "a", "step": [1, 2], "cable_up_n": 40.0})
    with pytest.raises(ValueError, match="goes with declared slip, not with direction"):
        manipulator(rubs, friction={"coefficient": 0.3, "direction": "history"})
    with pytest.raises(ValueError, match="stands in the place of slip_history"):
        manipulator(rubs, {"kind": "slip_history", "presliding_m": 1e-4}, mu=0.3)


BREAKAWAY = {"kind": "breakaway_friction", "excess": 0.5, "decay_n": 20.0}


def test_static_friction_falls_to_the_kinetic_one_with_the_slip():
    """By hand, 0.3 (1 + 0.5 e^-s/20): s is 10, 40, turned back 20 and 35, turned again 15; the next sequence begins
    anew.  e^-0.5 = 0.60653, e^-2 = 0.13534, e^-1 = 0.36788, e^-1.75 = 0.17377, e^-0.75 = 0.47237."""
    pulls, ways = [10.0, 40.0, 20.0, 5.0, 20.0, 40.0], [-1, -1, 1, 1, -1, -1]
    steps = {"sequence": list("aaaaab"), "step": [1, 2, 3, 4, 5, 1], "cable_up_n": pulls, "slip_up": ways}
    found = np.abs(coefficient_over(steps, BREAKAWAY))
    excess = np.array([0.6065307, 0.1353353, 0.3678794, 0.1737739, 0.4723666, 0.1353353])
    assert found == pytest.approx(0.3 + 0.15 * excess, rel=1e-6)
    assert np.abs(coefficient_over(steps)) == pytest.approx(0.3, rel=1e-6)


def test_a_cable_that_was_slack_begins_anew_and_one_that_is_held_stays_as_far():
    """40 N, nothing, 20 N and held there: e^-2, then e^-1 twice; the same pull, turned the other way: e^0 = 1."""
    steps = {"sequence": "a", "step": [1, 2, 3, 4, 5], "cable_up_n": [40.0, 0, 20, 20, 20], "slip_up": [-1] * 4 + [1]}
    with np.errstate(invalid="ignore"):  # of the slack cable
        found = np.abs(coefficient_over(steps, BREAKAWAY))[[0, 2, 3, 4]]
    assert found == pytest.approx(0.3 + 0.15 * np.array([0.1353353, 0.3678794, 0.3678794, 1.0]), rel=1e-6)


def test_pulleys_hold_by_static_friction_too():
    lossy, steps = {"kind": "pulley_friction", "efficiency": 0.9}, {"sequence": "a", "step": [1], "cable_up_n": [20.0]}
    found = solve_steps(manipulator(BREAKAWAY, lossy), pd.DataFrame(steps))
    takes = 0.9 ** (1 + 0.5 * np.exp(-1))
    same_pulley = solve_steps(manipulator(lossy | {"efficiency": takes}), pd.DataFrame(steps))
    assert found["y_m"].to_numpy() == pytest.approx(same_pulley["y_m"].to_numpy(), abs=1e-10)


def test_static_friction_is_refused_where_slip_follows_the_load_path():
    with pytest.raises(ValueError, match="breakaway_friction: goes with declared slip, not with direction"):
        manipulator(BREAKAWAY, friction={"coefficient": 0.3, "direction": "history"})
    with pytest.raises(ValueError, match="stands in the place of slip_history"):
        manipulator(BREAKAWAY, {"kind": "slip_history", "presliding_m": 1e-4}, mu=0.3)


def test_without_steps_before_a_cable_slips_from_rest():
    """Up to 40 N: 0.3 (1 + 0.5 e^-2) = 0.32030029."""
    assert same(state(manipulator(BREAKAWAY, mu=0.3)), state(manipulator(mu=0.32030029)))


def test_stiffness_that_changes_along_the_arm_does_so_by_the_same_factor_from_plate_to_plate():
    """Four plates, eight times as stiff at the tip: by 2 from one to the next, about the middle of them."""
    steady = {"kind": "stiffness_gradient", "tip_to_base": 8.0}
    steps = [{"kind": "weakened_plate", "plate": k + 1, "factor": 2.0 ** (k - 1.5)} for k in range(4)]
    assert same(state(manipulator(steady, mu=0.2)), state(manipulator(*steps, mu=0.2)))
    assert same(state(manipulator(steady, plates=1)), state(manipulator(plates=1)))


@pytest.mark.parametrize("model", [pytest.param("prb3r", marks=pytest.mark.long), "elastica"])
def test_a_compliant_base_is_a_cantilever_on_a_rotational_spring(model):
    """Roark: w = F L^3 / (3 EI) + c F L^2, and the tip turns by F L^2 / (2 EI) + c F L, to first order in the force."""
    alone = {"plates": 1, "length_m": 0.05, "clamp_m": 0.0, "bending_stiffness_n_m2": 0.24}
    gives = {"kind": "base_compliance", "compliance_rad_per_n_m": 0.03}
    rig = manipulator(gives, model=model, segment=[alone], disk={"thickness_m": 0.0, "mass_kg": 0.05})
    found = state(rig, up=0.0, tip=(0.0, 1e-4))
    exact = 1e-4 if model == "elastica" else 0.02  # the springs are a fit
    assert found.y[0, -1] == pytest.approx(1e-4 * 0.05**3 / (3 * 0.24) + 0.03 * 1e-4 * 0.05**2, rel=exact)
    assert found.angle[0, -1] == pytest.approx(1e-4 * 0.05**2 / (2 * 0.24) + 0.03 * 1e-4 * 0.05, rel=exact)


def test_a_compliant_base_turns_plate_1_by_the_moment_there_whatever_the_load():
    """Moment at the base, elastica of four plates of two springs each: the hinge turns all disks alike beyond it."""
    gives = {"kind": "base_compliance", "compliance_rad_per_n_m": 0.02}
    rig = manipulator(gives, model="elastica")
    found = state(rig, tip=(0.0, 0.5))
    assert found.q[0, 0, 0] == pytest.approx(0.02 * found.moment[0, 0, 0], rel=1e-7)
    assert np.abs(found.q[0, 1:, 0]).max() < 1e-8
    softer = {"kind": "clamp_compliance", "compliance_rad_per_n_m": 0.01}
    both = state(manipulator(gives, softer, model="elastica"), tip=(0.0, 0.5))
    assert both.q[0, 0, 0] == pytest.approx(0.03 * both.moment[0, 0, 0], rel=1e-7)
    assert both.q[0, 1, 0] == pytest.approx(0.01 * both.moment[0, 1, 0], rel=1e-7)


def test_an_umbilical_turns_the_tip_back_and_bends_all_plates_alike():
    """Four plates in series, EI / l each: the tip turns by T d / (EI / (4 l) + k), to first order in the tension."""
    tether = {"kind": "umbilical", "stiffness_n_m_per_rad": 1.5}
    small = state(manipulator(tether, model="elastica"), up=1e-3)
    assert small.angle[0, -1] == pytest.approx(1e-3 * 0.02 / (0.24 / (4 * 0.014) + 1.5), rel=1e-4)
    rig, force = manipulator(tether, mu=0.3), (0.3, -0.6)
    held, chain = state(rig, tip=force), manipulator(mu=0.3).chain()
    couple = -1.5 * held.angle[0, -1]
    assert same(held, solve_chain(chain, loads(chain, [[40.0, 0.0]], tip=force, moment=couple)))
