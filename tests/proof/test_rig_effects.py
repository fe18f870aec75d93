"""The effects of the rig: every law in a second integration of its plates."""

import numpy as np
import pytest
from numba import typeof
from rigs import FACE, RIGIDITY, effect, short, spans
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from prb3r.proof.rig.build import build_rig
from prb3r.proof.rig.simulate import simulate

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
    (effect("precurvature_gradient", change_per_m=3.0), lambda k: k),
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
        free = what.get("change_per_m", 0) * (i - 1) / 2 - (2.0 if i + 1 in what.get("plates", []) else 0)

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
