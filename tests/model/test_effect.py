"""Effects against independent laws: what each does in a case that can be worked out otherwise."""

import numpy as np
import pandas as pd
import pytest
from model.one_segment import PLATE, manipulator, same, state

from prb3r.inverse.search import natural_limits
from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.solve import solve as solve_steps


def test_friction_effects_equal_their_nominal_counterparts():
    friction = {"kind": "cable_friction", "coefficient": 0.25}
    assert same(state(manipulator(friction)), state(manipulator(mu=0.25)))
    worn = [{"kind": "worn_hole", "disk": disk, "coefficient": 0.25} for disk in range(4)]
    assert same(state(manipulator(*worn)), state(manipulator(mu=0.25)))
    single = manipulator(friction | {"cables": ["up"]}, mu=0.1)
    assert same(state(single, 40, 0), state(manipulator(mu=0.25), 40, 0))
    assert same(state(single, 0, 40), state(manipulator(mu=0.1), 0, 40))
    history = manipulator({"kind": "slip_history", "presliding_m": 1e-4}, mu=0.25)
    assert same(
        state(history), state(manipulator(friction={"coefficient": 0.25, "direction": "history", "presliding_m": 1e-4}))
    )


def test_a_pulley_scales_the_tension_by_its_efficiency_or_its_inverse():
    rig = manipulator({"kind": "pulley_friction", "efficiency": 0.8})
    assert same(state(rig, 50.0, slip=-1), state(manipulator(), 40.0))
    assert same(state(rig, 40.0, slip=1), state(manipulator(), 50.0))


def test_a_tension_offset_is_added_to_idle_cables_too_and_never_pushes():
    assert same(state(manipulator({"kind": "tension_offset", "offset_n": 5.0}), 40, 0), state(manipulator(), 45, 5))
    assert same(state(manipulator({"kind": "tension_offset", "offset_n": -5.0}), 40, 0), state(manipulator(), 35, 0))


def test_a_dead_cable_is_one_that_nobody_pulls():
    assert same(state(manipulator({"kind": "dead_cable", "cable": "down"}), 40, 30), state(manipulator(), 40, 0))


def test_a_hole_offset_is_another_lever():
    moved = manipulator({"kind": "hole_offset", "cable": "up", "offset_m": 0.003})
    other = manipulator(cable=[{"name": "up", "offset_m": 0.023, "ends_at_segment": 1}])
    chain = other.chain()
    assert same(state(moved), solve_chain(chain, loads(chain, [[40.0]])))


def test_clearance_moves_a_tensioned_cable_by_its_full_size_to_the_inner_side():
    rig = manipulator({"kind": "hole_clearance", "clearance_m": 0.001})
    wide = manipulator({"kind": "hole_offset", "cable": "up", "offset_m": 0.001})
    assert same(state(rig, 80.0), state(wide, 80.0), 1e-7)  # plates bend by far more than 0.005 rad


def test_weakened_plates_equal_a_weaker_modulus():
    weak = manipulator(*({"kind": "weakened_plate", "plate": plate, "factor": 0.7} for plate in (1, 2, 3, 4)))
    segment = manipulator({"kind": "segment_stiffness", "segment": 1, "factor": 0.7})
    soft = manipulator(segment=[PLATE | {"bending_stiffness_n_m2": 0.7 * 0.24}])
    assert same(state(weak), state(soft))
    assert same(state(segment), state(soft))


def test_precurved_plates_are_circles_when_nothing_pulls():
    elastica = {"model": "elastica"}
    found = state(manipulator({"kind": "precurvature", "curvature_per_m": 3.0}, **elastica), up=0.0)
    assert found.angle[0] == pytest.approx(3.0 * 0.014 * np.arange(5))
    none = state(manipulator({"kind": "precurvature", "curvature_per_m": 3.0, "plates": []}, **elastica), up=0.0)
    assert not none.angle.any()
    one = state(manipulator({"kind": "precurvature", "curvature_per_m": 3.0, "plates": [2]}, **elastica), up=0.0)
    assert one.angle[0] == pytest.approx(3.0 * 0.014 * np.array([0, 0, 1, 1, 1]))


def test_rest_curvature_that_grows_along_the_arm_is_an_arc_of_cornu_when_nothing_pulls():
    """Four plates of 14 mm with curvatures of -1.5, -0.5, 0.5 and 1.5 1/m; one plate has no ends that could differ."""
    steady = {"kind": "precurvature_gradient", "change_per_m": 3.0}
    found = state(manipulator(steady, model="elastica"), up=0.0)
    assert found.angle[0] == pytest.approx(0.014 * np.array([0.0, -1.5, -2.0, -1.5, 0.0]), abs=1e-15)
    assert not state(manipulator(steady, plates=1), up=0.0).angle.any()


def test_disks_in_contact_share_the_moment_with_the_plate():
    angle, stiffness = 0.02, 40.0
    found = state(manipulator({"kind": "disk_contact", "angle_rad": angle, "stiffness_n_m_per_rad": stiffness}), 120.0)
    bend = np.diff(found.angle[0])
    assert (bend > angle).all()
    whole = found.moment[0].mean(1) + stiffness * (bend - angle)
    assert found.moment[0].mean(1) == pytest.approx(0.24 / 0.014 * bend, rel=3e-3)
    assert whole == pytest.approx(120 * 0.02, rel=0.03)  # what the cable asks for


def test_a_camera_that_moves_has_every_step_farther_on():
    """Two sequences of two steps: the fourth step is read three quarters of a turn on, and 3 mm off."""
    moves = {"kind": "camera_drift", "x_m_per_step": 1e-3, "angle_rad_per_step": np.pi / 2}
    steps = pd.DataFrame({"sequence": ["a", "a", "b", "b"], "step": [1, 2, 1, 2], "cable_up_n": [10.0, 20, 30, 40]})
    plain, read = (
        solve_steps(manipulator(moves), steps, as_measured=flag)[["x_m", "y_m", "angle_rad"]].to_numpy()[-5:]
        for flag in (False, True)
    )
    assert read[:, 0] == pytest.approx(plain[:, 1] + 3e-3)
    assert read[:, 1] == pytest.approx(-plain[:, 0])
    assert read[:, 2] == pytest.approx(plain[:, 2] + 1.5 * np.pi)


def test_soft_clamps_add_two_hinges_to_every_plate():
    compliance = 0.004
    soft = {"kind": "clamp_compliance", "compliance_rad_per_n_m": compliance}
    stiff, soft = (state(manipulator(*effects, model="elastica")) for effects in ([], [soft]))
    moment = 40 * 0.02
    assert np.diff(soft.angle[0] - stiff.angle[0]) == pytest.approx(2 * compliance * moment * np.ones(4), rel=0.02)


def test_cables_add_their_own_bending_stiffness_where_they_run():
    added = manipulator({"kind": "cable_bending", "stiffness_n_m2": 0.03})
    stiffer = manipulator(segment=[PLATE | {"bending_stiffness_n_m2": 0.24 + 2 * 0.03}])
    assert same(state(added), state(stiffer))
    assert natural_limits(added.chain()) == pytest.approx(natural_limits(stiffer.chain()))
    dead = manipulator({"kind": "cable_bending", "stiffness_n_m2": 0.03}, {"kind": "dead_cable", "cable": "down"})
    one = manipulator(segment=[PLATE | {"bending_stiffness_n_m2": 0.24 + 0.03}])
    assert same(state(dead), state(one))


def test_cables_stay_elastic_beside_plates_that_yield():
    """Beyond the knee EI is a quarter of 0.24 N m^2, and two cables of 0.03 keep theirs: 0.12 of 0.30 are left."""
    knee = {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 1.5}
    beside = manipulator(knee | {"ratio": 0.25}, {"kind": "cable_bending", "stiffness_n_m2": 0.03})
    one = manipulator(knee | {"ratio": 0.4}, segment=[PLATE | {"bending_stiffness_n_m2": 0.30}])
    elastic = manipulator(segment=one.model_dump(exclude_none=True)["segment"])
    assert state(one).angle[0, -1] > 1.2 * state(elastic).angle[0, -1]
    assert same(state(beside), state(one))


def test_plates_have_masses_of_their_own_and_the_tip_may_carry_more():
    """Plates of 20 g on four disks of 50 g: 70 g a disk but 60 g at the tip, which carries 30 g as a file or an effect
    has it, whichever is named first."""
    heavy = {"segment": [PLATE | {"plate_mass_kg": 0.02}], "disk": {"thickness_m": 0.004, "mass_kg": 0.05}}
    sag, more = {"kind": "gravity", "y_m_s2": -9.8}, {"kind": "tip_mass", "mass_kg": 0.03}
    bare = manipulator()
    weights = bare.chain(), np.array([[0.07], [0.07], [0.07], [0.09]]) * [0.0, -9.8]
    loaded = solve_chain(weights[0], loads(weights[0], [[40.0, 0.0]], force=weights[1]))
    tool = heavy | {"disk": heavy["disk"] | {"tip_mass_kg": 0.03}}
    for rig in (manipulator(sag, **tool), manipulator(sag, more, **heavy), manipulator(more, sag, **heavy)):
        assert same(state(rig), loaded)
    assert same(state(manipulator(sag, more, more, **heavy)), state(manipulator(sag, more, **tool)))
    with pytest.raises(ValueError, match=r"of the 0\.06 kg of the last disk 0\.07 kg cannot be missing"):
        manipulator(sag, {"kind": "tip_mass", "mass_kg": -0.07}, **heavy)


def test_a_payload_that_was_noted_wrongly_acts_as_it_is_on_tip_and_disks():
    heavier, bare = manipulator({"kind": "payload_scale", "scale": 1.5}).chain(), manipulator().chain()
    half, whole = ({"tip": [[0.0, 2 * n]], "force": np.tile([0.0, n], (4, 1))} for n in (-0.4, -0.6))
    noted, acting = (solve_chain(rig, loads(rig, [[40.0, 0.0]], **on)) for rig, on in ((heavier, half), (bare, whole)))
    assert same(noted, acting)
    assert not same(noted, solve_chain(bare, loads(bare, [[40.0, 0.0]], **half)))


def test_the_weight_of_the_arm_itself_is_shared_evenly_by_the_disks():
    """4 N across and -2 N along an arm of four disks, in two effects that add up: 1 N and -0.5 N on each."""
    rig = manipulator({"kind": "self_weight", "y_n": 4.0}, {"kind": "self_weight", "x_n": -2.0})
    bare = manipulator().chain()
    assert same(state(rig), solve_chain(bare, loads(bare, [[40.0, 0.0]], force=np.tile([-0.5, 1.0], (4, 1)))))
    assert not same(state(rig), state(manipulator()))


def test_on_a_tilted_base_all_dead_loads_act_turned_the_other_way():
    """A force of 2 N on disk 2, 3 N at the tip and the weight of the disks, on a base tilted by 0.4 rad."""
    tilt, sag = {"kind": "base_tilt", "angle_rad": 0.4}, {"kind": "gravity", "y_m_s2": -9.8}
    turned = {"kind": "gravity", "x_m_s2": -9.8 * np.sin(0.4), "y_m_s2": -9.8 * np.cos(0.4)}
    cos, sin = np.cos(0.4), np.sin(0.4)
    tilted, level = manipulator(tilt, sag).chain(), manipulator(turned).chain()
    on_disk = [[0.0, 0.0], [2.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    found = solve_chain(tilted, loads(tilted, [[40.0, 0.0]], force=on_disk, tip=(0.0, 3.0)))
    on_disk[1] = [2 * cos, -2 * sin]
    assert same(found, solve_chain(level, loads(level, [[40.0, 0.0]], force=on_disk, tip=(3 * sin, 3 * cos))))


def test_many_heavy_plates_sag_as_a_beam_under_its_own_weight():
    """w = q L^4 / (8 EI) to first order in the weight; n plates have it at their ends, as the trapezium rule has an
    integral, which makes 1 + 1 / (3 n^2) of that."""
    plates, mass = 6, 1e-6
    strip = {"plates": plates, "length_m": 0.01, "bending_stiffness_n_m2": 0.24, "plate_mass_kg": mass}
    rig = manipulator({"kind": "gravity", "y_m_s2": -9.8}, segment=[strip], disk={"thickness_m": 0.0}, model="elastica")
    exact = -mass / 0.01 * 9.8 * (0.01 * plates) ** 4 / (8 * 0.24)
    assert state(rig, up=0.0).y[0, -1] == pytest.approx(exact * (1 + 1 / (3 * plates**2)), rel=1e-6)


def test_gravity_is_a_load_on_every_disk_and_the_tip_force_one_on_the_tip():
    rig = manipulator()
    chain = rig.chain()
    weight = np.zeros((1, 4, 2))
    weight[..., 1] = 0.05 * -9.8
    loaded = solve_chain(chain, loads(chain, [[40.0, 0.0]], force=weight))
    assert same(state(manipulator({"kind": "gravity", "y_m_s2": -9.8})), loaded)
    pushed = state(manipulator({"kind": "tip_force", "x_n": 0.5, "y_n": -1.0}))
    assert same(pushed, state(rig, tip=(0.5, -1.0)))
    braked = state(manipulator({"kind": "tip_load_friction", "efficiency": 0.6}), tip=(0.0, -2.0))
    assert same(braked, state(rig, tip=(0.0, -1.2)))


def test_of_a_hung_weight_a_share_arrives_at_every_disk_or_at_one():
    def tip(rig, second, fourth):
        steps = pd.DataFrame({"sequence": ["a"], "step": [1], "disk2_y_n": [second], "disk4_y_n": [fourth]})
        return solve_steps(rig, steps)[["x_m", "y_m", "angle_rad"]].to_numpy()

    held, one = (manipulator({"kind": "weight_friction", "efficiency": 0.7, **disk}) for disk in ({}, {"disk": 2}))
    assert tip(held, -2.0, -1.0) == pytest.approx(tip(manipulator(), -1.4, -0.7), abs=1e-12)
    assert tip(one, -2.0, -1.0) == pytest.approx(tip(manipulator(), -1.4, -1.0), abs=1e-12)
    with pytest.raises(ValueError, match="loads act on disks 1 to 4, not on 5"):
        manipulator({"kind": "weight_friction", "efficiency": 0.7, "disk": 5})


def test_constant_effects_act_at_rest_and_history_starts_there():
    steps = pd.DataFrame({"sequence": ["a"], "step": [1], "cable_up_n": [0.0]})
    sag = {"kind": "gravity", "y_m_s2": -9.8}
    rest = solve_steps(manipulator(sag, friction={"coefficient": 0.3, "direction": "history"}), steps)
    assert rest["y_m"].iloc[-1] < -1e-3
    plain = solve_steps(manipulator(sag), steps)
    assert rest["y_m"].to_numpy() == pytest.approx(plain["y_m"].to_numpy(), abs=1e-9)


def test_a_camera_reads_positions_scaled_and_bent_about_its_image_centre():
    steps = pd.DataFrame({"sequence": ["a"], "step": [1], "cable_up_n": [60.0]})
    camera = [{"kind": "lens_distortion", "k1_per_m2": 0.5}, {"kind": "camera_scale", "scale": 1.02}]
    camera.append({"kind": "camera_aspect", "y_over_x": 0.9})
    true, read = (
        solve_steps(manipulator(*camera), steps, as_measured=flag, image_centre_m=(0.05, 0.01))[
            ["x_m", "y_m"]
        ].to_numpy()
        for flag in (False, True)
    )
    for p, m in zip(true, read, strict=True):
        away = 1.02 * p * (1, 0.9) - (0.05, 0.01)
        assert m == pytest.approx((0.05, 0.01) + away * (1 + 0.5 * (away[0] ** 2 + away[1] ** 2)), abs=1e-12)
