"""Rules that effects of every kind keep: of no size, twice on a rig, with bad parameters."""

import pytest
from model.one_segment import YIELD, manipulator, same, state

from prb3r.errors import SpecError
from prb3r.model.effects import EFFECT_KINDS


@pytest.mark.parametrize(
    "effect",
    [
        {"kind": "cable_friction", "coefficient": 0.0},
        {"kind": "cable_friction", "coefficient": 0.0, "cables": ["up"]},
        {"kind": "pulley_friction", "efficiency": 1.0},
        {"kind": "worn_hole", "disk": 2, "coefficient": 0.0},
        {"kind": "edge_wrap"},
        {"kind": "tension_offset", "offset_n": 0.0},
        {"kind": "load_cell"},
        {"kind": "load_cell", "gain": 1.0, "quadratic_per_n": 0.0, "cables": ["up"]},
        {"kind": "tension_drift", "offset_n_per_step": 0.0},
        {"kind": "tension_play", "play_n": 0.0},
        {"kind": "hanger", "weight_n": 0.0},
        {"kind": "load_dependent_friction", "exponent": 0.0, "tension_n": 10.0},
        {"kind": "rate_dependent_friction", "rate": 0.0},
        {"kind": "friction_drift", "share_per_step": 0.0},
        {"kind": "breakaway_friction", "excess": 0.0, "decay_n": 10.0},
        {"kind": "wrap_saturation", "saturation_per_rad": 0.0},
        {"kind": "hole_drag", "drag_n": 0.0},
        {"kind": "stiffness_gradient", "tip_to_base": 1.0},
        {"kind": "base_compliance", "compliance_rad_per_n_m": 0.0},
        {"kind": "plate_softening", "share_per_step": 0.0},
        {"kind": "plate_relaxation", "share": 0.0, "steps": 3.0},
        {"kind": "plate_relaxation", "share": 0.5, "steps": 1e12},
        {"kind": "umbilical", "stiffness_n_m_per_rad": 0.0},
        {"kind": "hole_offset", "cable": "up", "offset_m": 0.0},
        {"kind": "hole_clearance", "clearance_m": 0.0},
        {"kind": "weakened_plate", "plate": 1, "factor": 1.0},
        {"kind": "segment_stiffness", "segment": 1, "factor": 1.0},
        {"kind": "nonlinear_plate", "law": "cubic", "cubic_m2": 0.0},
        {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 1.0, "ratio": 1.0},
        {"kind": "nonlinear_plate", "law": "smooth", "knee_per_m": 1.0, "ratio": 1.0, "sharpness": 2.0},
        {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 1.0, "ratio": 0.5, "side": "negative"},
        {"kind": "hysteretic_plate", "slipping_share": 0.0, "yield_per_m": 1.0},
        {"kind": "hysteretic_plate", "slipping_share": 0.9, "yield_per_m": 50.0, "elements": 2},
        {
            "kind": "superelastic_plate",
            "plateau_strain": 0.1,
            "tube_outer_m": 2e-4,
            "tube_inner_m": 0,
            "notch_depth_m": 0,
        },
        {"kind": "flag_hysteresis", "reverse_ratio": 1.0},
        {"kind": "flag_hysteresis", "reverse_ratio": 0.3},
        {"kind": "precurvature", "curvature_per_m": 0.0},
        {"kind": "precurvature_gradient", "change_per_m": 0.0},
        {"kind": "disk_contact", "angle_rad": 1.0, "stiffness_n_m_per_rad": 50.0},
        {"kind": "notch_closing", "factor": 2.0, "stiffness_n_m_per_rad": 50.0},
        {"kind": "notch_closing", "factor": 0.01, "stiffness_n_m_per_rad": 50.0, "side": "negative"},
        {"kind": "clamp_compliance", "compliance_rad_per_n_m": 1e-12},
        {"kind": "cable_bending", "stiffness_n_m2": 0.0},
        {"kind": "gravity"},
        {"kind": "tip_force"},
        {"kind": "tip_mass", "mass_kg": 0.1},
        {"kind": "base_tilt", "angle_rad": 0.0},
        {"kind": "tip_load_friction", "efficiency": 1.0},
        {"kind": "weight_friction", "efficiency": 1.0},
        {"kind": "camera_scale", "scale": 1.1},
        {"kind": "camera_aspect", "y_over_x": 1.1},
        {"kind": "camera_drift", "x_m_per_step": 1e-3},
    ],
)
def test_an_effect_of_no_size_changes_nothing(effect):
    with_it, without = (manipulator(*effects, model="elastica") for effects in ([effect], []))
    assert same(state(with_it, 40, 10, tip=(0, 1)), state(without, 40, 10, tip=(0, 1)), 1e-8)


@pytest.mark.parametrize(
    ("kind", "first", "second", "both"),
    [
        ("pulley_friction", {"efficiency": 0.9}, {"efficiency": 0.8}, {"efficiency": 0.72}),
        ("tension_offset", {"offset_n": 2.0}, {"offset_n": 3.0}, {"offset_n": 5.0}),
        ("tension_play", {"play_n": 2.0}, {"play_n": 3.0}, {"play_n": 5.0}),
        ("hole_clearance", {"clearance_m": 0.0005}, {"clearance_m": 0.001}, {"clearance_m": 0.0015}),
        ("weakened_plate", {"plate": 2, "factor": 0.5}, {"plate": 2, "factor": 0.8}, {"plate": 2, "factor": 0.4}),
        ("stiffness_gradient", {"tip_to_base": 0.5}, {"tip_to_base": 0.8}, {"tip_to_base": 0.4}),
        ("precurvature", {"curvature_per_m": 1.0}, {"curvature_per_m": -3.0}, {"curvature_per_m": -2.0}),
        ("precurvature_gradient", {"change_per_m": 1.0}, {"change_per_m": -3.0}, {"change_per_m": -2.0}),
        ("clamp_compliance", *({"compliance_rad_per_n_m": size} for size in (0.001, 0.002, 0.003))),
        ("cable_bending", {"stiffness_n_m2": 0.01}, {"stiffness_n_m2": 0.02}, {"stiffness_n_m2": 0.03}),
        ("base_tilt", {"angle_rad": 0.2}, {"angle_rad": -0.3}, {"angle_rad": -0.1}),
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
        ("nonlinear_plate", {"law": "cubic", "cubic_m2": 0.01}, {"law": "bilinear", "knee_per_m": 1.0, "ratio": 0.5}),
        ("nonlinear_plate", {"law": "bilinear", "knee_per_m": 1.0, "ratio": 0.5}, {"law": "cubic", "cubic_m2": 0.01}),
        ("hysteretic_plate", *({"slipping_share": share, "yield_per_m": 1.0} for share in (0.3, 0.5))),
        ("flag_hysteresis", {"reverse_ratio": 0.3}, {"reverse_ratio": 0.8}),
        ("disk_contact", *({"angle_rad": angle, "stiffness_n_m_per_rad": 50.0} for angle in (0.01, 0.03))),
    ],
)
def test_a_second_effect_of_a_kind_that_a_rig_has_once_replaces_the_first(kind, first, second):
    twice, last = (
        manipulator(*({"kind": kind} | values for values in effects), mu=0.2) for effects in ([first, second], [second])
    )
    assert EFFECT_KINDS[kind].once
    assert same(state(twice, 60, 10), state(last, 60, 10))


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
        (YIELD | {"sections": "equal"}, "'similar'"),
        (
            {"kind": "nonlinear_plate", "law": "bilinear", "knee_strain": 0.01, "ratio": 0.5, "sections": "similar"},
            "takes knee_strain and ratio, nothing else",
        ),
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
