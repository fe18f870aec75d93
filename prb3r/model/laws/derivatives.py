"""Sensitivities of equilibria under a moment law that depends on the state.

The law's moments change with the state, and the state with them.  To first order both changes are linear: how states
respond to a change of the moments is one more direction for `prb3r.mechanics.derivatives.sensitivity`.  What remains is
a linear system in the moments of all steps and plates.  It is never formed: GMRES only needs its products with vectors,
and a few of them suffice, as the moments of a law are small against those of the plates.
"""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np
import scipy

from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.derivatives.sensitivity import Direction, Sensitivities
from prb3r.mechanics.derivatives.sensitivity import chain_sensitivities as without_law
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.laws.moment_law import LawPath, StateChange, law_path
from prb3r.model.laws.self_consistent import kept, settled

SENSITIVITY_TOLERANCE = 1e-10
"""Relative residual of the moments' derivatives at which GMRES stops; the differences at the held shape that enter are
good to 1e-9."""
MOST_PRODUCTS = 200
"""Most products with the linear system."""


class LawDirection(NamedTuple):
    """One parameter, given by the paths under the law a little ahead and a little behind in it; see `Direction`."""

    ahead: LawPath
    behind: LawPath
    apart: float
    """Difference of the parameter between both, in its unit."""

    def changed(self, moment: np.ndarray, change: np.ndarray) -> Direction:
        """The direction of the parameter for the chain without its law, under moments (s + 1, n) in the law's place
        whose derivative by the parameter is `change` (s + 1, n)."""
        half = change * self.apart / 2
        return Direction(self.ahead.under(moment + half), self.behind.under(moment - half), self.apart)

    def of_held(self, states: Equilibria) -> np.ndarray:
        """(s + 1, n) derivative by the parameter of the moments by the law, with the states held."""
        return (self.ahead.asked(states) - self.behind.asked(states)) / self.apart


def sensitivities_under_law(
    chain: Chain,
    loads: Loads,
    directions: Sequence[Direction],
    *,
    from_rest: bool | np.ndarray = False,
    number: np.ndarray | None = None,
) -> Sensitivities:
    """Equilibria of `chain` and their derivatives as `chain_sensitivities` finds them, but with the moments of the
    chain's terms.

    `number` is that of `equilibria_of`.  Steps whose moments do not agree with the law hold NaN, and all steps do if
    GMRES does not converge.
    """
    if not chain.closure:
        return without_law(chain, loads, directions, from_rest=from_rest)
    along = law_path(chain, loads, from_rest, number)
    states, moment, closed = settled(along)
    closed &= np.isfinite(states.angle).all(1)
    sides = [
        LawDirection(
            law_path(*parameter.ahead, from_rest, number),
            law_path(*parameter.behind, from_rest, number),
            parameter.apart,
        )
        for parameter in directions
    ]

    def respond(ways: Sequence[Direction]) -> Sensitivities:
        """Response of the states to directions of the problem without the law."""
        return without_law(*along.under(moment), ways, from_rest=along.begins)

    def called_for(response: Sensitivities) -> np.ndarray:
        """(s + 1, n, p) derivatives of the law's moments that the response of the states causes."""
        change = StateChange(np.diff(response.dangle, axis=1), response.dtension, response.dslip)
        return np.where(closed[:, None, None], along.asked_change(states, change), 0.0)

    def by_parameters(change: np.ndarray) -> Sensitivities:
        """Response of the states to the parameters, if the derivatives of the moments are `change` (s + 1, n, p)."""
        return respond([side.changed(moment, change[..., k]) for k, side in enumerate(sides)])

    def left(flat: np.ndarray) -> np.ndarray:
        """The linear operator of GMRES: derivatives of the moments less those that the law returns for them."""
        change = flat.reshape(start.shape)
        halves = np.moveaxis(change, -1, 0) / 2
        ways = [Direction(along.under(moment + half), along.under(moment - half), 1.0) for half in halves]
        return (change - called_for(respond(ways))).ravel()

    itself = np.stack([side.of_held(states) for side in sides], axis=-1)
    start = np.where(closed[:, None, None], itself, 0.0) + called_for(by_parameters(np.zeros_like(itself)))
    size = np.linalg.norm(start, axis=(0, 1))
    size[size == 0] = 1.0
    system = scipy.sparse.linalg.LinearOperator((start.size, start.size), matvec=left, dtype=float)
    flat, failed = scipy.sparse.linalg.gmres(
        system, (start / size).ravel(), rtol=SENSITIVITY_TOLERANCE, restart=MOST_PRODUCTS, maxiter=1
    )
    response = by_parameters(flat.reshape(start.shape) * size)
    return _after_rest(response, states, closed & (failed == 0))


def _after_rest(response: Sensitivities, states: Equilibria, closed: np.ndarray) -> Sensitivities:
    """The derivatives `response` without the first step, rest; NaN at steps that are not `closed`."""
    arrays = {field.name: getattr(response, field.name) for field in fields(response) if field.name != "equilibria"}
    for values in arrays.values():
        values[~closed] = np.nan
    arrays = {name: values[1:] for name, values in arrays.items()}
    return replace(response, equilibria=kept(states, closed, detail=True), **arrays)
