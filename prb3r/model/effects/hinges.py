"""Chains whose plates have a hinge at each end of the arc, for clamps that give way."""

import numpy as np

from prb3r.mechanics.chain import Chain
from prb3r.mechanics.plate import with_end_hinges

RIGID = 1e8
"""Stiffness of a hinge that stands for a rigid clamp, over that of the stiffest node."""


def hinged(chain: Chain, stiffness: float) -> Chain:
    """The chain with a hinge of the given stiffness (N m/rad) at each end of every arc."""
    curvature = chain.plate.stiffness if chain.curvature is None else chain.curvature
    return chain._replace(
        plate=with_end_hinges(chain.plate),
        stiffness=_between(stiffness, chain.stiffness),
        cable_stiffness=_between(0.0, np.broadcast_to(chain.cable_stiffness, chain.stiffness.shape)),
        rest=_between(0.0, chain.rest),
        curvature=_between(0.0, curvature),
    )


def _between(end: float, inner: np.ndarray) -> np.ndarray:
    """(..., k + 2) the array `inner` (..., k) with the value `end` added at both ends of its last axis."""
    out = np.full((*inner.shape[:-1], inner.shape[-1] + 2), end)
    out[..., 1:-1] = inner
    return out
