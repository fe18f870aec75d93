"""The effects of the rig where they vanish, and where another description says the same."""

import numpy as np
import pytest
from rigs import RIGIDITY, effect, prototype

from prb3r.errors import SpecError
from prb3r.proof.rig.simulate import observe, simulate, steps_passed


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
    effect("hole_drag", drag_n=0.0),
    effect("camera_drift", x_m_per_step=1e-3),
    effect("stiffness_gradient", tip_to_base=1.0),
    effect("tip_mass", mass_kg=0.2),
    effect("base_tilt", angle_rad=0.0),
    effect("base_compliance", compliance_rad_per_n_m=0.0),
    effect("plate_softening", share_per_step=0.0),
    effect("plate_relaxation", share=0.0, steps=3.0),
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
    effect("precurvature_gradient", change_per_m=0.0),
    effect("disk_contact", angle_rad=0.01, stiffness_n_m_per_rad=0.0),
    effect("disk_contact", angle_rad=1.0, stiffness_n_m_per_rad=10.0),
    effect("clamp_compliance", compliance_rad_per_n_m=0.0),
    effect("cable_bending", stiffness_n_m2=0.0),
    effect("gravity", x_m_s2=0.0, y_m_s2=0.0),
    effect("tip_force", x_n=0.0, y_n=0.0),
    effect("tip_load_friction", efficiency=1.0),
    effect("weight_friction", efficiency=1.0),
]


@pytest.mark.long
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
        ("friction_drift", {"share_per_step": 0.3}, {}, PULLS, {"1": 0.39, "3": 0.39}),
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
    x, y, angle = observe(prototype(effect("camera_aspect", y_over_x=0.96)), states)
    np.testing.assert_allclose((x, y, angle), (states.x, 0.96 * states.y, states.angle))
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
