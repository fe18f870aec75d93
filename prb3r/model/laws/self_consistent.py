"""Equilibria of chains whose arcs carry moments that follow the state: the closure of a fitted moment law.

Terms of the law say what a moment is proportional to.  Equilibrium and moments are found in turn, from no moment on:
solve, ask the law for the moments of that state, go toward them, until they are those that were applied.  Each plate's
moment goes by a secant, but never against what the law asks for: so a law that pushes a plate further than the plate
resists runs away instead of settling on an unstable equilibrium.
"""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from prb3r.mechanics.budget import Allowance
from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.equilibrium import Equilibria, Outcome, solve_chain
from prb3r.model.laws.moment_law import LawPath, law_path

MAX_PASSES = 60
MOMENT_TOLERANCE = 1e-9
"""Largest change of a moment that counts as none, of the largest moment."""
ANGLE_TOLERANCE = 1e-11
"""And the bend that a moment may cause to count as none, rad: as exact as equilibria are."""
LARGEST_TRIED_BEND = np.pi
"""No moment larger than that which would bend a rotation of a plate so far, rad, is tried on the way."""
SMALLEST_SHARE, LARGEST_SHARE = 0.02, 4.0
"""Share of the way to the moments that the law asks for, at most and at least."""
WORK_OF_SEQUENCE, WORK_OF_STEP = 30_000_000, 2_000_000
"""What all passes together may take, in evaluations of a plate, for each sequence and each step: some 2 s and 0.1 s."""
NOT_CLOSED = "No equilibrium was found whose moments agree with the fitted moment law."


def equilibria_of(
    chain: Chain,
    loads: Loads,
    *,
    from_rest: bool | np.ndarray = False,
    eigenvalue: bool = False,
    detail: bool = True,
    number: np.ndarray | None = None,
    allowance: Allowance | None = None,
) -> Equilibria:
    """As `prb3r.mechanics.equilibrium.solve`, with the moments of the chain's terms.

    Steps without such moments have no equilibrium.  The eigenvalue takes the moments as loads that do not change.

    Parameters
    ----------
    number : (s,) step numbers, for terms that follow the time; absent: 1, 2, ... in each sequence.
    allowance : that of `solve_chain`; with moments of terms it is `may_take`.
    """
    if not chain.closure:
        asked: dict[str, Any] = {"eigenvalue": eigenvalue, "detail": detail, "allowance": allowance}
        return solve_chain(chain, loads, from_rest=from_rest, **asked)
    along = law_path(chain, loads, from_rest, number)
    states, _, closed = settled(along, eigenvalue)
    return kept(states, closed, detail)


def may_take(along: LawPath) -> int:
    """Evaluations of a plate after which no further pass is made."""
    return int(WORK_OF_SEQUENCE * along.begins.sum() + WORK_OF_STEP * len(along.begins))


def settled(along: LawPath, eigenvalue: bool = False) -> tuple[Equilibria, np.ndarray, np.ndarray]:
    """States along the path, rest first, the moments (s + 1, n) applied there, and (s + 1,) whether the law asks for
    these."""
    chain = along.chain
    stiff = float(np.median(chain.stiffness))  # rigid clamps may be hinges of any stiffness
    least, most = ANGLE_TOLERANCE * stiff, LARGEST_TRIED_BEND * stiff
    moment = before = missed = np.zeros((along.loads.steps, chain.plates))
    work = np.zeros(along.loads.steps, np.int64)
    for done in range(MAX_PASSES):
        states = solve_chain(*along.under(moment), from_rest=along.begins)
        work += states.work
        asked = along.asked(states)
        too_large = ~np.isfinite(asked).all(1, keepdims=True)  # to have an equilibrium
        asked = np.where(too_large, moment / 2, asked)
        miss = asked - moment
        closed = np.abs(miss).max(1) <= MOMENT_TOLERANCE * np.abs(asked).max() + least
        if closed.all() or work.sum() > may_take(along):
            break
        share = _share(moment - before, miss - missed) if done else 1.0
        before, missed, moment = moment, miss, np.clip(moment + share * miss, -most, most)
    if eigenvalue:
        states = solve_chain(*along.under(moment), from_rest=along.begins, eigenvalue=True)
    if chain.remembers:  # what follows an unclosed step is another path
        for first in np.flatnonzero(~closed):
            end = first + 1 + np.argmax(np.append(along.begins[first + 1 :], True))
            closed[first:end] = False
    if work.sum() > may_take(along):
        states.outcome[~closed] = Outcome.GAVE_UP
    return replace(states, work=work), moment, closed


def _share(change: np.ndarray, of_miss: np.ndarray) -> np.ndarray:
    """Share of the way to go: to where the secant of each plate's miss is zero, if that is forward, else all of it."""
    slope = np.divide(of_miss, change, out=np.full_like(change, -1.0), where=change != 0)
    return np.where(slope < 0, np.clip(-1 / np.minimum(slope, -1e-3), SMALLEST_SHARE, LARGEST_SHARE), 1.0)


def kept(states: Equilibria, closed: np.ndarray, detail: bool) -> Equilibria:
    """The states after rest, those that are not closed without equilibrium."""
    arrays = {field.name: getattr(states, field.name) for field in fields(states)}
    arrays = {name: values[1:] for name, values in arrays.items() if values is not None}
    closed = closed[1:]
    for name, values in arrays.items():
        if name not in ("outcome", "iterations", "work") and len(values):
            values[~closed] = np.nan
    arrays["outcome"][~closed & (arrays["outcome"] != Outcome.GAVE_UP)] = Outcome.NO_EQUILIBRIUM
    if not detail:
        arrays |= {name: arrays[name][:0] for name in ("q", "tension", "moment", "slip")}
    return replace(states, closed=closed, **arrays)
