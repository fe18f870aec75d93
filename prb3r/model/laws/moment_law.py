"""Moment laws: the influences on which moments on the arcs may depend, their derivatives, and load paths under a law.

A law is the sum of the chain's terms (`Chain.closure`): a coefficient per plate times an influence.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.chain import Chain, Loads, no_loads
from prb3r.mechanics.equilibrium import Equilibria


def influences_of_place(chain: Chain) -> dict[str, np.ndarray]:
    """Influences that depend on the place of a plate alone, not on the state, by name: (n,) for every plate.

    `position` runs from -1 at the first plate to 1 at the last.
    """
    place = np.linspace(-1.0, 1.0, chain.plates) if chain.plates > 1 else np.zeros(1)
    return {"constant": np.ones(chain.plates), "position": place}


def influences(chain: Chain, loads: Loads, states: Equilibria, time: np.ndarray) -> dict[str, np.ndarray]:
    """Influences that a term's moment may be proportional to, by name: (s, n) for every step and plate.

    `bend` is in rad; `tension`, `wrap` and `direction` are built from the moment of the cables (tension times offset,
    N m): their sum, that times all bends up to the plate (N m rad), and their sum signed by slip.

    Parameters
    ----------
    states : equilibria with detail.
    time : (s,) step number within the sequence over the last one: 0 at rest, 1 at the last step.
    """
    shape = len(states.angle), chain.plates
    bend = np.diff(states.angle, axis=1)
    pull = states.tension * chain.offset
    values_of = {
        **influences_of_place(chain),
        "bend": bend,
        "bend_cubed": bend**3,
        "tension": pull.sum(-1),
        "wrap": pull.sum(-1) * np.cumsum(np.abs(bend), axis=1),
        "direction": (_slip(chain, loads, states) * pull).sum(-1),
        "time": time[:, None],
    }
    return {name: np.broadcast_to(values, shape) for name, values in values_of.items()}


class StateChange(NamedTuple):
    """Derivatives of states by `p` parameters, or in `p` directions."""

    bend: np.ndarray
    """(s, n, p) derivatives of the plates' bends, rad per unit."""
    tension: np.ndarray
    """(s, n, m, p) derivatives of the cable tensions across the plates, N per unit."""
    slip: np.ndarray
    """(s, n, m, p) derivatives of the slip at the hole before each plate; no cables where slip is declared."""


def influence_changes(
    chain: Chain, loads: Loads, states: Equilibria, change: StateChange
) -> dict[str, Callable[[], np.ndarray]]:
    """Functions that return the derivatives (s, n, p) of :func:`influences` for a `change` of the state, by name.

    Influences that do not depend on the state are absent.
    """
    bend = np.diff(states.angle, axis=1)[..., None]
    pull = (states.tension * chain.offset).sum(-1)[..., None]
    pulls = change.tension * chain.offset[..., None]

    def wrap() -> np.ndarray:
        turned, turning = np.cumsum(np.abs(bend), axis=1), np.cumsum(np.sign(bend) * change.bend, axis=1)
        return pulls.sum(2) * turned + pull * turning

    def direction() -> np.ndarray:
        changed = (_slip(chain, loads, states)[..., None] * pulls).sum(2)
        if chain.presliding:
            changed = changed + (change.slip * (states.tension * chain.offset)[..., None]).sum(2)
        return changed

    return {
        "bend": lambda: change.bend,
        "bend_cubed": lambda: 3 * bend**2 * change.bend,
        "tension": lambda: pulls.sum(2),
        "wrap": wrap,
        "direction": direction,
    }


def _slip(chain: Chain, loads: Loads, states: Equilibria) -> np.ndarray:
    """(s, n, m) slip at the hole before each plate, or (s, 1, m) where slip is declared."""
    return states.slip if chain.presliding else loads.slip[:, None, :]


def time_within(begins: np.ndarray, number: np.ndarray | None = None) -> np.ndarray:
    """(s,) number of each step over that of the last step of its sequence.

    A sequence begins at the first step and at every step marked in `begins` (s,).  Without `number` (s,), the steps of
    each sequence are numbered 1, 2, ...
    """
    first = np.flatnonzero(np.concatenate([[True], begins[1:]]))
    count = np.diff(np.append(first, len(begins)))
    if number is None:
        number = np.arange(len(begins)) - np.repeat(first, count) + 1
    last = np.repeat(np.asarray(number, float)[first + count - 1], count)
    return np.divide(number, last, out=np.zeros(len(begins)), where=last != 0)


def chain_until(chain: Chain, share: float) -> Chain:
    """The chain for a load path that ends at a `share` (0 to 1) of its sequence.

    A law's time is that of a step over that of the last one; the last one of such a path is not the last one of all.
    """
    if all(term.of != "time" for term in chain.closure):
        return chain
    terms = [t._replace(coefficient=t.coefficient * share) if t.of == "time" else t for t in chain.closure]
    return chain._replace(closure=tuple(terms))


class LawPath(NamedTuple):
    """A chain with a moment law and its load path; rest is added as the first step, as the law acts there too."""

    chain: Chain
    loads: Loads
    """Loads of `s + 1` steps, of which the first are zero."""
    begins: np.ndarray
    """(s + 1,) whether a step starts from rest."""
    time: np.ndarray
    """(s + 1,) step number within the sequence over the last one: 0 at rest, 1 at the last step."""

    def under(self, moment: np.ndarray) -> tuple[Chain, Loads]:
        """The chain without its law, and the loads with the given moments (s + 1, n), N m, in the law's place.

        The moments at rest, in the first row, become constant loads.
        """
        constant = self.chain.constant or no_loads(self.chain)
        bare = self.chain._replace(closure=(), constant=constant._replace(moment=constant.moment + moment[:1]))
        return bare, self.loads._replace(moment=self.loads.moment + moment - moment[:1])

    def asked(self, states: Equilibria) -> np.ndarray:
        """(s + 1, n) moments by the law in the given states, N m."""
        return self._sum(influences(self.chain, self.loads, states, self.time))

    def asked_change(self, states: Equilibria, change: StateChange) -> np.ndarray:
        """(s + 1, n, p) derivatives of the moments by the law in the given states, for a `change` of the states."""
        known = influence_changes(self.chain, self.loads, states, change)
        changes = {name: known[name]() for name in {term.of for term in self.chain.closure} & known.keys()}
        return self._sum(changes) if changes else np.zeros_like(change.bend)

    def _sum(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """(s + 1, n, ...) sum of those terms of the law whose influences are `known`, each (s + 1, n, ...)."""
        moments = [
            term.coefficient.reshape(-1, *[1] * (known[term.of].ndim - 2)) * known[term.of]
            for term in self.chain.closure
            if term.of in known
        ]
        return np.sum(moments, axis=0)


def law_path(chain: Chain, loads: Loads, from_rest: bool | np.ndarray, number: np.ndarray | None) -> LawPath:
    """The `LawPath` of `loads` on `chain`; `number` (s,) holds step numbers as of `time_within`."""
    begins = np.array(np.broadcast_to(from_rest, loads.steps), bool)
    rest = Loads(*(np.zeros_like(field[:1]) for field in loads))._replace(slip=loads.slip[:1])
    whole = Loads(*(np.concatenate(pair) for pair in zip(rest, loads, strict=True)))
    return LawPath(chain, whole, np.append(True, begins), np.append(0.0, time_within(begins, number)))
