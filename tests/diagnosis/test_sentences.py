"""What is said of a suspect that was found: where, how much, and how it differs from the nominal chain."""

import re

import numpy as np
import pytest
from diagnosis.suspected import MU

from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.library.suspect import Estimate, Occurrence


def test_what_differs_in_kind_from_a_chain_without_it_is_said(library):
    """Hinges at the clamps or in the base are nodes more, a dead cable is another routing; the others are rules of
    friction, or plates that remember."""
    structural = {hypothesis.kind for hypothesis, _ in library if hypothesis.structural}
    hinges, remembering = {"clamp_compliance", "base_compliance"}, {"hysteretic_plate", "flag_hysteresis"}
    remembering |= {"plate_relaxation"}
    assert structural == hinges | {"dead_cable", "slip_history", "edge_wrap", *remembering}
    assert {kind for kind, suspect in SUSPECTS.items() if suspect.costly} == {"slip_history"}
    assert {h.kind for h, _ in library if not h.mechanical} == {
        "camera_scale",
        "camera_aspect",
        "lens_distortion",
        "camera_drift",
    }


def test_one_direction_makes_sense_where_the_other_does_not_exist(library):
    losses = {"pulley_friction", "tip_load_friction", "weight_friction"}
    amounts = {"cable_friction", "hole_clearance", "clamp_compliance", "cable_bending"}
    amounts |= {"wrap_saturation", "hole_drag", "base_compliance", "umbilical", "tension_play", "payload_scale"}
    amounts |= {"hanger"}
    assert {h.kind for h, _ in library if h.continuous and h.sided(friction=0.3)} == losses | amounts | {
        "nonlinear_plate"
    }


@pytest.mark.parametrize(
    ("kind", "place", "sizes", "said"),
    [
        ("pulley_friction", {}, {"efficiency": (0.9, 0.88, 0.93)}, "of all cables takes 10 (7 to 12) % of the tension"),
        ("pulley_friction", {"cables": ("3",)}, {"efficiency": (0.9, None, None)}, "of cable 3 takes 10 % of"),
        ("cable_friction", {"cables": ("2",)}, {"coefficient": (0.5, 0.4, 0.6)}, "Cable 2 rubs more in its holes"),
        ("cable_friction", {"cables": ("2",)}, {"coefficient": (0.1, 0.0, 0.2)}, "Cable 2 rubs less in its holes"),
        ("slip_history", {}, {"presliding_m": (3e-5, None, None)}, "over 30 micrometres of travel"),
        ("slip_history", {}, {"presliding_m": (2.41e-3, 9e-4, 5e-3)}, "over 2410 (900 to 5000) micrometres of travel"),
        ("worn_hole", {"disk": 0}, {"coefficient": (0.32645, 0.10945, 0.36668)}, "coefficient 0.326 (0.109 to 0.367)"),
        ("worn_hole", {"disk": 0}, {"coefficient": (0.5, None, None)}, "The holes of the base disk rub more than"),
        ("worn_hole", {"disk": 0}, {"coefficient": (5.7e-9, None, None)}, "than the others: friction coefficient 0."),
        ("worn_hole", {"disk": 3, "cables": ("1",)}, {"coefficient": (0.1, None, None)}, "disk 3 rub less than"),
        ("hole_offset", {"cable": "2"}, {"offset_m": (-0.002, -0.003, -0.001)}, "runs -2 (-3 to -1) mm off"),
        ("nonlinear_plate", {"law": "bilinear"}, {"knee_per_m": (2, 1, 3), "ratio": (0.5, 0.4, 0.6)}, "soften (yield)"),
        ("nonlinear_plate", {"law": "bilinear"}, {"knee_per_m": (2, 1, 3), "ratio": (1.5, 1, 2)}, "stiffen (touch)"),
        (
            "nonlinear_plate",
            {"law": "bilinear"},
            {"knee_per_m": (2, 1, 3), "ratio": (10, None, None)},
            "beyond a curvature of 2 (1 to 3) 1/m, to 10 times their stiffness",
        ),
        (
            "nonlinear_plate",
            {"law": "bilinear", "side": "negative"},
            {"knee_per_m": (2, 1, 3), "ratio": (1.6, None, None)},
            "to 1.6 times their stiffness, or something outside stands in the arm's way there.",
        ),
        (
            "nonlinear_plate",
            {"law": "smooth", "side": "negative"},
            {"knee_strain": (0.018, 0.017, 0.019), "ratio": (0.4, 0.3, 0.5), "sharpness": (3, None, None)},
            "soften (yield) beyond a strain of 1.8 (1.7 to 1.9) % where they bend toward negative offsets",
        ),
        (
            "nonlinear_plate",
            {"law": "smooth", "sections": "similar", "side": "positive"},
            {"knee_per_m": (228, 220, 236), "ratio": (0.04, 0.03, 0.05), "sharpness": (4, None, None)},
            "beyond a curvature of 228 (220 to 236) 1/m at plate 1, at the others at the same strain (as sections of "
            "one shape) where they bend toward positive offsets, to 0.04 (0.03 to 0.05) of their stiffness, over",
        ),
        (
            "superelastic_plate",
            {},
            {
                "plateau_strain": (0.008, 0.007, 0.009),
                "compression_ratio": (1.4, 1.2, 1.6),
                "plateau_slope": (0.05, 0.03, 0.08),
            },
            "beyond a strain of 0.8 (0.7 to 0.9) % in tension, and 1.4 (1.2 to 1.6) times that in compression, their "
            "stress reaches a plateau that rises by 5 (3 to 8) % of Young's modulus",
        ),
        (
            "hysteretic_plate",
            {},
            {"yield_strain": (0.006, 0.005, 0.007), "slipping_share": (0.3, 0.2, 0.4)},
            "beyond a strain of 0.6 (0.5 to 0.7) % a share of 0.3 (0.2 to 0.4) of their stiffness slips",
        ),
        (
            "hysteretic_plate",
            {"elements": 3},
            {"yield_per_m": (6, 5, 7), "slipping_share": (0.3, 0.2, 0.4)},
            "little by little (in 3 stages), on average beyond a curvature of 6 (5 to 7) 1/m a share of 0.3",
        ),
        (
            "notch_closing",
            {"side": "positive"},
            {"factor": (1.02, 0.98, 1.05), "stiffness_n_m_per_rad": (3, None, None)},
            "The notches close where they bend toward positive offsets at 1.02 (0.98 to 1.05) times the bend that",
        ),
        (
            "load_dependent_friction",
            {"tension_n": 95.0},
            {"exponent": (0.3, 0.2, 0.4)},
            "the calibrated one at 95.0 N and goes with the tension as (T / 95.0 N)^-n, n = 0.3 (0.2 to 0.4).",
        ),
        (
            "tension_drift",
            {"cables": ("2",)},
            {"offset_n_per_step": (-0.2, -0.3, -0.1)},
            "The tension of cable 2 is off by -0.2 (-0.3 to -0.1) N more with every further step",
        ),
        (
            "hanger",
            {},
            {"weight_n": (1.2, 1.0, 1.4)},
            "Every loaded cable is pulled by 1.2 (1 to 1.4) N more than noted, idle ones by nothing",
        ),
        (
            "tension_play",
            {},
            {"play_n": (1.2, 1.0, 1.4)},
            "The tension of all cables lags by 1.2 (1 to 1.4) N behind what is recorded, either way",
        ),
        (
            "plate_relaxation",
            {},
            {"share": (0.2, 0.18, 0.22), "steps": (4.0, 3.0, 5.0)},
            "a share of 0.2 (0.18 to 0.22) of the moment that bends them relaxes with a time constant of 4 (3 to 5) "
            "steps, so that under a steady pull they bend by 25 % more in the end",
        ),
        (
            "plate_relaxation",
            {"step_s": 20.0},
            {"share": (0.2, 0.18, 0.22), "steps": (4.0, 3.0, 5.0)},
            "with a time constant of 80 (60 to 100) s, so that",
        ),
        ("plate_softening", {}, {"share_per_step": (0.004, 0.003, 0.005)}, "lose 0.4 (0.3 to 0.5) % of"),
        (
            "friction_drift",
            {},
            {"share_per_step": (0.004, 0.003, 0.005)},
            "Friction grows by 0.4 (0.3 to 0.5) % of the first step's with every step: cables and holes wear",
        ),
        ("friction_drift", {}, {"share_per_step": (-0.004, -0.005, -0.003)}, "falls by 0.4 (0.3 to 0.5) % of the"),
        ("plate_softening", {}, {"share_per_step": (-0.004, -0.005, -0.003)}, "gain 0.4 (0.3 to 0.5) % of"),
        (
            "load_dependent_friction",
            {"tension_n": 95.0},
            {"exponent": (-0.3, -0.4, -0.2)},
            "Friction grows with the load: its coefficient is the calibrated one at 95.0 N",
        ),
        (
            "rate_dependent_friction",
            {"reference_n_per_s": 0.3},
            {"rate": (0.05, 0.04, 0.06)},
            "with how fast cables are pulled: its coefficient is the calibrated one where the tension changes by "
            "0.3 N/s, and differs by 11.5 (9.21 to 13.8) % where it changes ten times as fast.",
        ),
        (
            "rate_dependent_friction",
            {"reference_n_per_s": 1.0},
            {"rate": (-0.02, -0.03, -0.01)},
            "long cables are held",
        ),
        (
            "breakaway_friction",
            {},
            {"excess": (0.4, 0.3, 0.5), "decay_n": (20.0, 10.0, 40.0)},
            "coefficient is larger by 40 (30 to 50) %, which falls to 1/e as its tension changes by 20 (10 to 40) N",
        ),
        (
            "wrap_saturation",
            {},
            {"saturation_per_rad": (4, 3, 5)},
            "of a turn t counts t / (1 + t x 4 (3 to 5) per rad).",
        ),
        ("hole_drag", {}, {"drag_n": (0.4, 0.3, 0.5)}, "Every hole drags on its cable with 0.4 (0.3 to 0.5) N,"),
        ("stiffness_gradient", {}, {"tip_to_base": (0.6, 0.5, 0.7)}, "become softer and softer from the base to the"),
        ("stiffness_gradient", {}, {"tip_to_base": (1.5, 1.4, 1.6)}, "become stiffer and stiffer from the base to the"),
        ("base_tilt", {}, {"angle_rad": (np.pi / 90, np.pi / 180, np.pi / 60)}, "by 2 (1 to 3) degrees, anticlockwise"),
        ("base_tilt", {}, {"angle_rad": (-np.pi / 90, -np.pi / 60, -np.pi / 180)}, "by 2 (1 to 3) degrees, clockwise"),
        (
            "payload_scale",
            {},
            {"scale": (2.0, 1.9, 2.1)},
            "are 2 (1.9 to 2.1) times as large as noted: weigh",
        ),
        ("gravity", {}, {"x_m_s2": (9, 8, 10), "y_m_s2": (1, 0, 2)}, "9 (8 to 10) m/s^2 along x and 1 (0 to 2) m/s^2"),
        ("gravity", {"x_m_s2": 0.0}, {"y_m_s2": (-9, -10, -8)}, "in the plane: -9 (-10 to -8) m/s^2 along y on every"),
        ("self_weight", {"y_n": 0.0}, {"x_n": (2, 1, 3)}, "leaves out: 2 (1 to 3) N along x in all"),
        ("tip_mass", {}, {"mass_kg": (0.03, 0.02, 0.04)}, "heavier than noted, by 30 (20 to 40) g"),
        ("tip_mass", {}, {"mass_kg": (-0.03, -0.04, -0.02)}, "lighter than noted, by 30 (20 to 40) g"),
        ("precurvature_gradient", {}, {"change_per_m": (2, 1.5, 2.5)}, "steadily, by 2 (1.5 to 2.5) 1/m in all"),
        ("precurvature", {}, {"curvature_per_m": (1, None, None)}, "All plates are bent"),
        ("precurvature", {"plates": (4,)}, {"curvature_per_m": (1, None, None)}, "Plate 4 is bent"),
        ("precurvature", {"plates": (4, 5, 6)}, {"curvature_per_m": (1, None, None)}, "Plates 4 to 6 are bent"),
        ("tip_load_friction", {}, {"efficiency": (0.8, None, None)}, "only 80 % arrives"),
        (
            "weight_friction",
            {"disk": 6},
            {"efficiency": (0.74, 0.7, 0.8)},
            "disk 6 only 74 (70 to 80) % arrives",
        ),
        (
            "camera_drift",
            {},
            {
                "x_m_per_step": (1e-4, 9e-5, 1.1e-4),
                "y_m_per_step": (-2e-5, None, None),
                "angle_rad_per_step": (3e-4, None, None),
            },
            "the picture shifts by (100 (90 to 110), -20) micrometres and turns by 300 microradians",
        ),
        (
            "camera_drift",
            {},
            {"angle_rad_per_step": (3e-4, None, None)},
            "from step to step the picture turns by 300 microradians; photograph",
        ),
        ("camera_scale", {}, {"scale": (1.00123, None, None)}, "1.0012 times the true ones"),
        ("camera_aspect", {}, {"y_over_x": (0.97, 0.96, 0.98)}, "along y 0.97 (0.96 to 0.98) times as long as those"),
    ],
)
def test_a_sentence_says_where_and_how_much_in_the_units_of_the_workshop(kind, place, sizes, said):
    estimates = {name: Estimate(*size) for name, size in sizes.items()}
    sentence = SUSPECTS[kind].sentence(Occurrence(place, estimates, MU))
    assert said in sentence
    assert not re.search(r"[,.;:] ?[,.;:]|  ", sentence), "punctuation and spaces stand once"


@pytest.mark.parametrize(
    ("open_ends", "said"),
    [
        ((False, False), "2 (1 to 5)"),
        ((True, False), "2 (up to 5)"),
        ((False, True), "2 (1 or more)"),
        ((True, True), "2 (of any size)"),
    ],
)
def test_an_end_that_the_search_set_is_not_told(open_ends, said):
    told = Estimate(2.0, 1.0, 5.0, open_ends)
    assert f"{told}" == said
    assert f"{told.times(1000).times(1e-3)}" == said
    assert told.less(6.0).open == open_ends[::-1]


def test_only_a_bound_at_which_an_effect_is_there_is_an_open_end():
    """An efficiency of 1 is no pulley, so that an interval to there is one; one that ends at the least was cut."""
    efficiency = Free("efficiency", 1.0, 0.2, 1.0)
    assert efficiency.open_ends(0.9, 1.0) == (False, False)
    assert efficiency.open_ends(0.2, 0.9) == (True, False)
    travel = Free("presliding_m", 3e-5, 1e-6, 1e-2, log=True)
    assert travel.open_ends(travel.value(travel.bounds()[0]), 5e-3) == (True, False)
    assert travel.open_ends(2e-6, 1e-2) == (False, True)


def test_every_sentence_names_its_place_and_follows_every_estimate(library):
    for hypothesis, _ in library:

        def said(values, hypothesis=hypothesis):
            estimates = {free.name: Estimate(value) for free, value in zip(hypothesis.free, values, strict=True)}
            return SUSPECTS[hypothesis.kind].sentence(Occurrence(dict(hypothesis.place), estimates, MU))

        middle = np.full(len(hypothesis.free), 0.7)
        assert said(middle)[0].isupper()
        assert said(middle).endswith(".")
        for unit in np.eye(len(middle)):
            assert said(middle + 0.1 * unit) != said(middle)
        for name, value in hypothesis.place:
            if name[1:] in ("_n", "_m_s2"):  # a part of a load that is held at 0
                assert value == 0
                assert f"along {name[0]}" not in said(middle)
                continue
            if hypothesis.kind == "load_cell":  # a gain of 1, or no quadratic term
                assert ("(1 + q T)" in said(middle)) == (name == "gain")
                continue
            first = value[0] if isinstance(value, tuple) else value
            assert name == "law" or str(first) in said(middle) or (first == 0 and "base disk" in said(middle))


def test_names_read_as_kind_and_place():
    assert Hypothesis("dead_cable", (("cable", "left"),)).name == "dead_cable (cable left)"
    assert Hypothesis("precurvature", (("plates", (1, 2)),)).name == "precurvature (plates 1+2)"
    assert Hypothesis("edge_wrap").name == "edge_wrap"
