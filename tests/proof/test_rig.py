"""The rig against published numbers, hand calculations and its own refinement."""

import copy
from pathlib import Path

import numpy as np
import pytest
from rigs import FACE, LENGTH, apart, effect, prototype, short, spans

from prb3r.proof.rig.simulate import simulate


@pytest.mark.parametrize(
    ("force", "w", "u", "slope"),
    [
        (1, 0.30172, 0.05643, 0.46135),
        (2, 0.49346, 0.16064, 0.78175),
        (5, 0.71379, 0.38763, 1.21537),
        (10, 0.81061, 0.55500, 1.43029),
    ],
)
def test_mattiasson_cantilever(force, w, u, slope):
    arm = {"segment": [{"plates": 1, "length_m": 1.0, "bending_stiffness_n_m2": 1.0}]}
    states = simulate(arm, [{"tip_y_n": force}], elements=24)
    found = states.y[0, 1], 1 - states.x[0, 1], states.angle[0, 1]
    np.testing.assert_allclose(found, (w, u, slope), rtol=0, atol=6e-6)


def test_capstan_on_equal_spans():
    """Plates too stiff to be bent by the cable, bent alike beforehand: n spans, base hole counted."""
    plates, mu, bend = 8, 0.4, 0.1
    manipulator = short(
        effect("precurvature", curvature_per_m=bend / 0.018), plates=plates, rigidity=1e6, coefficient=mu
    )
    states = simulate(manipulator, [{"cable_up_n": 10.0}])
    expected = np.exp(-mu * plates * bend * (plates - 0.5) / plates)
    np.testing.assert_allclose(states.tension[0, -1, 0] / 10, expected, rtol=1e-6)


@pytest.mark.parametrize("wrap", ["net", "edges"])
@pytest.mark.parametrize("slip", [-1, 1, 0.5])
def test_tension_falls_by_the_turning_of_the_drawn_spans(wrap, slip):
    manipulator = short(coefficient=0.4, wrap=wrap)
    steps = [{"cable_up_n": 30.0, "cable_down_n": 5.0, "tip_y_n": 2.0, "slip_up": slip}]
    states = simulate(manipulator, steps)
    _, way, axis, _ = spans(manipulator, states)
    direction = np.angle(way[:, 0] / axis[0])
    disk = states.angle[-1, :-1]
    turns = np.abs(np.diff(direction, prepend=0))
    if wrap == "edges":
        turns = np.abs(direction - disk) + np.abs(np.append(0, direction[:-1]) - disk)
    np.testing.assert_allclose(states.tension[0, :, 0], 30 * np.exp(slip * 0.4 * np.cumsum(turns)), rtol=1e-9)


def test_changing_point_of_fig_14():
    """Cable 2 at 50 x 0.0255 / 0.021 N against cable 4 at 50 N leaves Segment 1 straight, whatever the friction."""
    for mu in (0.0, 0.3):
        states = simulate(prototype(coefficient=mu), [{"cable_4_n": 50.0, "cable_2_n": 50 * 0.0255 / 0.021}])
        np.testing.assert_allclose(states.angle[0, :8], 0, atol=1e-9)


def test_pulling_order_of_fig_11():
    load = {"cable_1_kg": 2.5, "cable_3_kg": 10.0}
    a, b = (simulate(prototype(), [load | {name: 1.0}]) for name in ("slip_1", "slip_3"))
    assert apart(a, b, face=FACE) == pytest.approx(0.0806, abs=1e-4)
    assert apart(a, b) == pytest.approx(0.0799, abs=1e-4)
    assert apart(a, b, disk=7) == pytest.approx(0.0169, abs=1e-4)


def test_history_against_full_reversal():
    """Unloading cable 1: stuck holes keep the tip from following, by 64 mm at 7.5 kg, by 1 mm at 5 kg."""
    weights = (10.0, 7.5, 5.0)
    history = simulate(prototype(direction="history"), [{"cable_1_kg": w} for w in weights])
    declared = simulate(prototype(), [{"cable_1_kg": w, "slip_1": 1.0} for w in weights])
    assert apart(history, declared, step=1, face=FACE) == pytest.approx(0.064, abs=5e-4)
    assert apart(history, declared, step=2, face=FACE) == pytest.approx(0.001, abs=1e-4)
    drawn = simulate(prototype(), [{"cable_1_kg": 10.0}])
    assert apart(history, drawn, step=0) < 1e-9


def test_pulling_order_with_history():
    both, rig = {"cable_1_kg": 2.5, "cable_3_kg": 10.0}, prototype(direction="history")
    a = simulate(rig, [{"cable_1_kg": 2.5}, both])
    b = simulate(rig, [{"cable_3_kg": 10.0}, both])
    assert apart(a, b) == pytest.approx(0.067, abs=5e-4)
    together = simulate(rig, [both])
    assert apart(a, together, step=-1) == pytest.approx(0.007, abs=5e-4)
    assert apart(b, together, step=-1) == pytest.approx(0.059, abs=6e-4)


LOOP = [{"cable_1_n": 60.0}, {"cable_1_n": 25.0, "cable_2_n": 20.0}, {"cable_1_n": 45.0, "tip_y_n": -1.0}, {}]


@pytest.mark.parametrize("presliding", [1e-6, 3e-5, 1e-3])
def test_sampling_of_the_path_and_repeats_change_nothing(presliding):
    rig = prototype(effect("pulley_friction", efficiency=0.95), plates=4, direction="history", presliding_m=presliding)
    fine, before = [], {}
    for step in LOOP:
        names = before.keys() | step.keys()
        for part in (0.01, 0.37, 0.5, 1.0, 1.0):
            fine.append({name: (1 - part) * before.get(name, 0) + part * step.get(name, 0) for name in names})
        before = step
    coarse, sampled = (simulate(rig, steps, elements=6) for steps in (LOOP, fine))
    assert coarse.converged.all()
    for field in ("x", "y"):
        np.testing.assert_allclose(getattr(sampled, field)[4::5], getattr(coarse, field), rtol=0, atol=5e-6 * LENGTH)
        np.testing.assert_array_equal(getattr(sampled, field)[4::5], getattr(sampled, field)[3::5])
    equal = simulate(rig, LOOP, elements=6, substeps=500) if presliding > 1e-5 else coarse
    np.testing.assert_allclose(equal.y, coarse.y, rtol=0, atol=5e-6 * LENGTH)


def test_mirrored_history():
    mirror = {"1": "4", "2": "3", "3": "2", "4": "1"}
    steps = [{name: value for name, value in step.items() if name[0] == "c"} for step in LOOP]
    turned = [{f"cable_{mirror[name[6]]}_n": value for name, value in step.items()} for step in steps]
    a, b = (simulate(prototype(direction="history"), each) for each in (steps, turned))
    np.testing.assert_allclose(a.y, -b.y, rtol=0, atol=1e-9)
    np.testing.assert_allclose(a.slip, b.slip[:, :, ::-1], rtol=0, atol=1e-4)


def test_slip_is_remembered_after_unloading():
    """Nothing applied at the end, but the constant tension of the cables meets holes that have slipped."""
    constant = effect("tension_offset", offset_n=2.0), effect("precurvature", curvature_per_m=2.0)
    states = simulate(prototype(*constant, direction="history"), [{}, {"cable_1_n": 60.0}, {}])
    np.testing.assert_allclose(states.slip[0], 0, atol=1e-9)
    np.testing.assert_allclose(states.tension[0, 0], 2, rtol=1e-9)
    assert np.abs(states.slip[2]).max() == 1
    assert 1e-4 < np.abs(states.angle[2] - states.angle[0]).max() < 0.1


def test_elements_converge():
    steps = [{"cable_1_n": 100.0, "cable_3_n": 80.0, "tip_y_n": 2.0}]
    states = [simulate(prototype(), steps, elements=count) for count in (3, 6, 24, 96)]
    errors = [apart(each, states[3]) / LENGTH for each in states[:3]]
    assert errors[0] > 10 * errors[1]
    assert errors[2] < 1e-9


@pytest.mark.long
@pytest.mark.parametrize("direction", ["declared", "history"])
def test_so_many_elements_are_taken_that_more_move_nothing_that_is_read(direction):
    """Of a plate without hysteresis; one with it takes more of them."""
    steps = [{"cable_1_n": 100.0, "tip_y_n": 1.0}, {"cable_1_n": 40.0, "cable_3_n": 80.0}]
    bent = effect("nonlinear_plate", law="smooth", knee_per_m=3.0, ratio=0.5, sharpness=3.0)
    plain = prototype(bent, plates=4, direction=direction)
    assert 0 < apart(simulate(plain, steps), simulate(plain, steps, elements=96)) < 1e-6 * LENGTH
    loops = prototype(effect("hysteretic_plate", slipping_share=0.5, yield_per_m=2.0), plates=4, direction=direction)
    usual, fine, coarse = (simulate(loops, steps, elements=count) for count in (None, 24, 12))
    assert apart(usual, fine) == 0 < apart(usual, coarse)


def test_a_path_ends_where_the_plate_carries_no_more():
    soft = short(effect("nonlinear_plate", law="cubic", cubic_m2=-0.01))
    states = simulate(soft, [{"cable_up_n": 10.0}, {"cable_up_n": 200.0}, {"cable_up_n": 10.0}])
    np.testing.assert_array_equal(states.converged, [True, False, False])
    assert np.isnan(states.x[1:]).all()


def test_three_segments_and_six_cables():
    rig = copy.deepcopy(prototype(direction="history", wrap="edges"))
    rig["segment"].append({"plates": 4, "length_m": 0.025, "bending_stiffness_n_m2": 0.15})
    rig["cable"] += [
        {"name": n, "offset_m": [y, y, 0.8 * y], "ends_at_segment": 3} for n, y in (("5", 0.03), ("6", -0.03))
    ]
    states = simulate(rig, [{"cable_5_n": 20.0, "cable_2_n": 10.0}, {"cable_5_n": 12.0, "cable_3_n": 30.0}])
    assert states.converged.all()
    assert states.x.shape == (2, 19)
    assert states.tension[0, 6:, 1].tolist()[1:] == [0] * 11
    assert (states.tension[1, :, 4] > 0).all()


def test_the_rig_is_independent():
    sources = list((Path(__file__).parents[2] / "prb3r" / "proof" / "rig").rglob("*.py"))
    assert len(sources) > 10
    assert not any("prb3r.mechanics" in each.read_text() or "prb3r.model" in each.read_text() for each in sources)
