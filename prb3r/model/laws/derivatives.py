"""Sensitivities of equilibria under a moment law that follows the state.

The law's moments change with the state, and the state with them.  To first order both are linear: the change of the
moments that a change of moments calls for is one more direction for
`prb3r.mechanics.derivatives.sensitivity`, so a linear system in the moments of all steps and plates remains.  It is
never formed; GMRES needs its products only, a few of them, as the moments of a law are small against those of the
plates.
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
"""Of the moments' derivatives, relative; differences of what is known without solving are good to 1e-9."""
MOST_PRODUCTS = 200


class LawDirection(NamedTuple):
    """The paths a little ahead and a little behind in a parameter; see `Direction`."""

    ahead: LawPath
    behind: LawPath
    apart: float

    def changed(self, moment: np.ndarray, change: np.ndarray) -> Direction:
        """Of the problem under given moments (s + 1, n), which change with the parameter."""
        half = change * self.apart / 2
        return Direction(self.ahead.under(moment + half), self.behind.under(moment - half), self.apart)

    def of_held(self, states: Equilibria) -> np.ndarray:
        """(s + 1, n) derivative of what the law asks for in states that are held."""
        return (self.ahead.asked(states) - self.behind.asked(states)) / self.apart


def sensitivities_under_law(
    chain: Chain,
    loads: Loads,
    directions: Sequence[Direction],
    *,
    from_rest: bool | np.ndarray = False,
    number: np.ndarray | None = None,
) -> Sensitivities:
    """As `chain_sensitivities` of the mechanics, with the moments of the chain's terms; see `equilibria_of`."""
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
        return without_law(*along.under(moment), ways, from_rest=along.begins)

    def called_for(response: Sensitivities) -> np.ndarray:
        """(s + 1, n, p) change of the law's moments as the states change."""
        change = StateChange(np.diff(response.dangle, axis=1), response.dtension, response.dslip)
        return np.where(closed[:, None, None], along.asked_change(states, change), 0.0)

    def by_parameters(change: np.ndarray) -> Sensitivities:
        """To the parameters, the moments changing (s + 1, n, p) with them."""
        return respond([side.changed(moment, change[..., k]) for k, side in enumerate(sides)])

    def left(flat: np.ndarray) -> np.ndarray:
        """What changes of the moments do not call for themselves."""
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
    """Without the first step; not a number where a step has no equilibrium with its moments."""
    arrays = {field.name: getattr(response, field.name) for field in fields(response) if field.name != "equilibria"}
    for values in arrays.values():
        values[~closed] = np.nan
    arrays = {name: values[1:] for name, values in arrays.items()}
    return replace(response, equilibria=kept(states, closed, detail=True), **arrays)
