"""Limit loads against Euler, against a spring-hinged strut by hand, and against the eigenvalue's square-root law."""

import numpy as np
import pytest
from prototype import ELASTICA, PRB_1R, PRB_3R, cantilever, prototype
from scipy.optimize import brentq

from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.limit import limit_load
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import solve

NO_CABLES = np.zeros((1, 0))


@pytest.mark.parametrize(("plates", "plate", "tolerance"), [(8, ELASTICA, 1e-6), (8, PRB_3R, 1e-3), (1, PRB_1R, 0.2)])
def test_euler_column(plates, plate, tolerance):
    """pi^2 EI / (4 L^2); one spring in the middle buckles at 2 K / L."""
    chain = cantilever(plates, plate)
    limit = limit_load(chain, loads(chain, NO_CABLES, tip=(-1, 0)), from_rest=True)
    assert limit.factor == pytest.approx(np.pi**2 / 4 if plate is not PRB_1R else 2.0, rel=tolerance)
    assert limit.outcome == Outcome.UNSTABLE


def test_a_pulled_column_has_no_limit():
    chain = cantilever(4)
    limit = limit_load(chain, loads(chain, NO_CABLES, tip=(1, 0)), from_rest=True, most=50.0)
    assert limit == (np.inf, Outcome.CONVERGED)


def strut_snaps_at(push, rest):
    """Side force at which a strut (spring 1, arm 1/2) that `push` holds on one side snaps to the other, by hand.

    Balance: angle - rest = (push sin - side cos) / 2; there the two sides touch: 1 = (push cos + side sin) / 2.
    """
    side = lambda angle: (push * np.sin(angle) / 2 - angle + rest) / (np.cos(angle) / 2)  # noqa: E731
    flat = lambda angle: push * np.cos(angle) + side(angle) * np.sin(angle) - 2  # noqa: E731
    return side(brentq(flat, 1e-3, 1.4))


@pytest.mark.parametrize("push", [2.5, 2.8, 3.0])
def test_a_strut_snaps_through(push):
    rest = 0.05
    chain = cantilever(1, PRB_1R)._replace(rest=np.array([[rest]]))
    tip = np.array([[-push, 0], [-push, -3.0], [-push, -2.9]])
    states = solve_chain(chain, loads(chain, np.zeros((3, 0)), tip=tip), eigenvalue=True)
    assert list(states.outcome) == [Outcome.CONVERGED, Outcome.LIMIT_POINT, Outcome.LIMIT_POINT]
    assert 3.0 * states.reached[1] == pytest.approx(strut_snaps_at(push, rest), rel=1e-4)
    assert "would jump; reached" in states.reason(1)
    assert np.isnan(states.x[1, 1])


def test_what_is_solved_after_a_jump_says_that_it_leaves_out_a_step():
    chain = cantilever(1, PRB_1R)._replace(rest=np.array([[0.05]]))
    tip = np.array([[-3.0, 0], [-3.0, -3.0], [-3.0, -0.1], [-3.0, -0.1]])
    steps = loads(chain, np.zeros((4, 0)), tip=tip)
    states = solve_chain(chain, steps, eigenvalue=True)
    assert list(states.outcome[2:]) == [Outcome.DETOUR] * 2
    anew = solve_chain(chain, steps, eigenvalue=True, from_rest=np.array([0, 0, 0, 1], bool))
    assert anew.outcome[3] == Outcome.CONVERGED


def test_growing_loads_end_where_the_eigenvalue_falls_to_zero():
    """Tip load against cables, from rest and from a step on the way: the eigenvalue falls like a square root."""
    chain = prototype(0)
    whole = loads(chain, [[0, 0, 60, 150]], tip=(3, 10))
    limit = limit_load(chain, whole, from_rest=True)
    assert limit.outcome == Outcome.LIMIT_POINT
    near = limit.factor * (1 - np.array([8e-3, 4e-3]))
    states = solve_chain(
        chain, loads(chain, near[:, None] * [0, 0, 60, 150], tip=near[:, None] * [3, 10]), eigenvalue=True
    )
    first, second = states.lowest_eigenvalue**2
    assert near[1] + (near[1] - near[0]) * second / (first - second) == pytest.approx(limit.factor, rel=1e-3)
    half = loads(chain, [[0, 0, 30, 75]], tip=(1.5, 5))
    assert 0.5 * limit_load(chain, half).factor == pytest.approx(limit.factor, rel=1e-5)


def test_loads_beyond_the_limit_have_no_factor():
    chain = cantilever(8)
    assert np.isnan(limit_load(chain, loads(chain, NO_CABLES, tip=(-3, 0))).factor)


def test_friction_with_history_shifts_the_limit():
    """Cables that stick hold the strut: its limit is no lower than with declared friction, and found all the same."""
    chain = prototype(0.3)._replace(presliding=1e-4)
    limit = limit_load(chain, loads(chain, [[0, 0, 60, 150]], tip=(3, 10)), from_rest=True, tolerance=1e-3)
    assert 0.5 < limit.factor < 1.5
    assert limit.outcome != Outcome.CONVERGED


def test_a_branch_that_ends_is_not_jumped_over():
    """Plates soften until one would snap onto its disk: one step ends where two hundred steps of the same way end."""
    bending = {"kind": "nonlinear_plate", "law": "smooth", "knee_per_m": 8.7, "ratio": 0.028, "sharpness": 4.8}
    touching = {"kind": "disk_contact", "angle_rad": 0.365, "stiffness_n_m_per_rad": 20.4}
    plates = {"length_m": 0.03, "clamp_m": 0.008, "width_m": 0.03}
    arm = {
        "name": "arm",
        "youngs_modulus_pa": 1.87e11,
        "disk": {"thickness_m": 0.004},
        "friction": {"coefficient": 0.1},
        "segment": [plates | {"plates": 3, "thickness_m": 3.62e-4}, plates | {"plates": 1, "thickness_m": 6.02e-4}],
        "cable": [
            {"name": "1", "offset_m": 0.0255, "ends_at_segment": 2},
            {"name": "2", "offset_m": -0.021, "ends_at_segment": 1},
        ],
        "effect": [bending, touching, {"kind": "precurvature", "curvature_per_m": -3.54}],
    }

    def outcomes(count):
        share = np.linspace(0, 1, count + 1)
        pulls = {"cable_1_n": 1.475 + share * 9.517, "cable_2_n": 7.93 - share * 4.594, "slip_1": 1.0}
        slips = {"slip_2": np.where(share == 0, -1.0, 1.0)}
        states = solve(Manipulator(**arm), {"sequence": "a", "step": np.arange(count + 1)} | pulls | slips)
        return states.groupby("step")["outcome"].last().tolist()

    assert outcomes(1) == ["converged", "limit point"]
    assert outcomes(200)[:184] == ["converged"] * 184
    assert outcomes(200)[184] == "limit point"


def test_a_column_that_relaxes_buckles_under_the_load_that_is_left_after_a_step():
    """Euler's load times what the plates bear of their moment when each load has been held for a step."""
    share, time = 0.4, 2.0
    chain = cantilever(4)._replace(relaxation=share, relaxation_time=time)
    limit = limit_load(chain, loads(chain, NO_CABLES, tip=(-1, 0)), from_rest=True)
    left = 1 + share * np.expm1(-1 / time)
    assert limit.factor == pytest.approx(left * np.pi**2 / 4, rel=1e-4)
