"""Laws of bending against independent ones: knees, notches, what happens beyond them."""

import numpy as np
import pytest
from model.one_segment import PLATE, manipulator, same, state
from scipy.optimize import brentq

from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import solve_chain


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


def test_round_rods_known_by_their_stiffness_alone_yield_where_those_of_known_fibres_do():
    """EI = E pi d^4 / 64 and the outermost fibre at d / 2: sections of one shape, so that both say the same."""
    knee, modulus, diameters = 1.2e-3, 2e11, (8e-4, 1e-3)
    law = {"kind": "nonlinear_plate", "law": "smooth", "ratio": 0.3, "sharpness": 2.0}
    rods = [PLATE | {"plates": 2, "bending_stiffness_n_m2": modulus * np.pi * d**4 / 64} for d in diameters]
    known = [rod | {"outer_fibre_m": d / 2} for rod, d in zip(rods, diameters, strict=True)]
    strained = manipulator(law | {"knee_strain": knee}, segment=known, model="elastica")
    first = 2 * knee / diameters[0]
    alike = manipulator(law | {"knee_per_m": first, "sections": "similar"}, segment=rods, model="elastica")
    plain = manipulator(law | {"knee_per_m": first}, segment=rods, model="elastica")
    for moment in (0.01, 0.02, -0.02):
        assert bent(alike, moment) == pytest.approx(bent(strained, moment), rel=1e-12)
        assert bent(plain, moment)[:2] == pytest.approx(bent(strained, moment)[:2], rel=1e-12)
    assert abs(bent(plain, 0.02)[3] / bent(strained, 0.02)[3] - 1) > 0.05


@pytest.mark.parametrize("given", ["curvature", "strain"])
def test_slip_in_plates_begins_at_a_curvature_or_at_a_strain_of_the_outermost_fibre(given):
    """One element under a moment that only grows: EI up to there, 1 - share of it beyond, whatever the section."""
    share, strain, curvature = 0.7, 1.2e-3, 3.0
    begins = {"yield_per_m": curvature} if given == "curvature" else {"yield_strain": strain}
    rig = manipulator(
        {"kind": "hysteretic_plate", "slipping_share": share} | begins, segment=TWO_SECTIONS, model="elastica"
    )
    for moment in (0.5, -1.0):
        found = bent(rig, moment)
        for plates, rigidity, fibre in ((slice(0, 2), 0.24, 4e-4), (slice(2, 4), 0.1, 2.5e-4)):
            knee, bare = (curvature if given == "curvature" else strain / fibre), abs(moment) / rigidity
            expected = bare + max(bare - knee, 0) * (1 / (1 - share) - 1)
            assert found[plates] == pytest.approx(np.sign(moment) * np.full(2, expected), rel=1e-9)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({}, "either yield_per_m or yield_strain"),
        ({"yield_per_m": 1.0, "yield_strain": 1e-3}, "either yield_per_m or yield_strain"),
        ({"yield_strain": 1e-3}, "outer_fibre_m"),
        ({"yield_per_m": 1.0, "elements": 4}, "less than or equal to 3"),
    ],
)
def test_hysteresis_that_says_too_little_or_too_much_is_refused(wrong, says):
    with pytest.raises(ValueError, match=says):
        manipulator({"kind": "hysteretic_plate", "slipping_share": 0.5} | wrong)


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
