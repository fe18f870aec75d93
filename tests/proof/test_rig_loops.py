"""Plates that dissipate: the rig's own way of following them in closed form, and against the engine."""

import numpy as np
import pytest
from proof.agreement import disagreement
from proof.rigs import effect

from prb3r.proof.rig.arrays import BILINEAR_LAW
from prb3r.proof.rig.bending import bent_in_flag, bent_on

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


def test_a_flag_is_a_parallelogram_whose_small_loops_lose_nothing():
    """Of a bilinear law with its knee at 0.5 and a third of the stiffness beyond, that turns back at two fifths."""
    law = BILINEAR_LAW, (np.full(2, 0.5), 1 / 3, np.inf), np.zeros((2, 0, 3)), 0.4
    state, found = np.zeros(2), []
    for moment in (0.5, 0.7, 0.55, 0.65, 0.4, 0.3, 0.2, 0.0, -0.7, -0.55):
        after = np.empty(2)
        k, _ = bent_in_flag(moment, 1.0, law, state, after)
        found.append(k)
        state = after
    assert found == pytest.approx([0.5, 1.1, 0.95, 1.05, 0.8, 0.5, 0.2, 0.0, -1.1, -0.95], abs=1e-12)


PULLS = [(60.0, 0.0), (25.0, 0.0), (10.0, 45.0), (0.0, 20.0)]
"""Of the cable above and the one below, up and back and across, N."""


def rig(direction, *effects):
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
        "effect": list(effects),
    }


LOOPS = [effect("hysteretic_plate", slipping_share=0.5, yield_per_m=2.0, elements=elements) for elements in (1, 3)]
KNEE = effect("nonlinear_plate", law="smooth", knee_per_m=2.5, ratio=0.3, sharpness=3.0)
PLATEAUS = effect("superelastic_plate", plateau_strain=1.2e-3, plateau_slope=0.1)
FLAG = effect("flag_hysteresis", reverse_ratio=0.4)


@pytest.mark.parametrize("direction", ["declared", "history"])
@pytest.mark.parametrize(
    ("effects", "tip"),
    [((LOOPS[0],), 0.0), ((LOOPS[1],), -0.4), ((KNEE, FLAG), 0.0), ((PLATEAUS, FLAG), -0.4)],
    ids=["one spring", "three springs", "flag", "flag of a section"],
)
def test_engine_and_rig_agree_on_loops(direction, effects, tip):
    steps = [{"cable_up_n": up, "cable_down_n": down, "tip_y_n": tip} for up, down in PULLS]
    if direction == "declared":
        steps = [step | {"slip_up": slip} for step, slip in zip(steps, (-1, 1, 1, 1), strict=True)]
    away = disagreement(rig(direction, *effects), steps)
    assert len(away) == len(steps)
    assert max(away) < 5e-4
