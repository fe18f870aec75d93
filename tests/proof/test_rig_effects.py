"""The effects of the rig: a second integration of its plates, other ways to say the same, limits, refusals."""

import numpy as np
import pytest
from numba import typeof
from rigs import FACE, RIGIDITY, effect, prototype, short, spans
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from prb3r.errors import SpecError
from prb3r.proof.rig.build import build_rig
from prb3r.proof.rig.simulate import observe, simulate, steps_passed

LAWS = [
    (effect("segment_stiffness", segment=1, factor=1.0), lambda k: k),
    (effect("nonlinear_plate", law="cubic", cubic_m2=0.02), lambda k: k * (1 + 0.02 * k**2)),
    (effect("nonlinear_plate", law="cubic", cubic_m2=-1e-3), lambda k: k * (1 - 1e-3 * k**2)),
    (
        effect("nonlinear_plate", law="bilinear", knee_per_m=3.0, ratio=0.4),
        lambda k: np.sign(k) * (min(abs(k), 3) + 0.4 * max(abs(k) - 3, 0)),
    ),
    (
        effect("nonlinear_plate", law="smooth", knee_strain=1.2e-3, ratio=0.4, sharpness=2.0),
        lambda k: 0.4 * k + 0.6 * k / np.sqrt(1 + (k / 3) ** 2),
    ),
    (
        effect("nonlinear_plate", law="smooth", knee_per_m=2.0, ratio=3.0, sharpness=1.0, side="positive"),
        lambda k: k if k < 0 else 3 * k - 2 * k / (1 + k / 2),
    ),
    (
        effect("hysteretic_plate", slipping_share=0.6, yield_strain=1.2e-3),  # under loads that only grow
        lambda k: np.sign(k) * (min(abs(k), 3) + 0.4 * max(abs(k) - 3, 0)),
    ),
    (
        effect("superelastic_plate", plateau_strain=5e-4, compression_ratio=1.0, plateau_slope=0.2),
        lambda k: 0.2 * k + 0.8 * np.sign(k) * (abs(k) if abs(k) < 1.25 else 1.875 - 1.25**3 / (2 * k**2)),
    ),
    (effect("notch_closing", factor=0.1, stiffness_n_m_per_rad=20.0), lambda k: k),
    (effect("weakened_plate", plate=2, factor=0.7), lambda k: k),
    (effect("cable_bending", stiffness_n_m2=0.01), lambda k: k * (1 + 0.02 / RIGIDITY)),
    (effect("precurvature", curvature_per_m=-2.0, plates=[1, 3]), lambda k: k),
    (effect("clamp_compliance", compliance_rad_per_n_m=0.02), lambda k: k),
    (effect("disk_contact", angle_rad=0.03, stiffness_n_m_per_rad=20.0), lambda k: k),
    (
        effect("empirical_moment", terms=[{"of": "bend", "coefficient": 4.0}, {"of": "position", "coefficient": 0.2}]),
        lambda k: k,
    ),
    (effect("gravity", x_m_s2=-3.0, y_m_s2=-9.0), lambda k: k),
    (effect("hole_clearance", clearance_m=0.001), lambda k: k),
]


def test_rigs_of_every_law_are_of_one_type_for_which_kernels_are_compiled_once():
    tube = {"tube_outer_m": 1e-3, "tube_inner_m": 8e-4, "notch_depth_m": 6e-4}
    notched = effect("superelastic_plate", plateau_strain=5e-4, **tube)
    assert len({typeof(build_rig(short(*what)).rig) for what in [(), (notched,), *((law,) for law, _ in LAWS)]}) == 1


@pytest.mark.parametrize(("what", "law"), LAWS, ids=[what.get("law", what["kind"]) for what, _ in LAWS])
def test_every_plate_balances_in_a_second_integration(what, law):
    manipulator = short(what)
    dead = {"tip_x_n": -1.0, "tip_y_n": 2.0, "disk2_y_n": -1.5}
    states = simulate(manipulator, [{"cable_up_n": 45.0, "cable_down_n": 8.0, "slip_down": 1.0} | dead])
    bends = np.diff(states.angle[-1])
    shift = 0.001 * np.tanh(bends / 0.005)[:, None] if what["kind"] == "hole_clearance" else 0.0
    _, way, axis, ends = spans(manipulator, states, shift)
    loads = [(states.x[-1, k] + 1j * states.y[-1, k], -1.5j * (k == 2)) for k in (1, 2, 3)]
    if what["kind"] == "gravity":
        loads = [(where, force + 0.0447 * (-3 - 9j)) for where, force in loads]
    loads.append((loads[2][0] + FACE * axis[3], -1 + 2j))
    compliance = what.get("compliance_rad_per_n_m", 0)
    for i in range(3):
        start = states.x[-1, i] + 1j * states.y[-1, i] + axis[i] * (FACE + 0.006)
        acting = [*zip(ends[i], -way[i] * states.tension[-1, i], strict=True), *loads[i:]]
        arm = 0.02 if bends[i] > 0 else 0.025
        touch = 0.1 * 0.018 / (arm + 4e-4) if what["kind"] == "notch_closing" else what.get("angle_rad", np.inf)
        excess = max(abs(bends[i]) - touch, 0) * np.sign(bends[i])
        beside = excess * what.get("stiffness_n_m_per_rad", 0)
        if what["kind"] == "empirical_moment":
            beside = -4 * bends[i] - 0.2 * (i - 1)
        rigidity = RIGIDITY * (0.7 if what.get("plate") == i + 1 else 1)
        free = -2.0 if i + 1 in what.get("plates", []) else 0

        def moment(place, acting=acting, beside=beside):
            return sum(((where - place).conjugate() * force).imag for where, force in acting) - beside

        def slope(_, z, moment=moment, rigidity=rigidity, free=free):
            m = moment(z[0] + 1j * z[1]) / rigidity
            return np.cos(z[2]), np.sin(z[2]), free + brentq(lambda k: law(k) - m, -15, 15, xtol=1e-13)

        begin = start.real, start.imag, states.angle[-1, i] + compliance * moment(start)
        x, y, angle = solve_ivp(slope, (0, 0.018), begin, rtol=1e-9, atol=1e-12).y[:, -1]
        angle += compliance * moment(x + 1j * y)
        centre = x + 1j * y + np.exp(1j * angle) * (0.006 + FACE)
        found = states.x[-1, i + 1], states.y[-1, i + 1], states.angle[-1, i + 1]
        np.testing.assert_allclose(found, (centre.real, centre.imag, angle), rtol=0, atol=3e-8)


def same(a, b, atol=1e-9):
    for field in ("x", "y", "angle", "tension"):
        np.testing.assert_allclose(getattr(a, field), getattr(b, field), rtol=0, atol=atol)


PULLS = [{"cable_1_n": 40.0, "tip_y_n": 1.0}, {"cable_1_n": 20.0, "cable_3_n": 30.0, "slip_1": 1.0}]
NOTHING = [
    effect("cable_friction", coefficient=0.3),
    effect("cable_friction", coefficient=0.3, cables=["1"]),
    effect("worn_hole", disk=3, coefficient=0.3, cables=["1"]),
    effect("pulley_friction", efficiency=1.0),
    effect("tension_offset", offset_n=0.0),
    effect("dead_cable", cable="4"),
    effect("load_cell"),
    effect("tension_drift", offset_n_per_step=0.0),
    effect("tension_play", play_n=0.0),
    effect("load_dependent_friction", exponent=0.0, tension_n=10.0),
    effect("wrap_saturation", saturation_per_rad=0.0),
    effect("camera_drift", x_m_per_step=1e-3),
    effect("stiffness_gradient", tip_to_base=1.0),
    effect("base_compliance", compliance_rad_per_n_m=0.0),
    effect("plate_softening", share_per_step=0.0),
    effect("umbilical", stiffness_n_m_per_rad=0.0),
    effect("hole_offset", cable="1", offset_m=0.0),
    effect("hole_clearance", clearance_m=0.0),
    effect("weakened_plate", plate=3, factor=1.0),
    effect("segment_stiffness", segment=2, factor=1.0),
    effect("nonlinear_plate", law="cubic", cubic_m2=0.0),
    effect("nonlinear_plate", law="bilinear", knee_per_m=1.0, ratio=1.0),
    effect("nonlinear_plate", law="smooth", knee_strain=1e-3, ratio=1.0, sharpness=3.0),
    effect("hysteretic_plate", slipping_share=0.0, yield_per_m=1.0),
    effect("hysteretic_plate", slipping_share=0.5, yield_per_m=30.0, elements=3),
    effect("superelastic_plate", plateau_strain=0.05),
    effect("notch_closing", factor=20.0, stiffness_n_m_per_rad=10.0),
    effect("precurvature", curvature_per_m=0.0),
    effect("disk_contact", angle_rad=0.01, stiffness_n_m_per_rad=0.0),
    effect("disk_contact", angle_rad=1.0, stiffness_n_m_per_rad=10.0),
    effect("clamp_compliance", compliance_rad_per_n_m=0.0),
    effect("cable_bending", stiffness_n_m2=0.0),
    effect("gravity", x_m_s2=0.0, y_m_s2=0.0),
    effect("tip_force", x_n=0.0, y_n=0.0),
    effect("tip_load_friction", efficiency=1.0),
    effect("weight_friction", efficiency=1.0),
]


def test_effects_vanish():
    for direction in ("declared", "history"):
        plain = simulate(prototype(plates=3, direction=direction), PULLS, elements=6)
        for what in NOTHING:
            same(plain, simulate(prototype(what, plates=3, direction=direction), PULLS, elements=6), atol=1e-7)


TIMED = [step | {"time_s": time} for step, time in zip(PULLS, (4.0, 6.0), strict=True)]
"""40 N to 20 N and nothing to 30 N in two seconds."""


@pytest.mark.parametrize(
    ("kind", "size", "others", "steps", "coefficients"),
    [  # 0.3 (1 + 0.05 ln 10) and 0.3 (1 + 0.05 ln 15); 0.3 (1 + 0.5 e^-1) and 0.3 (1 + 0.5 e^-1.5)
        ("rate_dependent_friction", {"rate": 0.05}, {}, TIMED, {"1": 0.33453878, "3": 0.34062075}),
        ("breakaway_friction", {"excess": 0.5}, {"decay_n": 20.0}, PULLS, {"1": 0.35518192, "3": 0.33346952}),
    ],
)
def test_friction_that_steps_tell_is_that_of_every_cables_own_rate_or_slide(kind, size, others, steps, coefficients):
    def rubs(**size):
        return effect(kind, **size, **others)

    found = simulate(prototype(rubs(**size), plates=3), steps, elements=6)
    rubbing = [effect("cable_friction", coefficient=mu, cables=[name]) for name, mu in coefficients.items()]
    by_hand = simulate(prototype(*rubbing, plates=3), PULLS, elements=6)
    for name in ("x", "y", "angle", "tension"):
        np.testing.assert_allclose(getattr(found, name)[1], getattr(by_hand, name)[1], rtol=0, atol=1e-7)
    plain = simulate(prototype(plates=3), PULLS, elements=6)
    nothing = rubs(**dict.fromkeys(size, 0.0))
    same(plain, simulate(prototype(nothing, plates=3), PULLS, elements=6))
    assert np.abs(found.tension[1] - plain.tension[1]).max() > 0.05
    with pytest.raises(SpecError, match="needs declared slip"):
        simulate(prototype(nothing, direction="history"), steps)


def test_the_first_step_has_no_rate():
    timed = simulate(prototype(effect("rate_dependent_friction", rate=0.05), plates=3), TIMED, elements=6)
    plain = simulate(prototype(plates=3), PULLS, elements=6)
    assert np.abs(timed.tension[0] - plain.tension[0]).max() < 1e-7


def test_effects_that_another_description_says():
    plain = prototype(coefficient=0.0)
    same(
        simulate(prototype(), PULLS), simulate({**plain, "effect": [effect("cable_friction", coefficient=0.3)]}, PULLS)
    )
    worn = [effect("worn_hole", disk=disk, coefficient=0.6, cables=["1"]) for disk in range(14)]
    rubbing = effect("cable_friction", coefficient=0.6, cables=["1"])
    same(simulate(prototype(rubbing), PULLS), simulate(prototype(*worn), PULLS))
    same(
        simulate(prototype(effect("slip_history", presliding_m=1e-4)), PULLS),
        simulate(prototype(direction="history", presliding_m=1e-4), PULLS),
    )
    same(simulate(prototype(effect("edge_wrap")), PULLS), simulate(prototype(wrap="edges"), PULLS))
    pulled = simulate(prototype(effect("tip_force", x_n=0.5, y_n=-1.0)), PULLS[:1])
    same(pulled, simulate(prototype(), [{"cable_1_n": 40.0, "tip_x_n": 0.5, "tip_y_n": 0.0}]))
    hung = {"cable_1_n": 20.0, "disk3_y_n": -0.8, "disk9_y_n": -0.4}
    half = simulate(prototype(effect("weight_friction", efficiency=0.5, disk=3)), [hung])
    same(half, simulate(prototype(), [hung | {"disk3_y_n": -0.4}]))
    lossy = simulate(prototype(effect("tip_load_friction", efficiency=0.9), effect("tip_force", x_n=0.5, y_n=0)), PULLS)
    same(
        lossy,
        simulate(prototype(), [step | {"tip_x_n": 0.5, "tip_y_n": 0.9 * step.get("tip_y_n", 0)} for step in PULLS]),
    )
    hanging = {f"disk{k}_y_n": -9.0 * 0.0447 for k in range(1, 15)}
    same(
        simulate(prototype(effect("gravity", x_m_s2=0.0, y_m_s2=-9.0)), PULLS[1:]),
        simulate(prototype(), [PULLS[1] | hanging]),
    )
    offset = prototype(effect("tension_offset", offset_n=-5.0, cables=["1", "4"]))
    same(simulate(offset, [{"cable_1_n": 40.0, "cable_4_n": 3.0}]), simulate(prototype(), [{"cable_1_n": 35.0}]))
    dead = prototype(effect("dead_cable", cable="1"), effect("cable_bending", stiffness_n_m2=0.02))
    live = prototype(effect("segment_stiffness", segment=1, factor=1 + 0.06 / RIGIDITY))
    live["effect"].append(effect("segment_stiffness", segment=2, factor=1 + 0.02 / RIGIDITY))
    same(simulate(dead, PULLS[1:]), simulate(live, [{"cable_3_n": 30.0}]))
    aside = prototype(effect("hole_offset", cable="1", offset_m=-0.002))
    aside["cable"][0]["offset_m"] = [0.0275, 0.0275]
    same(simulate(aside, PULLS), simulate(prototype(), PULLS))
    wide, shifted = (simulate(prototype(*each), PULLS[:1]) for each in ([effect("hole_clearance", clearance_m=1e-3)],
                     [effect("hole_offset", cable=name, offset_m=1e-3) for name in "1234"]))  # fmt: skip
    same(wide, shifted, atol=1e-5)
    twice = [effect("hole_clearance", clearance_m=c) for c in (4e-4, 6e-4)]
    same(simulate(prototype(*twice), PULLS[:1]), wide)


@pytest.mark.parametrize(("slip", "factor"), [(-1, 0.9), (0, 1), (1, 1 / 0.9)])
def test_pulley_loses_what_is_drawn_in(slip, factor):
    lossy = prototype(effect("pulley_friction", efficiency=0.9, cables=["1"]), coefficient=0)
    states = simulate(lossy, [{"cable_1_n": 20.0, "cable_2_n": 10.0, "slip_1": slip}])
    np.testing.assert_allclose(states.tension[0, 0, :2], [20 * factor, 10])


def test_worn_hole_rubs_at_its_disk_only():
    ratio = []
    for what in ([], [effect("worn_hole", disk=4, coefficient=1.0)]):
        manipulator = prototype(*what, coefficient=0.0)
        tension = simulate(manipulator, [{"cable_1_n": 20.0}]).tension[0, :, 0]
        ratio.append(tension[1:] / tension[:-1])
    np.testing.assert_allclose(np.delete(ratio[1], 3), np.delete(ratio[0], 3))
    assert ratio[1][3] < 0.98


def test_observation():
    states = simulate(prototype(), PULLS)
    x, y, angle = observe(prototype(effect("camera_scale", scale=1.01)), states)
    np.testing.assert_allclose((x, y, angle), (1.01 * states.x, 1.01 * states.y, states.angle))
    x, y, angle = observe(prototype(effect("lens_distortion", k1_per_m2=0.3)), states, image_centre=(0.2, 0.1))
    r2 = (states.x - 0.2) ** 2 + (states.y - 0.1) ** 2
    np.testing.assert_allclose(x, 0.2 + (states.x - 0.2) * (1 + 0.3 * r2))
    np.testing.assert_allclose(y, 0.1 + (states.y - 0.1) * (1 + 0.3 * r2))
    x, y, angle = observe(prototype(), states, frame=(np.pi / 2, 0.1, 0.2))
    np.testing.assert_allclose((x, y, angle), (0.1 - states.y, 0.2 + states.x, states.angle + np.pi / 2))
    moves = effect("camera_drift", y_m_per_step=1e-3, angle_rad_per_step=np.pi / 4)
    x, y, angle = observe(prototype(moves), states, before=1)  # by one eighth of a turn, then by a quarter
    np.testing.assert_allclose(x[0], (states.x[0] - states.y[0]) / np.sqrt(2), atol=1e-12)
    np.testing.assert_allclose(y[1], states.x[1] + 2e-3, atol=1e-12)
    np.testing.assert_allclose(angle[1], states.angle[1] + np.pi / 2)
    late = steps_passed([{"time_s": 5.0}, {"time_s": 20.0}, {"time_s": 6.0}])
    np.testing.assert_allclose(late, [0, 2, 2 / 15])
    turned = observe(prototype(moves), states, before=late[1:])[2]
    np.testing.assert_allclose(turned, states.angle + late[1:, None] * np.pi / 4)


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        (effect("pulley_friction", efficiency=1.2), "efficiency"),
        (effect("pulley_friction", efficiency=0.0), "efficiency"),
        (effect("pulley_friction", efficiency=0.9, cables="1"), "list"),
        (effect("worn_hole", disk=14, coefficient=0.3), "disk"),
        (effect("dead_cable", cable="5"), "cable"),
        (effect("dead_cable", cable=1), "cable"),
        (effect("weakened_plate", plate=0, factor=0.8), "plate"),
        (effect("weakened_plate", plate=3), "factor is missing"),
        (effect("weakened_plate", plate=3, factor=float("nan")), "factor"),
        (effect("slip_history", presliding_m=0.0), "presliding_m"),
        (effect("nonlinear_plate", law="cubic"), "cubic_m2"),
        (effect("nonlinear_plate", law="bilinear", knee_per_m=1.0), "ratio"),
        (effect("nonlinear_plate", law="bilinear", knee_per_m=1.0, ratio=0.0), "ratio"),
        (effect("nonlinear_plate", law="bilinear", knee_per_m=1.0, knee_strain=1e-3, ratio=0.5), "or knee_strain"),
        (effect("nonlinear_plate", law="smooth", knee_per_m=1.0, ratio=0.5), "sharpness"),
        (effect("hysteretic_plate", slipping_share=0.5), "yield_per_m or yield_strain"),
        (effect("hysteretic_plate", slipping_share=1.0, yield_per_m=1.0), "slipping_share"),
        (effect("hysteretic_plate", slipping_share=0.5, yield_per_m=1.0, elements=1.5), "elements"),
        (effect("superelastic_plate", plateau_strain=0.01, plateau_stress_pa=4e8), "either plateau_stress_pa or"),
        (effect("superelastic_plate", plateau_strain=0.01, tube_outer_m=1e-3), "together"),
        (effect("notch_closing", factor=1.0, stiffness_n_m_per_rad=1.0, side="up"), "side"),
        (effect("hole_clearence", clearance_m=0.1), "hole_clearance"),
        (effect("gravity", x_m_s2=0.0, y_m_s2=1.0, z_m_s2=2.0), "z_m_s2"),
    ],
)
def test_bad_effects_are_refused(bad, says):
    with pytest.raises(SpecError, match=says):
        simulate(prototype(bad), [])


def test_all_problems_are_said_at_once():
    with pytest.raises(SpecError) as refused:
        simulate(
            prototype(effect("moon"), effect("dead_cable", cable="5"), effect("edge_wrap"), effect("edge_wrap")), []
        )
    assert len(refused.value.problems) == 3
    without_mass = prototype(effect("gravity", x_m_s2=0.0, y_m_s2=1.0)) | {"disk": {"thickness_m": 0.004}}
    with pytest.raises(SpecError, match="mass_kg"):
        simulate(without_mass, [])
    with pytest.raises(SpecError, match="cable_9_n") as refused:
        simulate(prototype(), [{"cable_9_n": 1.0}, {"cable_1_n": -1.0}])
    assert len(refused.value.problems) == 2
