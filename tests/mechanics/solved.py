"""Chains solved and checked, for plates of every model."""

import numpy as np
import pytest
from prototype import ELASTICA, PRB_1R, PRB_3R, row

from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.reference import seed_residual

MODELS = pytest.mark.parametrize("plate", [PRB_3R, PRB_1R, ELASTICA], ids=["PRB 3R", "PRB 1R", "elastica"])
NO_CABLES = np.zeros((1, 0))


def good(chain, steps, **options):
    """Solved, stable, and in balance by the reference's own residual."""
    states = solve_chain(chain, steps, eigenvalue=True, **options)
    assert (states.outcome == Outcome.CONVERGED).all()
    for s, q in enumerate(states.q):
        assert np.abs(seed_residual(chain, row(steps, s), q) / chain.stiffness).max() < 1e-9
    return states
