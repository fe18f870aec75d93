"""The references against numbers that others published or that follow by hand."""

import numpy as np
import pytest
from prototype import cantilever, prototype, row, shift, tip_face

from prb3r.mechanics.chain import Loads, loads, pose
from prb3r.mechanics.plate import gauss_collocation
from prb3r.mechanics.reference import (
    constant_curvature_pose,
    elastica_shooting,
    integral_fsolve,
    seed_fsolve,
    seed_residual,
    wrench,
)

G = 9.785
RAMP = np.linspace(0.25, 1, 4)[:, None]


def spring_pose(chain, tension, slip=-1.0):
    """The chain of springs under `tension` reached in four equal steps."""
    return pose(chain, seed_fsolve(chain, loads(chain, RAMP * np.asarray(tension, float), slip))[0][-1])


@pytest.mark.parametrize(
    ("force", "deflection", "shortening", "slope"),
    [
        (1, 0.30172, 0.05643, 0.46135),
        (2, 0.49346, 0.16064, 0.78175),
        (5, 0.71379, 0.38763, 1.21537),
        (10, 0.81061, 0.55500, 1.43029),
    ],
)
def test_shooting_meets_mattiasson_1981(force, deflection, shortening, slope):
    chain = cantilever()
    bends, pose = elastica_shooting(chain, row(loads(chain, np.zeros((1, 0)), tip=(0, force))))
    assert [pose.y[-1], 1 - pose.x[-1], bends[0]] == pytest.approx([deflection, shortening, slope], abs=6e-6)


def test_table_2_springs_integral_model_and_shooting():
    chain = prototype(mu=0)
    steps = loads(chain, np.array([10, 70, 120, 200])[:, None] * [1, 0, 0, 0])
    springs = tip_face(chain, pose(chain, seed_fsolve(chain, steps)[0]))
    bends, quadrature, _ = integral_fsolve(chain, steps)
    integral = tip_face(chain, quadrature)
    worst = np.abs(springs - integral).max() / chain.length
    assert 0.00077 < worst < 0.00081  # paper: 0.081 %
    for index in (0, -1):
        exact, shape = elastica_shooting(chain, row(steps, index))
        assert exact == pytest.approx(bends[index], abs=1e-9)
        assert abs(tip_face(chain, shape) - integral[index]) < 1e-9 * chain.length


def test_integral_model_equals_shooting_with_friction_two_cables_and_tip_load():
    chain = prototype()
    steps = loads(chain, RAMP * [40, 30, 0, 0], (-1, 1, -1, -1), tip=RAMP * [0.5, 1.0])
    bends, _, _ = integral_fsolve(chain, steps)
    exact, _ = elastica_shooting(chain, row(steps))
    assert np.ptp(exact) > 0.05
    assert bends[-1] == pytest.approx(exact, abs=1e-8)


def test_collocated_elastica_equals_shooting_under_all_loads():
    """The plate model of the solver inside the paper's method, against an initial value problem per plate."""
    chain, dead = prototype(plate=gauss_collocation(5)), np.linspace([0, -0.3], [0.2, 0.1], 14)
    steps = loads(chain, RAMP * [60, 30, 10, 20], (-1, 1, -1, 1), RAMP[:, None] * dead, RAMP * [-1.0, 0.8])
    exact, shape = elastica_shooting(chain, row(steps))
    q, _ = seed_fsolve(chain, steps)
    assert q[-1].sum(-1) == pytest.approx(exact, abs=1e-9)
    assert abs(tip_face(chain, pose(chain, q[-1])) - tip_face(chain, shape)) < 1e-9 * chain.length


def test_integral_model_refuses_what_it_cannot_state():
    chain = prototype()
    with pytest.raises(ValueError, match="straight"):
        integral_fsolve(chain, loads(chain, np.zeros(4)))
    with pytest.raises(ValueError, match="inflection"):
        integral_fsolve(prototype(mu=0), loads(chain, [20, 0, 0, 0], tip=(0, -2.3)))


def test_constant_curvature_is_eq_13_and_14():
    chain, bend = prototype(), 0.13
    radius = 0.014 / bend + 0.008 / np.tan(bend) + 0.008 / np.sin(bend)
    matrix = np.array(
        [
            [np.cos(bend), -np.sin(bend), radius * np.sin(bend) + 0.004 * np.cos(bend)],
            [np.sin(bend), np.cos(bend), radius * (1 - np.cos(bend)) + 0.004 * np.sin(bend)],
            [0, 0, 1],
        ]
    )
    tip = np.linalg.matrix_power(matrix, 14) @ [-0.002, 0, 1]
    arcs = constant_curvature_pose(chain, np.full((2, 14), [[bend], [0]]))
    assert [arcs.x[0, -1], arcs.y[0, -1]] == pytest.approx(tip[:2])
    assert arcs.x[1] == pytest.approx(0.034 * np.arange(15) - 0.002)


def test_figure_9_without_friction_springs_follow_constant_curvature():
    chain = prototype(mu=0)
    springs = spring_pose(chain, [100, 0, 0, 0])
    arcs = constant_curvature_pose(chain, np.full(14, springs.angle[-1] / 14))
    assert shift(springs, arcs, -1) < 1.5e-4 * chain.length


def test_wrench_is_eq_5_to_10_plate_by_plate():
    """A plain loop in world coordinates: cut plate i, sum what acts beyond the cut about its proximal disk."""
    chain, rng = prototype(), np.random.default_rng(7)
    chain = chain._replace(offset=chain.offset * rng.uniform(0.9, 1.1, (14, 1)))
    tip, none = np.array([1.0, -2.0]), np.zeros(14)
    step = Loads(
        rng.uniform(10, 50, 4),
        np.array([-1, 1, 0.5, -0.2]),
        rng.normal(size=(14, 2)),
        tip,
        none,
        none[:1],
        none[:4],
        none[:4],
        none[:1],
    )
    disks = pose(chain, rng.normal(size=(14, 3)) / 10)
    axis = np.exp(1j * disks.angle)
    centre = disks.x + 1j * disks.y
    distal, proximal = centre + 0.002 * axis, centre - 0.002 * axis
    force, moment = wrench(chain, step, (np.diff(disks.angle), (proximal[1:] - distal[:-1]) / axis[:-1]))
    cross = lambda a, b: (a.conjugate() * b).imag  # noqa: E731
    tension, before = step.tension.copy(), np.zeros(4)
    for i in range(14):
        dead = [*(step.force[i:] @ (1, 1j)), step.tip @ (1, 1j)]
        total = sum(dead)
        about = sum(cross(s - distal[i], f) for s, f in zip([*centre[i + 1 :], distal[-1]], dead, strict=True))
        for j in np.flatnonzero(i < chain.reach):
            hole = distal[i] + 1j * axis[i] * chain.offset[i, j]
            arrival = proximal[i + 1] + 1j * axis[i + 1] * chain.offset[i, j]
            direction = np.angle(arrival - hole)
            turning = abs(np.angle(np.exp(1j * (direction - before[j]))))
            tension[j] *= np.exp(step.slip[j] * chain.friction[i, j] * turning)
            pull = tension[j] * (hole - arrival) / abs(hole - arrival)
            total += pull
            about += cross(arrival - distal[i], pull)
            before[j] = direction
        assert force[i] * axis[i] == pytest.approx(total)
        assert moment[i] == pytest.approx(about)


def test_capstan():
    """Equal bends make equal spans: T_n = T_0 exp(-mu theta (n - 1/2) / n), the base hole counted."""
    chain = prototype()._replace(reach=np.array([14, 0, 0, 0]))
    theta, step = 1.2, row(loads(chain, [50, 0, 0, 0]))
    arcs = constant_curvature_pose(chain._replace(disk=0.0), np.full(14, theta / 14))
    end = np.diff(arcs.x + 1j * arcs.y) / np.exp(1j * arcs.angle[:-1])
    force, _ = wrench(chain, step, (np.diff(arcs.angle), end))
    assert abs(force[-1]) / 50 == pytest.approx(np.exp(-0.3 * theta * 13.5 / 14))


def test_seed_residual_vanishes_under_tip_load_and_idle_steps():
    chain = prototype()
    steps = loads(chain, [[0, 0, 0, 0], [49, 0, 0, 0]], tip=[[0, 0], [0, -4.9]])
    q, calls = seed_fsolve(chain, steps)
    assert not q[0].any()
    assert calls > 40
    assert np.abs(seed_residual(chain, row(steps), q[1])).max() < 1e-7


@pytest.mark.parametrize(
    ("mu", "disk_7", "tip"),
    [(0.1, 5.6, 26.2), (0.2, 11.2, 52.7), (0.3, 16.9, 79.9), (0.4, 22.8, 108.0), (0.5, 29.0, 137.7)],
)
def test_figure_12_shift_between_pulling_orders(mu, disk_7, tip):
    """The cable pulled first is paid out while the later one is drawn in."""
    chain, tension = prototype(mu), [2.5 * G, 0, 10 * G, 0]
    first_1, first_3 = (spring_pose(chain, tension, slip) for slip in ([1, 0, -1, 0], [-1, 0, 1, 0]))
    assert shift(first_1, first_3, 7) * 1e3 == pytest.approx(disk_7, abs=0.06)
    assert shift(first_1, first_3, 14) * 1e3 == pytest.approx(tip, abs=0.06)
    if mu == 0.3:  # the paper prints 80.47 mm
        assert abs(tip_face(chain, first_1) - tip_face(chain, first_3)) * 1e3 == pytest.approx(80.5, abs=0.05)


@pytest.mark.parametrize("mu", [0, 0.3])
def test_figure_14_changing_point(mu):
    """Segment 1 is straight where the moments of cables 2 and 4 cancel."""
    chain, balance = prototype(mu), 50 * 0.0255 / 0.021
    below, straight, above = (
        pose(chain, seed_fsolve(chain, loads(chain, [0, tension, 0, 50]))[0][0]).angle
        for tension in (balance - 0.1, balance, balance + 0.1)
    )
    assert np.abs(straight[:8]).max() < 1e-12
    assert straight[14] < -0.1
    assert below[7] < -5e-4
    assert above[7] > 5e-4


def test_figure_14_shape():
    chain, shifts = prototype(), []
    for tension in (20, 60, 70, 80, 100, 120):
        before = spring_pose(chain, [0, tension, 0, 0])
        after = spring_pose(chain, [0, tension, 0, 50], [-1, 1, -1, -1])
        shifts.append(1e3 * shift(before, after, 7))
    assert shifts[:2] == pytest.approx([59.5, 59.5], abs=0.6)
    assert shifts[2:] == pytest.approx([57.2, 54.3, 47.0, 37.7], abs=0.06)


def test_figure_15_stiffness_against_coupling():
    for stiffness, published in ((1, [11.7, 22.8, 33.3]), (8, [1.5, 3.0, 4.4])):
        chain = prototype(first_segment=stiffness)
        q, _ = seed_fsolve(chain, loads(chain, np.array([20, 40, 60])[:, None] * [1, 0, 0, 0]))
        assert np.degrees(pose(chain, q).angle[:, 7]) == pytest.approx(published, abs=0.06)
