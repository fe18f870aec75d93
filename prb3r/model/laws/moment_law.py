"""Moment laws: what the moments on the arcs may follow, and how these change with the state."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.chain import Chain, Loads, no_loads
from prb3r.mechanics.equilibrium import Equilibria


def influences_of_place(chain: Chain) -> dict[str, np.ndarray]:
    """What a moment may follow without following the state, by name: (n,) for every plate."""
    place = np.linspace(-1.0, 1.0, chain.plates) if chain.plates > 1 else np.zeros(1)
    return {"constant": np.ones(chain.plates), "position": place}


def influences(chain: Chain, loads: Loads, states: Equilibria, time: np.ndarray) -> dict[str, np.ndarray]:
    """What a term's moment may follow, by name: (s, n) for every step and plate.

    Parameters
    ----------
    states : with detail.
    time : (s,) of each step within its sequence, from 0 at rest to 1 at its last step.
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
    """Derivatives of states by `p` parameters, or along `p` ways to change them."""

    bend: np.ndarray
    """(s, n, p) of the bends of plates, rad."""
    tension: np.ndarray
    """(s, n, m, p) of the tensions of cables over plates, N."""
    slip: np.ndarray
    """(s, n, m, p) of the slips of cables at plates; no cables where slip is declared."""


def influence_changes(
    chain: Chain, loads: Loads, states: Equilibria, change: StateChange
) -> dict[str, Callable[[], np.ndarray]]:
    """How :func:`influences` change with the state, by name: (s, n, p) when called; what is absent does not."""
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
    """(s, n, m), or with one for all plates where it is declared."""
    return states.slip if chain.presliding else loads.slip[:, None, :]


def time_within(begins: np.ndarray, number: np.ndarray | None = None) -> np.ndarray:
    """(s,) step number over the last one of its sequence; sequences begin where `begins` and are counted from 1."""
    first = np.flatnonzero(np.concatenate([[True], begins[1:]]))
    count = np.diff(np.append(first, len(begins)))
    if number is None:
        number = np.arange(len(begins)) - np.repeat(first, count) + 1
    last = np.repeat(np.asarray(number, float)[first + count - 1], count)
    return np.divide(number, last, out=np.zeros(len(begins)), where=last != 0)


class LawPath(NamedTuple):
    """A chain with a moment law on a load path that begins with rest, as the law acts there too."""

    chain: Chain
    loads: Loads
    """`s + 1` steps."""
    begins: np.ndarray
    """(s + 1,) whether a step starts from rest."""
    time: np.ndarray
    """(s + 1,) of each step within its sequence, from 0 at rest to 1 at its last step."""

    def under(self, moment: np.ndarray) -> tuple[Chain, Loads]:
        """The problem without the law, under given moments (s + 1, n) instead."""
        constant = self.chain.constant or no_loads(self.chain)
        bare = self.chain._replace(closure=(), constant=constant._replace(moment=constant.moment + moment[:1]))
        return bare, self.loads._replace(moment=self.loads.moment + moment - moment[:1])

    def asked(self, states: Equilibria) -> np.ndarray:
        """(s + 1, n) moments that the law asks for in these states."""
        return self._sum(influences(self.chain, self.loads, states, self.time))

    def asked_change(self, states: Equilibria, change: StateChange) -> np.ndarray:
        """(s + 1, n, p) change of what it asks for as the states change."""
        known = influence_changes(self.chain, self.loads, states, change)
        changes = {name: known[name]() for name in {term.of for term in self.chain.closure} & known.keys()}
        return self._sum(changes) if changes else np.zeros_like(change.bend)

    def _sum(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """The terms of the law for `known` influences (s + 1, n, ...)."""
        moments = [
            term.coefficient.reshape(-1, *[1] * (known[term.of].ndim - 2)) * known[term.of]
            for term in self.chain.closure
            if term.of in known
        ]
        return np.sum(moments, axis=0)


def law_path(chain: Chain, loads: Loads, from_rest: bool | np.ndarray, number: np.ndarray | None) -> LawPath:
    """The path of `loads` on `chain`; step numbers are 1, 2, ... in each sequence where there are none."""
    begins = np.array(np.broadcast_to(from_rest, loads.steps), bool)
    rest = Loads(*(np.zeros_like(field[:1]) for field in loads))._replace(slip=loads.slip[:1])
    whole = Loads(*(np.concatenate(pair) for pair in zip(rest, loads, strict=True)))
    return LawPath(chain, whole, np.append(True, begins), np.append(0.0, time_within(begins, number)))
