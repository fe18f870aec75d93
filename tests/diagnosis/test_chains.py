"""Chains that are made of what the last one had in common with them are those that are made from the beginning."""

import numpy as np
from diagnosis.simulated import CABLES, recorded

from prb3r.diagnosis.fit.chains import Chains
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.model.effects import EFFECT_KINDS, with_effects


def effects_of(rng):
    """Some in any order, of kinds that are applied late among them."""
    u = rng.uniform
    library = [
        {"kind": "notch_closing", "factor": u(0.5, 1), "stiffness_n_m_per_rad": 3.0},
        {"kind": "disk_contact", "angle_rad": 0.2, "stiffness_n_m_per_rad": u(5, 30)},
        {"kind": "clamp_compliance", "compliance_rad_per_n_m": u(0.001, 0.01)},
        {"kind": "precurvature", "curvature_per_m": u(-1, 1), "plates": [2, 5]},
        {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": u(1, 3), "ratio": 0.4, "sections": "similar"},
        {"kind": "hole_offset", "cable": str(rng.choice(list(CABLES))), "offset_m": u(-1e-3, 1e-3)},
        {"kind": "tension_offset", "offset_n": u(-1, 1)},
        {"kind": "gravity", "x_m_s2": 0.0, "y_m_s2": u(-9, 9)},
    ]
    return [EFFECT_KINDS[library[k]["kind"]](**library[k]) for k in rng.permutation(len(library))[: rng.integers(1, 7)]]


def assert_same(found, expected):
    for name, one, other in zip(found._fields, found, expected, strict=True):
        parts = zip(one, other, strict=True) if isinstance(one, tuple) else [(one, other)]
        for part, wanted in parts:
            np.testing.assert_array_equal(part, wanted, err_msg=name)


def test_a_chain_does_not_depend_on_what_was_asked_before():
    rig = predictor(recorded())
    plain, manipulator, rng = rig.chain, rig.recording.manipulator, np.random.default_rng(5)
    chains, effects = Chains(plain, manipulator), []
    for _ in range(200):
        constants = Constants(float(rng.choice([0.0, 0.1])), float(rng.choice([0.0, -0.2])))
        change = rng.integers(4)
        if change == 0 or not effects:
            effects = effects_of(rng)
        elif change == 1:  # as for a derivative: one of them is another
            (other,) = effects_of(rng)[:1]
            effects = [*effects[:-1], other]
        elif change == 2:
            effects = effects[:-1]
        stiffness, friction = np.exp([constants.log_stiffness, constants.log_friction])
        scaled = plain._replace(stiffness=plain.stiffness * stiffness, friction=plain.friction * friction)
        assert_same(chains.chain(constants, effects), with_effects(scaled, manipulator, effects))
