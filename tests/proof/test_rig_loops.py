"""Plates that dissipate: the rig's own way of following them in closed form, and against the engine."""

import numpy as np
import pytest
from proof.agreement import disagreement
from proof.rigs import effect

from prb3r.proof.rig.bending import bent_on

SHARE, YIELD = 0.4, 0.5


def curvatures(moments, springs):
    state, found = np.zeros(2 + springs), []
    for moment in moments:
        after = np.empty_like(state)
        k, softness = bent_on(moment, 1.0, (SHARE, YIELD, springs), state, after)
        found.append((k, softness))
        state = after
    return np.array(found).T


@pytest.mark.parametrize("springs", [1, 2, 3])
def test_a_spring_that_slips_ceases_to_resist_and_springs_back_twice_as_far(springs):
    """Masing's rule, and the moment of each spring: k less what it is short of its limit."""
    top = 1.4
    backbone, _ = curvatures([top], springs)
    steps = np.linspace(top, -top, 23)
    down, softness = curvatures([top, *steps[1:]], springs)
    half = [curvatures([(top - moment) / 2], springs)[0][0] for moment in steps]
    assert down == pytest.approx(backbone[0] - 2 * np.array(half), abs=1e-12)
    assert softness.min() == pytest.approx(1.0)
    assert softness.max() == pytest.approx(1 / (1 - SHARE))
    limits = YIELD * (2 * np.arange(springs) + 1) / springs
    k = down[-1]
    assert (1 - SHARE) * k - SHARE / springs * np.minimum(limits, -k).sum() == pytest.approx(-top, abs=1e-12)


@pytest.mark.parametrize("parts", [1, 7])
def test_what_it_becomes_does_not_depend_on_the_steps_taken(parts):
    corners = np.array([0.0, 1.2, 0.2, 0.9, -1.3, 0.4])
    fine = np.interp(np.arange(1, 5 * parts + 1) / parts, np.arange(6), corners)
    assert curvatures(fine, 3)[0][parts - 1 :: parts] == pytest.approx(curvatures(corners[1:], 3)[0], abs=1e-12)


PULLS = [(60.0, 0.0), (25.0, 0.0), (10.0, 45.0), (0.0, 20.0)]
"""Of the cable above and the one below, up and back and across, N."""


def rig(elements, direction):
    """Two segments of three plates."""
    segment = {"plates": 3, "length_m": 0.03, "clamp_m": 0.006, "width_m": 0.03, "thickness_m": 0.0008}
    return {
        "name": "loops",
        "youngs_modulus_pa": 1.87e11,
        "model": "elastica",
        "disk": {"thickness_m": 0.004},
        "friction": {"coefficient": 0.2, "direction": direction, "presliding_m": 3e-4},
        "segment": [segment, segment],
        "cable": [
            {"name": "up", "offset_m": 0.0255, "ends_at_segment": 2},
            {"name": "down", "offset_m": -0.021, "ends_at_segment": 1},
        ],
        "effect": [effect("hysteretic_plate", slipping_share=0.5, yield_per_m=2.0, elements=elements)],
    }


@pytest.mark.parametrize("direction", ["declared", "history"])
@pytest.mark.parametrize(("elements", "tip"), [(1, 0.0), (3, -0.4)])
def test_engine_and_rig_agree_on_loops(direction, elements, tip):
    steps = [{"cable_up_n": up, "cable_down_n": down, "tip_y_n": tip} for up, down in PULLS]
    if direction == "declared":
        steps = [step | {"slip_up": slip} for step, slip in zip(steps, (-1, 1, 1, 1), strict=True)]
    away = disagreement(rig(elements, direction), steps)
    assert len(away) == len(steps)
    assert max(away) < 5e-4
