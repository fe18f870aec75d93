"""One segment between two cables, with effects."""

import numpy as np

from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.manipulator import Manipulator

PLATE = {"plates": 4, "length_m": 0.03, "clamp_m": 0.008, "bending_stiffness_n_m2": 0.24}


def manipulator(*effects, mu=0.0, plates=4, **changes):
    data = {
        "name": "bench",
        "youngs_modulus_pa": 2e11,
        "disk": {"thickness_m": 0.004, "mass_kg": 0.05},
        "friction": {"coefficient": mu},
        "segment": [PLATE | {"plates": plates}],
        "cable": [
            {"name": "up", "offset_m": 0.02, "ends_at_segment": 1},
            {"name": "down", "offset_m": -0.02, "ends_at_segment": 1},
        ],
        "effect": list(effects),
    }
    return Manipulator.model_validate(data | changes)


def state(rig, up=40.0, down=0.0, slip=-1.0, tip=(0.0, 0.0)):
    chain = rig.chain()
    return solve_chain(chain, loads(chain, [[up, down]], slip, tip=tip))


def same(a, b, within=1e-9):
    return np.abs([a.x - b.x, a.y - b.y]).max() < within


YIELD = {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 1.0, "ratio": 0.5}
