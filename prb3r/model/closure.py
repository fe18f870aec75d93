"""Equilibria of chains whose arcs carry moments that follow the state: the closure of a fitted moment law.

Terms of the law say what a moment is proportional to.  Equilibrium and moments are found in turn, from no moment on:
solve, ask the law for the moments of that state, go toward them, until they are those that were applied.  Each plate's
moment goes by a secant, but never against what the law asks for: so a law that pushes a plate further than the plate
resists runs away instead of settling on an unstable equilibrium.
"""

from dataclasses import fields, replace

import numpy as np

from prb3r.mechanics.chain import Chain, Loads, no_loads
from prb3r.mechanics.equilibrium import Equilibria, Outcome, solve

MAX_PASSES = 60
TOLERANCE = 1e-9
"""Largest change of a moment that counts as none, of the largest moment."""
ANGLE_TOLERANCE = 1e-11
"""And the bend that a moment may cause to count as none, rad: as exact as equilibria are."""
FARTHEST = np.pi
"""No moment larger than that which would bend a rotation of a plate so far, rad, is tried on the way."""
SHORTEST, LONGEST = 0.02, 4.0
"""Share of the way to the moments that the law asks for, at most and at least."""
NOT_CLOSED = "No equilibrium was found whose moments agree with the fitted moment law."


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
    slip = states.slip if chain.presliding else loads.slip[:, None, :]
    each = {
        **influences_of_place(chain),
        "bend": bend,
        "bend_cubed": bend**3,
        "tension": pull.sum(-1),
        "wrap": pull.sum(-1) * np.cumsum(np.abs(bend), axis=1),
        "direction": (slip * pull).sum(-1),
        "time": time[:, None],
    }
    return {name: np.broadcast_to(values, shape) for name, values in each.items()}


def time_within(begins: np.ndarray, number: np.ndarray | None = None) -> np.ndarray:
    """(s,) step number over the last one of its sequence; sequences begin where `begins` and are counted from 1."""
    first = np.flatnonzero(np.concatenate([[True], begins[1:]]))
    count = np.diff(np.append(first, len(begins)))
    if number is None:
        number = np.arange(len(begins)) - np.repeat(first, count) + 1
    last = np.repeat(np.asarray(number, float)[first + count - 1], count)
    return np.divide(number, last, out=np.zeros(len(begins)), where=last != 0)


def equilibria_of(
    chain: Chain,
    loads: Loads,
    *,
    from_rest: bool | np.ndarray = False,
    eigenvalue: bool = False,
    detail: bool = True,
    number: np.ndarray | None = None,
) -> Equilibria:
    """As `prb3r.mechanics.equilibrium.solve`, with the moments of the chain's terms.

    Steps without such moments have no equilibrium.  The eigenvalue takes the moments as loads that do not change.

    Parameters
    ----------
    number : (s,) step numbers, for terms that follow the time; absent: 1, 2, ... in each sequence.
    """
    if not chain.closure:
        return solve(chain, loads, from_rest=from_rest, eigenvalue=eigenvalue, detail=detail)
    begins = np.array(np.broadcast_to(from_rest, loads.steps), bool)
    time = np.append(0.0, time_within(begins, number))
    rest = Loads(*(np.zeros_like(field[:1]) for field in loads))._replace(slip=loads.slip[:1])
    path = Loads(*(np.concatenate(pair) for pair in zip(rest, loads, strict=True)))  # the law acts at rest too
    begins = np.append(True, begins)
    constant = chain.constant or no_loads(chain)
    stiffest = float(chain.stiffness.max())
    least, most = ANGLE_TOLERANCE * stiffest, FARTHEST * stiffest

    def under(moment: np.ndarray, eigenvalue: bool) -> Equilibria:
        bare = chain._replace(closure=(), constant=constant._replace(moment=constant.moment + moment[:1]))
        further = path._replace(moment=path.moment + moment - moment[:1])
        return solve(bare, further, from_rest=begins, eigenvalue=eigenvalue)

    moment = before = missed = np.zeros((path.steps, chain.plates))
    for done in range(MAX_PASSES):
        states = under(moment, False)
        known = influences(chain, path, states, time)
        asked = np.sum([term.coefficient * known[term.of] for term in chain.closure], axis=0)
        asked = np.where(
            np.isfinite(asked).all(1, keepdims=True), asked, moment / 2
        )  # too large to have an equilibrium
        miss = asked - moment
        closed = np.abs(miss).max(1) <= TOLERANCE * np.abs(asked).max() + least
        if closed.all():
            break
        share = _share(moment - before, miss - missed) if done else 1.0
        before, missed, moment = moment, miss, np.clip(moment + share * miss, -most, most)
    if eigenvalue:
        states = under(moment, True)
    if chain.presliding:  # what follows an unclosed step is another path
        for first in np.flatnonzero(~closed):
            end = first + 1 + np.argmax(np.append(begins[first + 1 :], True))
            closed[first:end] = False
    return _kept(states, closed, detail)


def _share(change: np.ndarray, of_miss: np.ndarray) -> np.ndarray:
    """Share of the way to go: to where the secant of each plate's miss is zero, if that is forward, else all of it."""
    slope = np.divide(of_miss, change, out=np.full_like(change, -1.0), where=change != 0)
    return np.where(slope < 0, np.clip(-1 / np.minimum(slope, -1e-3), SHORTEST, LONGEST), 1.0)


def _kept(states: Equilibria, closed: np.ndarray, detail: bool) -> Equilibria:
    """The states after rest, those that are not closed without equilibrium."""
    arrays = {field.name: getattr(states, field.name) for field in fields(states)}
    arrays = {name: values[1:] for name, values in arrays.items() if values is not None}
    closed = closed[1:]
    for name, values in arrays.items():
        if name not in ("outcome", "iterations") and len(values):
            values[~closed] = np.nan
    arrays["outcome"][~closed] = Outcome.NO_EQUILIBRIUM
    if not detail:
        arrays |= {name: arrays[name][:0] for name in ("q", "tension", "moment", "slip")}
    return replace(states, closed=closed, **arrays)
