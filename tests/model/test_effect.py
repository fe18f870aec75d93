"""Effects against independent laws: what each does in a case that can be worked out otherwise."""

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import brentq

from prb3r.errors import SpecError
from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.effects import EFFECT_KINDS
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import solve as solve_steps

PLATE = {"plates": 4, "length_m": 0.03, "clamp_m": 0.008, "bending_stiffness_n_m2": 0.24}


def manipulator(*effects, mu=0.0, plates=4, **changes):
    data = {
        "name": "bench",
        "youngs_modulus_pa": 2e11,
        "disk": {"thickness_m": 0.004, "mass_kg": 0.05},
        "friction": {"coefficient": mu},
        "segment": [PLATE | {"plates": plates}],
        "cable": [
            {"name": "up", "offset_m": 0.02, "ends_at_segment": 1},
            {"name": "down", "offset_m": -0.02, "ends_at_segment": 1},
        ],
        "effect": list(effects),
    }
    return Manipulator.model_validate(data | changes)


def state(rig, up=40.0, down=0.0, slip=-1.0, tip=(0.0, 0.0)):
    chain = rig.chain()
    return solve_chain(chain, loads(chain, [[up, down]], slip, tip=tip))


def same(a, b, within=1e-9):
    return np.abs([a.x - b.x, a.y - b.y]).max() < within


@pytest.mark.parametrize(
    "effect",
    [
        {"kind": "cable_friction", "coefficient": 0.0},
        {"kind": "cable_friction", "coefficient": 0.0, "cables": ["up"]},
        {"kind": "pulley_friction", "efficiency": 1.0},
        {"kind": "worn_hole", "disk": 2, "coefficient": 0.0},
        {"kind": "edge_wrap"},
        {"kind": "tension_offset", "offset_n": 0.0},
        {"kind": "hole_offset", "cable": "up", "offset_m": 0.0},
        {"kind": "hole_clearance", "clearance_m": 0.0},
        {"kind": "weakened_plate", "plate": 1, "factor": 1.0},
        {"kind": "segment_stiffness", "segment": 1, "factor": 1.0},
        {"kind": "nonlinear_plate", "law": "cubic", "cubic_m2": 0.0},
        {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 1.0, "ratio": 1.0},
        {"kind": "nonlinear_plate", "law": "smooth", "knee_per_m": 1.0, "ratio": 1.0, "sharpness": 2.0},
        {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 1.0, "ratio": 0.5, "side": "negative"},
        {"kind": "precurvature", "curvature_per_m": 0.0},
        {"kind": "disk_contact", "angle_rad": 1.0, "stiffness_n_m_per_rad": 50.0},
        {"kind": "notch_closing", "factor": 2.0, "stiffness_n_m_per_rad": 50.0},
        {"kind": "notch_closing", "factor": 0.01, "stiffness_n_m_per_rad": 50.0, "side": "negative"},
        {"kind": "clamp_compliance", "compliance_rad_per_n_m": 1e-12},
        {"kind": "cable_bending", "stiffness_n_m2": 0.0},
        {"kind": "gravity"},
        {"kind": "tip_force"},
        {"kind": "tip_load_friction", "efficiency": 1.0},
        {"kind": "weight_friction", "efficiency": 1.0},
        {"kind": "camera_scale", "scale": 1.1},
    ],
)
def test_an_effect_of_no_size_changes_nothing(effect):
    with_it, without = (manipulator(*effects, model="elastica") for effects in ([effect], []))
    assert same(state(with_it, 40, 10, tip=(0, 1)), state(without, 40, 10, tip=(0, 1)), 1e-8)


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


def test_a_pure_moment_bends_a_nonlinear_plate_by_its_law():
    """Equal and opposite tip forces are no load: two far cables of equal pull give none either; use one short plate."""
    stiffness, arc, lever, pull = 0.24, 0.014, 0.02, 30.0
    for law, curvature in (
        ({"law": "cubic", "cubic_m2": 0.02}, lambda m: np.roots([0.02, 0, 1, -m]).real[2]),
        ({"law": "bilinear", "knee_per_m": 1.0, "ratio": 0.5}, lambda m: 1 + (m - 1) / 0.5),
        ({"law": "smooth", "knee_per_m": 1.0, "ratio": 4.0, "sharpness": 3.0}, lambda m: menegotto_pinto(m, 1, 4, 3)),
    ):
        rig = manipulator({"kind": "nonlinear_plate", **law}, plates=1)
        chain = rig.chain()
        found = solve_chain(chain, loads(chain, [[pull, 0.0]]))
        mean = found.moment[0, 0, 1:-1].mean() / stiffness  # nearly constant along a short arc
        assert mean == pytest.approx(pull * lever / stiffness, rel=0.02)
        assert found.angle[0, -1] == pytest.approx(curvature(mean) * arc, rel=2e-3)


def menegotto_pinto(moment, knee, ratio, sharpness):
    """Curvature by bisection of the law as it was published, in strain over that of the knee."""

    def stress(strain):
        return ratio * strain + (1 - ratio) * strain / (1 + strain**sharpness) ** (1 / sharpness)

    return knee * brentq(lambda strain: stress(strain) - moment / knee, 0, 100, xtol=1e-14)


TWO_SECTIONS = [
    PLATE | {"plates": 2, "outer_fibre_m": 4e-4},
    PLATE | {"plates": 2, "bending_stiffness_n_m2": 0.1, "outer_fibre_m": 2.5e-4},
]


def bent(rig, moment):
    """Curvatures of all arcs under one moment (N m) on each: circles."""
    chain = rig.chain()
    found = solve_chain(chain, loads(chain, [[0.0, 0.0]], moment=moment))
    return np.diff(found.angle[0]) / chain.arc


@pytest.mark.parametrize("law", [{"law": "bilinear"}, {"law": "smooth", "sharpness": 2.0}], ids=["bilinear", "smooth"])
def test_a_knee_in_strain_is_one_of_the_material_whatever_the_section(law):
    """Plates whose outermost fibres are strained alike keep the same part of their stiffness."""
    knee, ratio = 1.2e-3, 0.3
    yields = {"kind": "nonlinear_plate", "knee_strain": knee, "ratio": ratio} | law
    rig = manipulator(yields, segment=TWO_SECTIONS, model="elastica")
    for moment in (0.5, 1.0, -1.0):
        found = bent(rig, moment)
        for plates, rigidity, fibre in ((slice(0, 2), 0.24, 4e-4), (slice(2, 4), 0.1, 2.5e-4)):
            bare = abs(moment) / rigidity
            if law["law"] == "smooth":
                curvature = menegotto_pinto(bare, knee / fibre, ratio, 2.0)
            else:
                curvature = bare + max(bare - knee / fibre, 0) * (1 / ratio - 1)
            assert found[plates] == pytest.approx(np.sign(moment) * np.full(2, curvature), rel=1e-9)


def test_a_knee_of_one_side_is_passed_by_bending_to_that_side_alone():
    yields = {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 2.0, "ratio": 0.5, "side": "negative"}
    bow = {"kind": "precurvature", "curvature_per_m": 1.0}  # beyond the stress-free curvature counts
    rig = manipulator(yields, bow, model="elastica")
    assert bent(rig, 0.96) == pytest.approx(np.full(4, 1 + 4.0))
    assert bent(rig, -0.96) == pytest.approx(np.full(4, 1 - 2 - 2 / 0.5))


def test_a_smooth_law_passes_into_the_bilinear_one_and_into_a_limit_moment():
    def curvatures(**law):
        return bent(manipulator({"kind": "nonlinear_plate", "knee_per_m": 2.0} | law, model="elastica"), 0.9)

    sharp = curvatures(law="bilinear", ratio=0.4)
    assert curvatures(law="smooth", ratio=0.4, sharpness=100.0) == pytest.approx(sharp, rel=1e-3)
    limit = 0.24 * 2.0
    plastic = {"kind": "nonlinear_plate", "law": "smooth", "knee_per_m": 2.0, "ratio": 1e-9, "sharpness": 2.0}
    flat = bent(manipulator(plastic, model="elastica"), 0.99 * limit)
    assert flat == pytest.approx(np.full(4, 2 * 0.99 / np.sqrt(1 - 0.99**2)), rel=1e-5)  # M / limit = x / sqrt(1 + x^2)


NOTCHES = [(5e-4, 1.40e-3, 1.1e-4, 0.3311), (1e-3, 1.39e-3, 1.2e-4, 0.6623)]
"""Notch length, tendon from the neutral axis, back of the tube from it (m), and the bend (rad) at which the notch
closes by hand: tubes of 1.6 mm as wrists are cut from."""


@pytest.mark.parametrize(("notch", "arm", "fibre", "closes"), NOTCHES)
def test_notches_close_where_their_geometry_says(notch, arm, fibre, closes):
    tube = {"plates": 3, "length_m": notch, "bending_stiffness_n_m2": 6e-6, "outer_fibre_m": fibre}
    tendon = {"name": "tendon", "offset_m": arm, "ends_at_segment": 1}
    edges = {"kind": "notch_closing", "factor": 1.0, "stiffness_n_m_per_rad": 1e3}
    rig = manipulator(edges, segment=[tube], cable=[tendon], disk={"thickness_m": 1e-3}, model="elastica")
    chain = rig.chain()
    found = solve_chain(chain, loads(chain, [[0.0], [1.0], [4.0], [5.0]]))
    bend = np.diff(found.angle, axis=1)
    assert (bend[1] < closes).all()
    assert bend[2:] == pytest.approx(np.full((2, 3), closes), abs=1e-3)
    outer = notch - bend[2] * (arm + fibre)  # the length that is left of the notch where the tendon runs
    assert outer == pytest.approx(np.zeros(3), abs=1e-3 * notch)
    away = solve_chain(chain, loads(chain, [[0.0]], moment=-6e-6 * closes * 1.5 / notch))
    assert np.diff(away.angle[0]) == pytest.approx(np.full(3, -1.5 * closes))  # nothing closes at the back


def test_closed_notches_take_the_place_of_disks_that_touch_on_their_side():
    touch = {"kind": "disk_contact", "angle_rad": 0.02, "stiffness_n_m_per_rad": 40.0}
    open_end = {"kind": "notch_closing", "factor": 50.0, "stiffness_n_m_per_rad": 40.0, "side": "positive"}
    both = manipulator(open_end, touch)
    assert same(state(both, 120.0), state(manipulator(), 120.0))
    assert same(state(both, 0.0, 120.0), state(manipulator(touch), 0.0, 120.0))


def test_precurved_plates_are_circles_when_nothing_pulls():
    elastica = {"model": "elastica"}
    found = state(manipulator({"kind": "precurvature", "curvature_per_m": 3.0}, **elastica), up=0.0)
    assert found.angle[0] == pytest.approx(3.0 * 0.014 * np.arange(5))
    one = state(manipulator({"kind": "precurvature", "curvature_per_m": 3.0, "plates": [2]}, **elastica), up=0.0)
    assert one.angle[0] == pytest.approx(3.0 * 0.014 * np.array([0, 0, 1, 1, 1]))


def test_disks_in_contact_share_the_moment_with_the_plate():
    angle, stiffness = 0.02, 40.0
    found = state(manipulator({"kind": "disk_contact", "angle_rad": angle, "stiffness_n_m_per_rad": stiffness}), 120.0)
    bend = np.diff(found.angle[0])
    assert (bend > angle).all()
    whole = found.moment[0].mean(1) + stiffness * (bend - angle)
    assert found.moment[0].mean(1) == pytest.approx(0.24 / 0.014 * bend, rel=3e-3)
    assert whole == pytest.approx(120 * 0.02, rel=0.03)  # what the cable asks for


def test_soft_clamps_add_two_hinges_to_every_plate():
    compliance = 0.004
    soft = {"kind": "clamp_compliance", "compliance_rad_per_n_m": compliance}
    stiff, soft = (state(manipulator(*effects, model="elastica")) for effects in ([], [soft]))
    moment = 40 * 0.02
    assert np.diff(soft.angle[0] - stiff.angle[0]) == pytest.approx(2 * compliance * moment * np.ones(4), rel=0.02)


YIELD = {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 1.0, "ratio": 0.5}


@pytest.mark.parametrize(
    ("kind", "first", "second", "both"),
    [
        ("pulley_friction", {"efficiency": 0.9}, {"efficiency": 0.8}, {"efficiency": 0.72}),
        ("tension_offset", {"offset_n": 2.0}, {"offset_n": 3.0}, {"offset_n": 5.0}),
        ("hole_clearance", {"clearance_m": 0.0005}, {"clearance_m": 0.001}, {"clearance_m": 0.0015}),
        ("weakened_plate", {"plate": 2, "factor": 0.5}, {"plate": 2, "factor": 0.8}, {"plate": 2, "factor": 0.4}),
        ("precurvature", {"curvature_per_m": 1.0}, {"curvature_per_m": -3.0}, {"curvature_per_m": -2.0}),
        ("clamp_compliance", *({"compliance_rad_per_n_m": size} for size in (0.001, 0.002, 0.003))),
        ("cable_bending", {"stiffness_n_m2": 0.01}, {"stiffness_n_m2": 0.02}, {"stiffness_n_m2": 0.03}),
        ("tip_force", {"y_n": 1.0}, {"x_n": 0.5, "y_n": -3.0}, {"x_n": 0.5, "y_n": -2.0}),
        ("tip_load_friction", {"efficiency": 0.5}, {"efficiency": 0.8}, {"efficiency": 0.4}),
    ],
)
def test_a_second_effect_of_a_kind_adds_to_the_first(kind, first, second, both):
    """Plates that yield are there too, as the two hinges of a clamp once had no curvature to yield at."""
    twice, summed = (
        manipulator(YIELD, *({"kind": kind} | values for values in effects), model="elastica")
        for effects in ([first, second], [both])
    )
    assert not EFFECT_KINDS[kind].once
    assert same(state(twice, 60, 10, tip=(0, 1)), state(summed, 60, 10, tip=(0, 1)))


@pytest.mark.parametrize(
    ("kind", "first", "second"),
    [
        ("slip_history", {"presliding_m": 1e-3}, {"presliding_m": 1e-4}),
        ("edge_wrap", {}, {}),
        ("nonlinear_plate", {"law": "cubic", "cubic_m2": 0.01}, {"law": "cubic", "cubic_m2": 0.002}),
        ("nonlinear_plate", *({"law": "bilinear", "knee_per_m": 1.0, "ratio": ratio} for ratio in (0.5, 2.0))),
        ("disk_contact", *({"angle_rad": angle, "stiffness_n_m_per_rad": 50.0} for angle in (0.01, 0.03))),
    ],
)
def test_a_second_effect_of_a_kind_that_a_rig_has_once_replaces_the_first(kind, first, second):
    twice, last = (
        manipulator(*({"kind": kind} | values for values in effects), mu=0.2) for effects in ([first, second], [second])
    )
    assert EFFECT_KINDS[kind].once
    assert same(state(twice, 60, 10), state(last, 60, 10))


def test_cables_add_their_own_bending_stiffness_where_they_run():
    added = manipulator({"kind": "cable_bending", "stiffness_n_m2": 0.03})
    stiffer = manipulator(segment=[PLATE | {"bending_stiffness_n_m2": 0.24 + 2 * 0.03}])
    assert same(state(added), state(stiffer))
    dead = manipulator({"kind": "cable_bending", "stiffness_n_m2": 0.03}, {"kind": "dead_cable", "cable": "down"})
    one = manipulator(segment=[PLATE | {"bending_stiffness_n_m2": 0.24 + 0.03}])
    assert same(state(dead), state(one))


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
    true, read = (
        solve_steps(manipulator(*camera), steps, as_measured=flag, image_centre_m=(0.05, 0.01))[
            ["x_m", "y_m"]
        ].to_numpy()
        for flag in (False, True)
    )
    for p, m in zip(true, read, strict=True):
        away = 1.02 * p - (0.05, 0.01)
        assert m == pytest.approx((0.05, 0.01) + away * (1 + 0.5 * (away[0] ** 2 + away[1] ** 2)), abs=1e-12)


@pytest.mark.parametrize(
    ("effect", "said"),
    [
        ({"kind": "weakened_plate", "plate": 9, "factor": 0.5}, "there is no plate 9"),
        ({"kind": "weakened_plate", "plate": 1, "factor": 0.0}, "greater than 0"),
        ({"kind": "pulley_friction", "efficiency": 1.2}, "at most 1"),
        ({"kind": "dead_cable", "cable": "left"}, "there is no cable 'left'"),
        ({"kind": "worn_hole", "disk": 4, "coefficient": 0.1}, "cables rub at disks 0 to 3"),
        ({"kind": "segment_stiffness", "segment": 2, "factor": 0.1}, "there is no segment 2"),
        ({"kind": "nonlinear_plate", "law": "cubic", "ratio": 0.5}, "takes cubic_m2, nothing else"),
        (YIELD | {"knee_strain": 0.01}, "takes knee_strain and ratio, nothing else"),
        (YIELD | {"law": "smooth"}, "takes knee_per_m and ratio and sharpness, nothing else"),
        (YIELD | {"side": "left"}, "positive"),
        ({"kind": "nonlinear_plate", "law": "bilinear", "knee_strain": 0.01, "ratio": 0.5}, "needs outer_fibre_m"),
        ({"kind": "wear"}, "unknown kind 'wear'"),
    ],
)
def test_bad_parameters_are_refused(effect, said, tmp_path):
    import tomli_w

    from prb3r.model.manipulator import load_manipulator

    path = tmp_path / "m.toml"
    path.write_text(tomli_w.dumps(manipulator().model_dump(exclude_none=True) | {"effect": [effect]}))
    with pytest.raises(SpecError, match=said):
        load_manipulator(path)


@pytest.mark.parametrize(
    ("knee", "ratio", "angle", "stiffness"),
    [(0.86, 0.026, 0.49, 6e4), (1.8, 0.042, 0.67, 2.6e4), (0.57, 0.023, 0.08, 4e4), (1.7, 0.041, 0.44, 180)],
)
def test_plates_that_yield_and_touch_are_solved_in_few_steps_and_stand_against_their_disks(
    knee, ratio, angle, stiffness
):
    """Full Newton steps cycle between kinks of so different slopes; half ones took 50 to 60, near the limit."""
    yields = {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": knee, "ratio": ratio}
    touches = {"kind": "disk_contact", "angle_rad": angle, "stiffness_n_m_per_rad": stiffness}
    chain = manipulator(yields, touches, model="elastica").chain()
    tension = np.outer(np.linspace(2, 300, 11), [1.0, 0.0])
    found = solve_chain(chain, loads(chain, tension))
    assert (found.outcome == 0).all()
    assert found.iterations.max() <= 30
    bend = np.diff(found.angle[-1])
    rigidity = ratio * 0.24  # beyond the knee, of arcs of 0.014 m in circles
    held = (0.24 - rigidity) * knee + rigidity * bend / 0.014 + stiffness * (bend - angle)
    half, radius = bend / 2, 0.014 / bend
    lever = 0.02 * np.cos(half) + 0.008 * np.sin(half) + radius * (np.sin(half) / half - np.cos(half))
    assert held == pytest.approx(300 * lever, rel=0.01)  # the cable runs straight from hole to hole
