"""Plates that give back less than they took, as superelastic ones do: flag-shaped loops in closed form, what they
remember, and their derivatives."""

import numpy as np
import pytest
from mechanics.test_plate_loops import LOOPS, pulled, worst_error
from prototype import ELASTICA, PRB_3R, cantilever, prototype, random_chain

from prb3r.mechanics.chain import loads
from prb3r.mechanics.derivatives.sensitivity import chain_sensitivities, direction
from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.plate_law import Hysteresis, Law
from prb3r.model.laws.section import section_law

KNEE, RATIO, REVERSE = 0.5, 0.3, 0.4
CORNERS = Law(knee=KNEE, ratio=RATIO)
FLAG = Hysteresis(reverse=REVERSE)


def flagged(law, reverse=REVERSE, plate=ELASTICA):
    """A function from moments, one after the other, to the bends of one plate of unit length and rigidity."""

    def bend(moments):
        chain = cantilever(1, plate)._replace(law=law, hysteresis=Hysteresis(reverse=reverse))
        found = solve_chain(chain, loads(chain, np.zeros((len(moments), 0)), moment=np.array(moments)[:, None]))
        assert (found.outcome == Outcome.CONVERGED).all()
        return found.angle[:, -1]

    return bend


def looping(chain, strength=2.5, ratio=RATIO, sharpness=np.inf):
    return chain._replace(law=Law(knee=strength, ratio=ratio, sharpness=sharpness), hysteresis=FLAG)


# the law, on one plate under a pure moment


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("largest", [0.6, 1.0, 1.7])
def test_the_flag_of_a_bilinear_plate_is_a_parallelogram(largest, side):
    """Corners: the knee, the turn, where the lower plateau is met, its end; then the straight plate."""
    yielded, back = KNEE + RATIO * (largest - KNEE), largest - (1 - REVERSE) * KNEE
    bend = np.array([0, KNEE, largest, back, REVERSE * KNEE, 0])
    moment = np.array([0, KNEE, yielded, yielded - (largest - back), REVERSE * KNEE, 0])
    found = flagged(CORNERS)(side * moment[1:])
    assert found == pytest.approx(side * bend[1:], abs=1e-12)
    area = abs(np.trapezoid(moment, [0, *found]))  # up and back to the straight plate
    assert area == pytest.approx((largest - KNEE) * (1 - REVERSE) * KNEE * (1 - RATIO), rel=1e-10)


@pytest.mark.parametrize("law", [CORNERS, Law(knee=KNEE, ratio=RATIO, sharpness=2.0)], ids=["corners", "smooth"])
@pytest.mark.parametrize("plate", [ELASTICA, PRB_3R], ids=["elastica", "springs"])
def test_loading_follows_the_law_and_a_plate_let_go_is_straight_and_as_new(law, plate):
    steps = np.linspace(0.05, 1.2, 15)
    chain = cantilever(1, plate)._replace(law=law)
    soft = solve_chain(chain, loads(chain, np.zeros((15, 0)), moment=steps[:, None])).angle[:, -1]
    found = flagged(law, plate=plate)([*steps, 0.0, *steps, 0.0, *-steps])
    assert found[:15] == pytest.approx(soft, abs=1e-10)
    assert found[[15, 31]] == pytest.approx([0.0, 0.0], abs=1e-10)
    assert found[16:31] == pytest.approx(soft, abs=1e-10)
    assert found[32:] == pytest.approx(-soft, abs=1e-10)


def test_a_material_that_turns_back_at_a_share_of_the_stress_is_one_that_yields_at_that_stress():
    """Unloading from far beyond, plates with a superelastic section bend as plates of the weaker material loading."""
    section = section_law(None, 1.4, 0.05)
    law = lambda strain: Law(knee=np.full((1, 1), strain * section.end), table=section.table)  # noqa: E731
    steps = np.linspace(0.4, 0.05, 8)
    down = flagged(law(0.3), reverse=0.5)([1.0, *steps])[1:]
    weak = cantilever(1)._replace(law=law(0.15))
    up = solve_chain(weak, loads(weak, np.zeros((8, 0)), moment=steps[::-1, None])).angle[::-1, -1]
    assert down[-6:] == pytest.approx(up[-6:], abs=1e-10)


def test_between_the_plateaus_a_plate_is_elastic():
    """Small loops within the flag lose nothing, wherever they are, and are forgotten."""
    bend = flagged(CORNERS)
    found = bend([0.7, 0.5, 0.65, 0.45, 0.7, 0.8])
    assert found[0] - found[1:5] == pytest.approx([0.2, 0.05, 0.25, 0.0], abs=1e-12)
    assert found[-1] == pytest.approx(bend([0.8])[0], abs=1e-12)


@pytest.mark.parametrize("law", [Law(), Law(knee=KNEE, ratio=3.0), Law(cubic=0.4)], ids=["linear", "stiffer", "cubic"])
def test_where_the_law_does_not_soften_there_is_no_loop(law):
    moments = np.array([0.9, 0.4, -0.7, 0.2])
    chain = cantilever(1)._replace(law=law)
    plain = solve_chain(chain, loads(chain, np.zeros((4, 0)), moment=moments[:, None])).angle[:, -1]
    assert flagged(law)(moments) == pytest.approx(plain, abs=1e-11)


# plates of a chain


@pytest.mark.parametrize("presliding", [0.0, 3e-4], ids=["declared", "history"])
def test_states_do_not_depend_on_how_finely_a_path_is_sampled(presliding):
    chain = looping(prototype(0.3)._replace(presliding=presliding))
    start = np.vstack([np.zeros(4), LOOPS])
    fine = np.concatenate([a + np.arange(1, 33)[:, None] / 32 * (b - a) for a, b in zip(start, LOOPS, strict=False)])
    slip = np.ones((len(LOOPS), 4)) * -1
    coarse = solve_chain(chain, loads(chain, LOOPS, slip))
    dense = solve_chain(chain, loads(chain, fine, np.repeat(slip, 32, axis=0)))
    assert (coarse.outcome == Outcome.CONVERGED).all()
    assert np.abs(coarse.x - dense.x[31::32]).max() < 5e-4 * chain.length


def test_a_plate_pulled_less_is_bent_farther_than_on_the_way_up():
    chain = looping(prototype(0.0))
    up, _, down = solve_chain(chain, loads(chain, pulled((20, 0), (60, 0), (20, 0)))).angle
    assert (down[1:] > up[1:] + 0.01).all()


def test_the_eigenvalue_is_that_of_going_on():
    """On the plateau what is left of the stiffness, right after a turn all of it."""
    chain = looping(cantilever(1, PRB_3R), strength=KNEE)
    applied = loads(chain, np.zeros((4, 0)), moment=np.array([[0.1], [0.6], [0.5], [0.25]]))
    found = solve_chain(chain, applied, eigenvalue=True)
    full = float(chain.stiffness.min())
    assert found.lowest_eigenvalue == pytest.approx([full, RATIO * full, full, RATIO * full], rel=1e-4)


# derivatives


def errors_of(chain, steps, step=1e-4):
    """Those of `worst_error`, of the law's own numbers too."""
    law, flag = chain.law, chain.hysteresis
    ways = {
        "reverse": lambda v: (chain._replace(hysteresis=flag._replace(reverse=flag.reverse * v)), steps),
        "ratio": lambda v: (chain._replace(law=law._replace(ratio=law.ratio * v)), steps),
        "knee": lambda v: (chain._replace(law=law._replace(knee=law.knee * v)), steps),
        "rest": lambda v: (chain._replace(rest=chain.rest + 0.02 * (v - 1)), steps),
        "sharpness": lambda v: (chain._replace(law=law._replace(sharpness=law.sharpness * v)), steps),
    }
    return worst_error(chain, steps, step, ways)


@pytest.mark.long
@pytest.mark.parametrize("sharpness", [np.inf, 2.5], ids=["corners", "smooth"])
@pytest.mark.parametrize("tip", [0.0, -0.7], ids=["free", "tip load"])
@pytest.mark.parametrize("plate", [PRB_3R, ELASTICA], ids=["springs", "elastica"])
def test_derivatives_along_loops_are_those_of_whole_solves(plate, tip, sharpness):
    chain = looping(prototype(0.3, plate=plate), sharpness=sharpness)
    slip = np.where(np.arange(len(LOOPS))[:, None] % 2, 1.0, -1.0) * np.ones(4)
    errors = errors_of(chain, loads(chain, LOOPS, slip, tip=[0.0, tip]))
    assert max(errors.values()) < 2e-4, errors


@pytest.mark.long
def test_derivatives_where_friction_follows_the_travel_too():
    errors = errors_of(
        looping(prototype(0.3)._replace(presliding=1e-3), sharpness=2.0), loads(prototype(0.3), LOOPS), 1e-6
    )
    assert max(errors.values()) < 1e-3, errors


@pytest.mark.long
def test_derivatives_of_tied_plates():
    chain = looping(prototype(0.3, plate=ELASTICA)._replace(tied=True), sharpness=2.0)
    errors = errors_of(chain, loads(chain, LOOPS))
    assert max(errors.values()) < 2e-4, errors


@pytest.mark.parametrize("seed", range(2))
def test_derivatives_of_chains_at_random(seed):
    rng = np.random.default_rng(seed)
    chain = looping(random_chain(rng), 1.5, 0.4, 3.0)
    tension = rng.uniform(0, 20, (6, 3))
    errors = errors_of(chain, loads(chain, tension, rng.uniform(-1, 1, (6, 3))))
    assert max(errors.values()) < 2e-4, errors


def test_a_direction_cannot_let_loops_begin():
    chain = looping(prototype(0.2))
    steps = loads(chain, LOOPS)
    start = direction(lambda v: (chain._replace(hysteresis=Hysteresis(reverse=1 - max(v, 0.0))), steps), 0.0, 1e-5)
    with pytest.raises(ValueError, match="changes the kind"):
        chain_sensitivities(chain._replace(hysteresis=Hysteresis()), steps, [start])
