"""Random manipulators, effects and load paths, and how far engine and rig are apart on them."""

import numpy as np
import pandas as pd

from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.model.manipulator import Manipulator
from prb3r.model.steps import loads_of
from prb3r.proof.rig.simulate import ELEMENTS_WITH_MEMORY, simulate


def random_manipulator(rng, effects, history):
    """A manipulator of 1 to 3 segments and 1 to 4 cables, as plain data."""
    segments = int(rng.integers(1, 4))
    plates = rng.integers(2, 6, segments).tolist()
    cables = [
        {
            "name": f"c{j}",
            "offset_m": float(rng.uniform(0.015, 0.026) * rng.choice([-1, 1])),
            "ends_at_segment": int(rng.integers(1, segments + 1)),
        }
        for j in range(int(rng.integers(1, 5)))
    ]
    return {
        "name": "random",
        "youngs_modulus_pa": 1.87e11,
        "model": "elastica",
        "disk": {"thickness_m": float(rng.choice([0.0, 0.004, 0.006])), "mass_kg": 0.04},
        "friction": {
            "coefficient": float(rng.uniform(0, 0.4)),
            "direction": "history" if history else "declared",
            "presliding_m": float(10 ** rng.uniform(-5, -3)),
            "wrap": str(rng.choice(["net", "edges"])),
        },
        "segment": [
            {
                "plates": count,
                "length_m": 0.03,
                "clamp_m": float(rng.choice([0.0, 0.004, 0.008])),
                "width_m": 0.03,
                "thickness_m": float(rng.uniform(6e-4, 1.1e-3)),
            }
            for count in plates
        ],
        "cable": cables,
        "effect": random_effects(rng, sum(plates), effects),
    }


def random_effects(rng, plates, count):
    u = rng.uniform
    library = [
        {"kind": "pulley_friction", "efficiency": u(0.8, 1)},
        {"kind": "worn_hole", "disk": int(rng.integers(0, plates)), "coefficient": u(0, 1)},
        {"kind": "tension_offset", "offset_n": u(-3, 5)},
        {"kind": "hole_offset", "cable": "c0", "offset_m": u(-1e-3, 1e-3)},
        {"kind": "hole_clearance", "clearance_m": u(0, 1e-3)},
        {"kind": "weakened_plate", "plate": int(rng.integers(1, plates + 1)), "factor": u(0.5, 1.5)},
        {"kind": "segment_stiffness", "segment": 1, "factor": u(0.7, 1.3)},
        {"kind": "nonlinear_plate", "law": "cubic", "cubic_m2": u(0, 0.01)},
        {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": u(2, 10), "ratio": u(0.4, 1.3)},
        {"kind": "precurvature", "curvature_per_m": u(-1, 1)},
        {"kind": "disk_contact", "angle_rad": u(0.03, 0.1), "stiffness_n_m_per_rad": u(5, 30)},
        {"kind": "clamp_compliance", "compliance_rad_per_n_m": u(1e-4, 4e-3)},
        {"kind": "cable_bending", "stiffness_n_m2": u(0, 0.02)},
        {"kind": "gravity", "x_m_s2": u(-1, 1), "y_m_s2": u(-1, 1)},
        {"kind": "tip_force", "x_n": u(-0.3, 0.3), "y_n": u(-0.3, 0.3)},
        {"kind": "tip_load_friction", "efficiency": u(0.5, 1)},
    ]
    chosen = {library[k]["kind"]: library[k] for k in rng.permutation(len(library))[:count]}
    return list(chosen.values())


def random_steps(rng, manipulator, history, count=4):
    steps = []
    for _ in range(count):
        step = {f"cable_{c['name']}_n": float(rng.choice([0, rng.uniform(5, 80)])) for c in manipulator["cable"]}
        if not history:
            step |= {f"slip_{c['name']}": float(rng.choice([-1, 0, 1])) for c in manipulator["cable"]}
        steps.append(step | {"tip_x_n": float(rng.normal() * 0.3), "tip_y_n": float(rng.normal() * 0.3)})
    return steps


def disagreements(seed, rigs, effects, history):
    """Largest distance of a disk between engine and rig, of the length, for the steps that both solve.

    docs/proof.md publishes those of seeds 101 to 106 (20 rigs each) and 201 to 205 (15, 15, 10, 10, 10 with history)
    with 0, 2, 4, 0, 2, 4 effects.
    """
    rng, found = np.random.default_rng(seed), []
    for _ in range(rigs):
        data = random_manipulator(rng, effects, history)
        found += disagreement(data, random_steps(rng, data, history))
    return np.array(found)


def disagreement(data, steps):
    """Largest distance of a disk for every step up to the first that either does not solve, the rig stepping as finely
    along every plate as it does along those with hysteresis."""
    manipulator = Manipulator.model_validate(data)
    chain = manipulator.chain()
    engine = solve_chain(chain, loads_of(manipulator, chain, pd.DataFrame(steps)), eigenvalue=True)
    rig = simulate(data, steps, elements=ELEMENTS_WITH_MEMORY)
    usable = (engine.outcome == Outcome.CONVERGED) & rig.converged
    away = np.hypot(engine.x - rig.x, engine.y - rig.y).max(1) / chain.length
    return away[np.logical_and.accumulate(usable)].tolist()
