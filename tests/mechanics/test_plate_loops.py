"""Plates part of whose stiffness slips: Masing's loops in closed form, what they remember, and their derivatives."""

from itertools import pairwise

import numpy as np
import pytest
from prototype import ELASTICA, PRB_3R, cantilever, prototype, random_chain

from prb3r.mechanics.chain import loads, no_loads
from prb3r.mechanics.derivatives.sensitivity import chain_sensitivities, direction
from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.plate_law import Hysteresis, Law

SHARE, YIELD = 0.4, 0.5
STRENGTH = 2.5
"""Curvature from which plates of the prototype slip, 1/m: those of 50 N on cable 1 bend to 5 of them."""
SOFT = Law(knee=STRENGTH, ratio=1 - SHARE)
STEP = 1e-5


def bends(moments, hysteresis, plate=ELASTICA):
    """Bend of one plate of unit length and rigidity under moments one after the other: its curvature."""
    chain = cantilever(1, plate)._replace(hysteresis=hysteresis)
    found = solve_chain(chain, loads(chain, np.zeros((len(moments), 0)), moment=np.array(moments)[:, None]))
    assert (found.outcome == Outcome.CONVERGED).all()
    return found.angle[:, -1]


def pulled(*tensions):
    """Loads of cables 1 and 3 of the prototype, step by step, N."""
    table = np.zeros((len(tensions), 4))
    table[:, [0, 2]] = tensions
    return table


LOOPS = pulled((60, 0), (20, 0), (50, 30), (0, 45), (0, 45), (40, 5))
"""Up, back, another cable, rest for a step, and back across."""


def looping(chain, share=SHARE, strength=STRENGTH, elements=1):
    return chain._replace(hysteresis=Hysteresis(share, strength, elements))


# the law, on one plate under a pure moment


@pytest.mark.parametrize("largest", [0.6, 1.0, 1.7])
def test_the_loop_of_a_bilinear_plate_has_the_area_of_four_times_yield_moment_and_slip(largest):
    """Corners of a loop between +-k: where the slider begins to move again, 2 y after each turn."""
    stiff = 1 - SHARE
    moment = stiff * largest + SHARE * YIELD
    corner = stiff * (largest - 2 * YIELD) - SHARE * YIELD
    steps = [moment, corner, -moment, -corner, moment]
    bend = bends(steps, Hysteresis(SHARE, YIELD))
    assert bend == pytest.approx([largest, largest - 2 * YIELD, -largest, 2 * YIELD - largest, largest], abs=1e-12)
    area = abs(np.trapezoid(bend, steps))
    assert area == pytest.approx(4 * SHARE * YIELD * (largest - YIELD), rel=1e-12)


@pytest.mark.parametrize("plate", [ELASTICA, PRB_3R], ids=["elastica", "springs"])
def test_below_the_yield_curvature_nothing_is_lost(plate):
    steps = np.array([0.3, -0.3, 0.4, 0.0])
    bend = bends(steps, Hysteresis(SHARE, YIELD), plate)
    assert bend == pytest.approx(steps * bends([1.0], Hysteresis(), plate)[0], abs=1e-12)


def test_loading_is_the_bilinear_law():
    steps = np.linspace(0.05, 2.0, 40)
    chain = cantilever(1)._replace(law=Law(knee=YIELD, ratio=1 - SHARE))
    soft = solve_chain(chain, loads(chain, np.zeros((40, 0)), moment=steps[:, None])).angle[:, -1]
    assert bends(steps, Hysteresis(SHARE, YIELD)) == pytest.approx(soft, abs=1e-12)


@pytest.mark.parametrize("elements", [1, 2, 3])
def test_unloading_is_loading_twice_as_long(elements):
    """Masing: from a turn at (M, k) the plate goes back by k - k' = 2 g((M - M') / 2) where loading went by g."""
    law, top = Hysteresis(SHARE, YIELD, elements), 1.5
    falls = np.linspace(0.1, 2 * top, 12)
    backbone = bends(falls / 2, law)
    unloading = bends([top, *(top - falls)], law)
    assert unloading[0] - unloading[1:] == pytest.approx(2 * backbone, abs=1e-11)


def test_three_elements_yield_one_after_the_other():
    """Equal springs that yield at a third, at all and at five thirds of the mean; slopes of 1 - share k / 3 between."""
    law = Hysteresis(0.6, 0.3, 3)
    at = np.array([0.1, 0.3, 0.5, 1.0])
    moments = np.cumsum(np.diff(at, prepend=0) * [1.0, 0.8, 0.6, 0.4])
    assert bends(moments, law) == pytest.approx(at, abs=1e-12)


@pytest.mark.parametrize("elements", [1, 3])
def test_a_small_loop_closes_and_is_forgotten(elements):
    """Return-point memory: after a loop within a loop the plate goes on as if there had been none."""
    law = Hysteresis(SHARE, YIELD, elements)
    plain = bends([1.5, -0.2, 0.9, 1.8, -1.0], law)
    small = bends([1.5, -0.2, 0.7, 0.0, 0.3, 0.1, 0.7, 0.9, 1.8, -1.0], law)
    assert small[2] == pytest.approx(small[6], abs=1e-12)
    assert small[-3:] == pytest.approx(plain[-3:], abs=1e-12)


# plates of a chain


@pytest.mark.parametrize("presliding", [0.0, 3e-4], ids=["declared", "history"])
@pytest.mark.parametrize("tip", [0.0, -0.5], ids=["free", "tip load"])
def test_plates_that_only_load_follow_the_bilinear_law(presliding, tip):
    """Only unloading tells slipping plates from plates that merely soften."""
    chain = prototype(0.2)._replace(presliding=presliding)
    table = pulled((15, 0), (30, 0), (60, 0), (90, 0))
    applied = loads(chain, table, tip=np.arange(1, 5)[:, None] / 4 * [0.0, tip])
    slipping = solve_chain(looping(chain), applied)
    soft = solve_chain(chain._replace(law=SOFT), applied)
    linear = solve_chain(chain, applied)
    assert (slipping.outcome == Outcome.CONVERGED).all()
    solved = 1e-11 * chain.stiffness.size  # to which nodes are balanced; with history sub-steps end at other places
    assert slipping.angle == pytest.approx(soft.angle, abs=2e-7 if presliding else solved)
    assert slipping.x == pytest.approx(soft.x, abs=1e-8 if presliding else solved * chain.length)
    assert np.abs(slipping.x - linear.x).max() > 5e-3
    table = np.vstack([table, table[1:2]])
    back, forth = (solve_chain(kind, loads(chain, table)) for kind in (looping(chain), chain._replace(law=SOFT)))
    assert np.abs(back.x - forth.x)[-1].max() > 5e-3


@pytest.mark.parametrize("presliding", [0.0, 3e-4], ids=["declared", "history"])
def test_states_do_not_depend_on_how_finely_a_path_is_sampled(presliding):
    """Where bends turn within a step, what is missed falls with the sub-steps taken."""
    chain = looping(prototype(0.3)._replace(presliding=presliding), elements=2)
    start = np.vstack([np.zeros(4), LOOPS])
    fine = np.concatenate([a + np.arange(1, 33)[:, None] / 32 * (b - a) for a, b in zip(start, LOOPS, strict=False)])
    slip = np.ones((len(LOOPS), 4)) * -1
    coarse = solve_chain(chain, loads(chain, LOOPS, slip))
    dense = solve_chain(chain, loads(chain, fine, np.repeat(slip, 32, axis=0)))
    assert np.abs(coarse.x - dense.x[31::32]).max() < 5e-4 * chain.length


def test_a_plate_that_turns_back_within_a_step_is_followed_to_where_it_turned():
    """Along a path with history, as cables change places; sub-steps over the turn would miss 16 times as much."""
    chain = looping(prototype(0.3)._replace(presliding=3e-4), elements=2)
    pulls = np.array([[0.0, 0, 0, 0], [17, 28, 7, 0], [0, 4, 6, 59], [42, 0, 38, 16]])
    part = np.arange(1, 65)[:, None] / 64
    fine = np.concatenate([a + part * (b - a) for a, b in pairwise(pulls)])
    coarse, dense = (solve_chain(chain, loads(chain, table)) for table in (pulls[1:], fine))
    assert np.abs(coarse.x - dense.x[63::64]).max() < 1e-5 * chain.length


@pytest.mark.parametrize("seed", [10, 23])
def test_a_plate_that_turns_back_within_a_step_under_tip_loads_is_followed_in_short_sub_steps(seed):
    """Two halves of a step would miss 15 and 40 times as much."""
    rng, chain = np.random.default_rng(seed), looping(prototype(), elements=2)
    pulls = rng.uniform(0, 60, (4, 4)) * (rng.random((4, 4)) < 0.7)
    ways = np.vstack([np.zeros(6), np.hstack([pulls, rng.uniform(-8, 8, (4, 2))]).round()])
    part = np.arange(1, 65)[:, None] / 64
    fine = np.concatenate([a + part * (b - a) for a, b in pairwise(ways)])
    coarse, dense = (solve_chain(chain, loads(chain, way[:, :4], tip=way[:, 4:])) for way in (ways[1:], fine))
    assert np.abs(coarse.x - dense.x[63::64]).max() < 1e-4 * chain.length


def test_plates_that_slip_on_before_they_turn_are_followed_to_the_turn():
    """As a third cable is pulled, outer plates bend on, and slip, for three eighths of the step, and are back before
    its middle: two halves would miss 12 times as much."""
    chain = prototype(0.3)._replace(hysteresis=Hysteresis(0.38, 0.7, 1))
    ways = np.array([[0.0, 0, 0, 0], [32, 0, 0, 55], [22, 20, 39, 54], [39, 0, 52, 12], [37, 57, 49, 14]])
    part = np.arange(1, 65)[:, None] / 64
    fine = np.concatenate([a + part * (b - a) for a, b in pairwise(ways)])
    coarse, dense = (solve_chain(chain, loads(chain, way)) for way in (ways[1:], fine))
    assert np.abs(coarse.x - dense.x[63::64]).max() < 1e-4 * chain.length


def test_a_new_sequence_begins_with_virgin_plates():
    chain = looping(prototype(0.2))
    applied = loads(chain, np.vstack([LOOPS, LOOPS / 2]))
    found = solve_chain(chain, applied, from_rest=np.arange(12) % 6 == 0)
    assert (found.outcome == Outcome.CONVERGED).all()
    assert np.array_equal(found.x[6:], solve_chain(chain, loads(chain, LOOPS / 2)).x)
    on = solve_chain(chain, applied)
    assert np.abs(on.x[6:] - found.x[6:]).max() > 1e-4


def test_constant_curvature_loops_as_the_sum_of_its_plates():
    """Tied plates under a pure moment bend like one alone."""
    chain = cantilever(3)._replace(tied=True, hysteresis=Hysteresis(SHARE, YIELD, 2))
    steps = np.array([1.2, 0.1, 0.8, -1.0])
    found = solve_chain(chain, loads(chain, np.zeros((4, 0)), moment=np.tile(steps[:, None], 3)))
    assert found.angle[:, -1] == pytest.approx(bends(steps, Hysteresis(SHARE, YIELD, 2)), abs=1e-10)


def test_weights_bend_virgin_plates_before_the_first_step():
    """Constant loads are on before a sequence begins: what they slide is as if they were the first step."""
    chain = looping(prototype(0.0))
    weight = no_loads(chain)._replace(tip=np.array([[0.0, -2.0]]))
    always = solve_chain(chain._replace(constant=weight), loads(chain, pulled((0, 0), (40, 0), (0, 0))))
    first = solve_chain(chain, loads(chain, pulled((0, 0), (40, 0), (0, 0)), tip=[0.0, -2.0]))
    assert always.x == pytest.approx(first.x, abs=1e-10)
    assert np.abs(always.x[0] - always.x[2]).max() > 1e-4


@pytest.mark.parametrize("tip", [0.0, 1e-6], ids=["march", "whole chain"])
def test_the_eigenvalue_is_that_of_going_on(tip):
    """A plate that has slipped goes on with the stiffness that is left; one that has turned back has all of it."""
    chain = cantilever(1, PRB_3R)._replace(hysteresis=Hysteresis(SHARE, YIELD))
    applied = loads(chain, np.zeros((3, 0)), tip=[0.0, tip], moment=np.array([[0.1], [1.2], [0.9]]))
    found = solve_chain(chain, applied, eigenvalue=True)
    full = float(chain.stiffness.min())
    assert found.lowest_eigenvalue == pytest.approx([full, (1 - SHARE) * full, full], rel=1e-4)


# derivatives


def problems(chain, steps):
    """Functions of one number, which is 1 for the chain and the loads themselves."""
    slips = chain.hysteresis
    plate = 1 + np.eye(chain.plates)[1][:, None]
    return {
        "share": lambda v: (chain._replace(hysteresis=slips._replace(share=slips.share * v)), steps),
        "yield": lambda v: (chain._replace(hysteresis=slips._replace(curvature=slips.curvature * v)), steps),
        "stiffness": lambda v: (chain._replace(stiffness=chain.stiffness * v), steps),
        "one plate": lambda v: (chain._replace(stiffness=chain.stiffness * plate ** (v - 1)), steps),
        "length": lambda v: (chain._replace(arc=chain.arc * v, stiffness=chain.stiffness / v), steps),
        "rest": lambda v: (chain._replace(rest=chain.rest + 0.02 * (v - 1)), steps),
        "friction": lambda v: (chain._replace(friction=chain.friction * v), steps),
        "tension": lambda v: (chain, steps._replace(tension=steps.tension * v)),
        "tip": lambda v: (chain, steps._replace(tip=steps.tip * v)),
    }


def worst_error(chain, steps, step=1e-4, ways=None):
    """Largest difference to central differences of whole solves, of the largest derivative of each parameter.

    Of two steps the better one: within the other a spring may begin to slip.
    """
    ways = ways or problems(chain, steps)
    found = chain_sensitivities(chain, steps, [direction(way, 1.0, STEP) for way in ways.values()])
    assert (found.equilibria.outcome == Outcome.CONVERGED).all()
    errors = {}
    for k, (name, way) in enumerate(ways.items()):
        of_both = []
        for size in (step, step / 7):
            ahead, behind = (solve_chain(*way(1 + side * size)) for side in (1, -1))
            difference = (ahead.angle - behind.angle) / (2 * size)
            of_both.append(np.abs(found.dangle[..., k] - difference).max() / (np.abs(difference).max() + 0.01))
        errors[name] = min(of_both)
    return errors


@pytest.mark.parametrize("elements", [1, 3])
@pytest.mark.parametrize("tip", [0.0, -0.7], ids=["free", "tip load"])
@pytest.mark.parametrize("plate", [PRB_3R, ELASTICA], ids=["springs", "elastica"])
def test_derivatives_along_loops_are_those_of_whole_solves(plate, tip, elements):
    chain = looping(prototype(0.3, plate=plate), elements=elements)
    slip = np.where(np.arange(len(LOOPS))[:, None] % 2, 1.0, -1.0) * np.ones(4)
    errors = worst_error(chain, loads(chain, LOOPS, slip, tip=[0.0, tip]))
    assert max(errors.values()) < 2e-4, errors


def test_derivatives_where_weights_have_slid_the_plates_at_rest():
    chain = looping(prototype(0.2), strength=0.5)
    weight = no_loads(chain)._replace(tip=np.array([[0.0, -1.0]]))
    errors = worst_error(chain._replace(constant=weight), loads(chain, LOOPS))
    assert max(errors.values()) < 2e-4, errors


def test_derivatives_where_friction_follows_the_travel_too():
    chain = looping(prototype(0.3)._replace(presliding=1e-3), elements=2)
    errors = worst_error(chain, loads(chain, LOOPS), step=1e-6)
    assert max(errors.values()) < 1e-3, errors


@pytest.mark.long
def test_derivatives_of_tied_plates():
    chain = looping(prototype(0.3, plate=ELASTICA)._replace(tied=True), elements=2)
    errors = worst_error(chain, loads(chain, LOOPS))
    assert max(errors.values()) < 2e-4, errors


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_chains_at_random(seed):
    rng = np.random.default_rng(seed)
    chain = looping(random_chain(rng), share=0.5, strength=1.5, elements=int(rng.integers(1, 4)))
    tension = rng.uniform(0, 20, (6, 3))
    errors = worst_error(chain, loads(chain, tension, rng.uniform(-1, 1, (6, 3))))
    assert max(errors.values()) < 2e-4, errors


def test_a_direction_cannot_let_stiffness_begin_to_slip():
    chain = prototype(0.2)
    steps = loads(chain, LOOPS)
    start = direction(lambda v: (looping(chain, share=max(v, 0.0)), steps), 0.0, STEP)
    with pytest.raises(ValueError, match="changes the kind"):
        chain_sensitivities(chain, steps, [start])
