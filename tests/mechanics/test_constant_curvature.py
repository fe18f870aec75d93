"""Constant curvature as a static model: one bend per segment by virtual work."""

import numpy as np
import pytest
from mechanics.differences import aging, worst_errors
from prototype import ELASTICA, LENGTH, prototype, random_chain, random_loads, row, tip_face

from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.reference import constant_curvature_pose
from prb3r.model.manipulator import Manipulator


def tied(chain):
    return chain._replace(tied=True)


def potential_energy(chain, step, bends):
    """Elastic energy of circular arcs, plus what cables, dead weights and moments would give, without friction, J."""
    pose = constant_curvature_pose(chain, bends)
    axis, centre = np.exp(1j * pose.angle), pose.x + 1j * pose.y
    distal, proximal = centre + chain.disk / 2 * axis, centre - chain.disk / 2 * axis
    rigidity = chain.stiffness[:, 0] / chain.plate.stiffness[0]  # EI / l
    energy = np.sum(rigidity * (bends - chain.rest.sum(1)) ** 2) / 2
    for j, reach in enumerate(chain.reach):
        hole = 1j * axis[:-1] * chain.offset[:, j]
        arrival = 1j * axis[1:] * chain.offset[:, j]
        spans = np.abs(proximal[1:] + arrival - distal[:-1] - hole)
        energy += step.tension[j] * spans[:reach].sum()
    weights = step.force @ (1, 1j)
    energy -= (weights.conj() @ centre[1:] + complex(*step.tip).conjugate() * distal[-1]).real
    return energy - step.moment @ bends


@pytest.mark.parametrize("seed", range(6))
def test_potential_energy_is_stationary_in_the_bend_of_each_segment(seed):
    rng = np.random.default_rng([seed, 2])
    chain = tied(random_chain(rng, ELASTICA, plates=7))
    chain = chain._replace(rest=rng.uniform(-0.1, 0.1, 2)[chain.segment, None] / ELASTICA.stiffness)
    steps = random_loads(rng, chain, dead=0.2)._replace(slip=np.zeros((1, 3)))
    states = solve_chain(chain, steps)
    assert states.outcome[0] == Outcome.CONVERGED
    bends = np.diff(states.angle[0])
    for segment in (0, 1):
        member = chain.segment == segment
        assert bends[member] == pytest.approx(bends[member][0])  # tied
        change = 1e-4 * member
        less, here, more = (potential_energy(chain, row(steps), bends + sign * change) for sign in (-1, 0, 1))
        slope, curvature = (more - less) / 2e-4, (more - 2 * here + less) / 1e-8
        assert abs(slope) < 1e-6 * curvature  # no more than 1e-6 rad away from the minimum


def test_one_frictionless_cable_bends_almost_to_circles():
    """Fig. 9: the elastica equals circular arcs of the same total angle within 0.01 % of length."""
    elastica = prototype(mu=0, plate=ELASTICA)
    steps = loads(elastica, np.linspace(10, 150, 8)[:, None] * [1, 0, 0, 0])
    exact, arcs = solve_chain(elastica, steps), solve_chain(tied(elastica), steps)
    assert arcs.angle[:, -1] == pytest.approx(exact.angle[:, -1], rel=1e-3)
    same = constant_curvature_pose(elastica, np.diff(exact.angle).mean(-1, keepdims=True) * np.ones(14))
    assert np.abs(tip_face(elastica, same) - tip_face(elastica, exact)).max() < 1e-4 * LENGTH


@pytest.mark.parametrize("mu", [0.1, 0.3, 0.8])
def test_capstan_with_equal_spans_and_the_base_hole_counted(mu):
    """T_n / T_0 = exp(-mu theta (n - 1/2) / n): half a turn at the base, whole turns at all other holes."""
    chain = tied(prototype(mu, plate=ELASTICA))._replace(reach=np.array([14, 0, 0, 0]), segment=np.zeros(14, int))
    states = solve_chain(chain, loads(chain, [80, 0, 0, 0]))
    theta, n = states.angle[0, -1], np.arange(1, 15)
    assert states.tension[0, :, 0] == pytest.approx(80 * np.exp(-mu * theta * (n - 0.5) / 14))


def test_cables_pulled_evenly_in_pairs_leave_both_segments_straight():
    chain = tied(prototype(0.3, plate=ELASTICA))
    states = solve_chain(chain, loads(chain, [30, 20, 20, 30]))
    assert np.abs(states.angle).max() < 1e-12


@pytest.mark.parametrize("dead", [0.0, 0.4])
def test_derivatives_of_tied_angles_are_differences_of_whole_solves(dead):
    rng = np.random.default_rng(10)
    chain = tied(random_chain(rng, ELASTICA))._replace(clearance=1e-3)
    worst = worst_errors(chain, aging(random_loads(rng, chain, 3, dead=dead)))
    assert max(worst.values()) < 1e-5, worst


def test_what_is_left_unbalanced_is_a_moment():
    """A chain a million times as stiff under a million times the tension has the same shape, and as much more left."""
    chain = tied(prototype(plate=ELASTICA))
    left = []
    for scale in (1.0, 1e6):
        scaled = chain._replace(stiffness=scale * chain.stiffness)
        pulls = scale * np.random.default_rng(3).uniform(0, 30, (40, len(chain.reach)))
        left.append(solve_chain(scaled, loads(scaled, pulls), from_rest=True).residual)
    assert 1e4 < np.median(left[1]) / np.median(left[0]) < 1e8
    assert np.max(left[0]) < 1e-8


def test_a_thin_segment_beside_a_thick_one_bends_as_the_smallest_force_asks():
    """Closed form: a couple F (l^2 / 2 + l t) bends the thin plate, t the thickness of the disk that the force acts on.

    The thick segment is 1.25e8 times as stiff: what is left to balance must not be measured by it.
    """
    thick, thin = ({"plates": 1, "length_m": 0.05, "width_m": 0.01, "thickness_m": t} for t in (0.05, 1e-4))
    manipulator = Manipulator(
        name="thick and thin",
        model="constant-curvature",
        youngs_modulus_pa=2e11,
        disk={"thickness_m": 1e-3, "mass_kg": 0.0},
        friction={"coefficient": 0.0},
        segment=[thick | {"clamp_m": 0.0}, thin | {"clamp_m": 0.0}],
        cable=[{"name": "1", "offset_m": 0.03, "ends_at_segment": 2}],
    )
    chain = manipulator.chain()
    forces = np.array([1e-6, 1e-4, 1e-2])
    states = solve_chain(chain, loads(chain, np.zeros((3, 1)), tip=forces[:, None] * [0, 1]))
    rigidity = 2e11 * 0.01 * 1e-4**3 / 12
    expected = forces * (0.05**2 / 2 + 0.05 * 1e-3) / rigidity
    assert states.angle[:2, -1] == pytest.approx(expected[:2], rel=1e-6)
    assert states.angle[2, -1] == pytest.approx(expected[2], rel=2e-3)
