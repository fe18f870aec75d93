"""Plates that relax: creep under a steady moment in closed form, recovery, what is remembered, and derivatives."""

import numpy as np
import pytest
from differences import aging, worst_errors
from prototype import ELASTICA, PRB_3R, cantilever, prototype

from prb3r.mechanics.chain import loads
from prb3r.mechanics.derivatives.sensitivity import chain_sensitivities, direction
from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.plate_law import Law

SHARE, TIME = 0.3, 4.0


def relaxing(chain, share=SHARE, time=TIME):
    return chain._replace(relaxation=share, relaxation_time=time)


def bends(moments, elapsed, plate=ELASTICA, **options):
    """Bend of one plate of unit length and rigidity under moments at given times: its curvature."""
    chain = relaxing(cantilever(1, plate))
    steps = loads(chain, np.zeros((len(moments), 0)), moment=np.array(moments, float)[:, None])
    found = solve_chain(chain, steps._replace(elapsed=np.array(elapsed, float)[:, None]), **options)
    assert (found.outcome == Outcome.CONVERGED).all()
    return found.angle[:, -1]


@pytest.mark.parametrize("plate", [ELASTICA, PRB_3R], ids=["elastica", "springs"])
def test_under_a_steady_moment_a_plate_creeps_as_the_standard_linear_solid(plate):
    """M = E k - m and m' = (share E k - m) / time give k = M / E (1 + J (1 - exp(-(1 - share) t / time))) with
    J = share / (1 - share).  An update once per step errs in proportion to its length."""
    errors = []
    for parts in (20, 40):
        time = np.arange(1, parts * 10 + 1) / parts
        chain = relaxing(cantilever(1, plate), time=TIME * parts)
        steps = loads(chain, np.zeros((len(time), 0)), moment=0.1)
        found = solve_chain(chain, steps._replace(elapsed=np.arange(len(time), dtype=float)[:, None]))
        elastic = solve_chain(chain._replace(relaxation=0.0), steps).angle[:, -1]
        bend = found.angle[:, -1] / elastic
        creep = 1 + SHARE / (1 - SHARE) * -np.expm1(-(1 - SHARE) * time / TIME)
        errors.append(np.abs(bend - creep).max())
    assert errors[0] < 0.004
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.05)


def test_long_after_a_change_the_plate_has_the_stiffness_that_does_not_relax():
    bend = bends([0.2, 0.2, 0.0, 0.0], [0, 500, 501, 1001])
    assert bend[1] == pytest.approx(0.2 / (1 - SHARE), rel=1e-12)
    assert bend[2] > 0.01  # just let go
    assert bend[3] == pytest.approx(0, abs=1e-12)


def test_a_first_step_takes_as_long_as_a_mean_one_and_a_new_sequence_forgets():
    anew = np.array([False, False, True])
    bend = bends([0.2, 0.3, 0.2], [0, 1, 2], from_rest=anew)
    follows = -np.expm1(-1 / TIME)
    assert bend[0] == pytest.approx(0.2 / (1 - follows * SHARE), rel=1e-12)
    assert bend[2] == bend[0]


def test_a_time_constant_in_seconds_is_the_same_at_any_pace_and_through_any_break():
    """Two sequences of three steps, an hour apart: a step lasts 10 s, and as many seconds at half the pace pass in
    twice as many steps."""
    chain = relaxing(cantilever(1))._replace(relaxation_step=10.0)

    def bend(time, anew):
        rows = np.array(time)[:, None]
        steps = loads(chain, np.zeros((len(rows), 0)), moment=0.2)._replace(elapsed=rows / np.ptp(rows), time=rows)
        return solve_chain(chain, steps, from_rest=np.array(anew)).angle[:, -1]

    quick = bend([5.0, 15.0, 25.0, 3600.0, 3610.0, 3620.0], [True, False, False] * 2)
    assert quick[3:] == pytest.approx(quick[:3], rel=1e-12)
    assert quick[:3] == pytest.approx(bends([0.2] * 3, [0, 1, 2]), rel=1e-12)
    slow = bend([10.0, 30.0, 50.0], [True, False, False])
    assert slow[1:] == pytest.approx(bends([0.2] * 3, [0, 2, 4])[1:], rel=1e-12)
    unknown = loads(chain, np.zeros((3, 0)), moment=0.2)._replace(elapsed=np.arange(3.0)[:, None])
    assert solve_chain(chain, unknown).angle[:, -1] == pytest.approx(quick[:3], rel=1e-12)


def test_the_time_of_a_step_without_equilibrium_is_not_lost():
    """A plate that softens to nothing has no state at the second step; the third goes on from the first."""
    chain = relaxing(cantilever(1))._replace(law=Law(knee=0.5, ratio=1e-9))
    steps = loads(chain, np.zeros((3, 0)), moment=np.array([0.1, 0.7, 0.1])[:, None])
    found = solve_chain(chain, steps._replace(elapsed=np.arange(3.0)[:, None]))
    assert np.isnan(found.angle[1, -1])
    assert found.angle[2, -1] == pytest.approx(bends([0.1, 0.1], [0, 2])[1], rel=1e-12)


def test_a_softening_law_relaxes_as_a_whole():
    """At rest in the long run a plate bears what its law gives, less the relaxed share."""
    law = Law(knee=0.2, ratio=0.5)
    chain = relaxing(cantilever(1))._replace(law=law)
    steps = loads(chain, np.zeros((2, 0)), moment=0.3)
    steps = steps._replace(elapsed=np.array([[0.0], [800.0]]))
    bend = solve_chain(chain, steps).angle[1, -1]
    assert 0.2 + 0.5 * (bend - 0.2) == pytest.approx(0.3 / (1 - SHARE), rel=1e-9)


CHAINS = {
    "declared": relaxing(prototype()),
    "soft": relaxing(prototype())._replace(law=Law(knee=2.5, ratio=0.6, sharpness=4.0)),
    "along the path": relaxing(prototype())._replace(presliding=3e-5),
    "tied": relaxing(prototype())._replace(tied=True),
}


@pytest.mark.parametrize(
    "name", ["soft", *(pytest.param(name, marks=pytest.mark.long) for name in CHAINS if name != "soft")]
)
def test_derivatives_are_those_of_whole_solves(name):
    chain = CHAINS[name]
    tension = np.zeros((5, 4))
    tension[:, 0], tension[:, 2] = (10, 25, 30, 20, 5), (0, 0, 5, 12, 20)
    if name == "along the path":  # without turns, at which sub-steps change with parameters
        tension[:, 0], tension[:, 2] = (10, 20, 30, 40, 50), 0
    steps = aging(loads(chain, tension, slip=-1.0))
    names = {"stiffness", "one plate", "friction", "offset", "softening", "tension", "law", "rest"}
    if name == "tied":
        names -= {"law"}
    errors = worst_errors(chain, steps, sorted(names))
    assert max(errors.values()) < 1e-5, errors


@pytest.mark.parametrize("name", ["relaxation", "relaxation_time"])
def test_derivatives_by_share_and_time_are_those_of_whole_solves(name):
    chain = CHAINS["soft"]
    tension = np.zeros((5, 4))
    tension[:, 0], tension[:, 2] = (10, 25, 30, 20, 5), (0, 0, 5, 12, 20)
    steps, value, step = aging(loads(chain, tension)), getattr(chain, name), 1e-4

    def problem(v):
        return chain._replace(**{name: v}), steps

    found = chain_sensitivities(chain, steps, [direction(problem, value, 1e-6)])
    ahead, behind = (solve_chain(*problem(value + side * step)) for side in (1, -1))
    expected = (ahead.angle - behind.angle) / (2 * step)
    assert np.abs(found.dangle[..., 0] - expected).max() < 1e-6 * np.abs(expected).max()


def test_derivatives_go_by_the_seconds_that_have_passed():
    """Half as many steps, each twice as long, are the same time constant; by its unit nothing is differentiated."""
    chain, tension = CHAINS["soft"], np.zeros((5, 4))
    tension[:, 0] = 10, 25, 30, 20, 5
    timed = loads(chain, tension)._replace(time=np.array([3.0, 9.0, 11.0, 30.0, 34.0])[:, None])
    paced = chain._replace(relaxation_step=5.0)
    errors = worst_errors(paced, timed, ["friction", "stiffness", "tension"])
    assert max(errors.values()) < 1e-5, errors
    same = chain._replace(relaxation_step=10.0, relaxation_time=TIME / 2)
    assert solve_chain(same, timed).angle[:, -1][1:] != pytest.approx(solve_chain(chain, timed).angle[:, -1][1:])

    def problem(v):
        return paced._replace(relaxation_step=v), timed

    with pytest.raises(ValueError, match="changes the kind"):
        chain_sensitivities(paced, timed, [direction(problem, 5.0, 1e-6)])


@pytest.mark.parametrize("tied", [False, True])
def test_a_plate_bears_the_moment_that_acts_however_far_it_has_crept(tied):
    """Statics: the same while it creeps, and nothing once it is let go."""
    chain = relaxing(cantilever(1))._replace(tied=tied)
    steps = loads(chain, np.zeros((4, 0)), moment=np.array([0.2, 0.2, 0.2, 0.0])[:, None])
    found = solve_chain(chain, steps._replace(elapsed=np.arange(4.0)[:, None]))
    assert np.ptp(found.angle[:3, -1]) > 0.01
    assert found.moment[:3] == pytest.approx(0.2, abs=1e-12)
    assert found.moment[3] == pytest.approx(0.0, abs=1e-12)
