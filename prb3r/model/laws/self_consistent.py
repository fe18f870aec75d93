"""Self-consistent equilibria of chains whose arcs carry moments that depend on the state, by a fitted moment law.

This is a fixed-point iteration from moments of zero: solve for the equilibria under the present moments, evaluate the
law in these states, move the moments toward its values, until both agree.  Each plate's moment moves by the secant
method, but never away from the law's value: so a law that pushes a plate further than the plate resists diverges
instead of settling on an unstable equilibrium.
"""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from prb3r.mechanics.budget import Allowance
from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.equilibrium import Equilibria, Outcome, solve_chain
from prb3r.mechanics.path import SMALLEST_STEP
from prb3r.model.laws.moment_law import LawPath, law_path

MAX_PASSES = 60
"""Most iterations; each solves the whole path."""
MOMENT_TOLERANCE = 1e-9
"""Largest difference between applied and asked moment at convergence, over the largest moment."""
ANGLE_TOLERANCE = 1e-11
"""Difference of moments that is allowed besides, as the node angle that it causes, rad: equilibria are as exact."""
LARGEST_TRIED_BEND = np.pi
"""Bound on the moments during the iteration, as the node angle that they would cause, rad."""
SMALLEST_SHARE, LARGEST_SHARE = 0.02, 4.0
"""Least and greatest secant step, over the distance to the moments that the law asks for."""
WORK_OF_SEQUENCE, WORK_OF_STEP = 30_000_000, 2_000_000
"""Evaluations of a plate that all iterations together may take, per sequence and per step: some 2 s and 0.1 s."""
NOT_CLOSED = "No equilibrium was found whose moments agree with the fitted moment law."


def equilibria_of(
    chain: Chain,
    loads: Loads,
    *,
    from_rest: bool | np.ndarray = False,
    eigenvalue: bool = False,
    only_its_sign: bool = False,
    detail: bool = True,
    number: np.ndarray | None = None,
    smallest_step: float = SMALLEST_STEP,
    allowance: Allowance | None = None,
) -> Equilibria:
    """Equilibria of `chain` as `solve_chain` finds them, but with the moments of the chain's terms.

    Steps for which no moments agree with the law have no equilibrium.  The eigenvalue takes the moments as loads that
    do not change.

    Parameters
    ----------
    from_rest, eigenvalue, only_its_sign, detail, smallest_step : as for `solve_chain`; of a chain with terms the
        eigenvalue is found even if only its sign is asked for.
    number : (s,) step numbers, for terms that depend on time; absent: 1, 2, ... in each sequence.
    allowance : that of `solve_chain`; for a chain with terms, of all iterations together (absent: `usual_work`).
    """
    if not chain.closure:
        asked: dict[str, Any] = {"smallest_step": smallest_step, "allowance": allowance}
        asked |= {"eigenvalue": eigenvalue, "only_its_sign": only_its_sign}
        return solve_chain(chain, loads, from_rest=from_rest, detail=detail, **asked)
    along = law_path(chain, loads, from_rest, number)
    states, _, closed = settled(along, eigenvalue, smallest_step, allowance)
    return kept(states, closed, detail)


def usual_work() -> Allowance:
    """What all iterations may take if no allowance is given."""
    return Allowance(WORK_OF_SEQUENCE, WORK_OF_STEP)


def settled(
    along: LawPath,
    eigenvalue: bool = False,
    smallest_step: float = SMALLEST_STEP,
    allowance: Allowance | None = None,
) -> tuple[Equilibria, np.ndarray, np.ndarray]:
    """Equilibria along the path (s + 1, rest first), the moments (s + 1, n) applied in them, N m, and (s + 1,) whether
    these agree with the law.

    With `eigenvalue` the lowest eigenvalue of the tangent is computed too; `smallest_step` is that of `solve_chain`.
    No further iteration is made after evaluations of a plate that exceed the `allowance` (absent: `usual_work`).
    """
    chain, allowed = along.chain, allowance or usual_work()
    most = int(allowed.of_sequence * along.begins.sum() + allowed.of_step * len(along.begins))
    stiff = float(np.median(chain.stiffness))  # rigid clamps may be hinges of any stiffness
    least, farthest = ANGLE_TOLERANCE * stiff, LARGEST_TRIED_BEND * stiff
    moment = before = missed = np.zeros((along.loads.steps, chain.plates))
    work = np.zeros(along.loads.steps, np.int64)
    for done in range(MAX_PASSES):
        states = solve_chain(
            *along.under(moment), from_rest=along.begins, smallest_step=smallest_step, allowance=allowance
        )
        work += states.work
        asked = along.asked(states)
        too_large = ~np.isfinite(asked).all(1, keepdims=True)  # under these moments there was no equilibrium
        asked = np.where(too_large, moment / 2, asked)
        miss = asked - moment
        closed = np.abs(miss).max(1) <= MOMENT_TOLERANCE * np.abs(asked).max() + least
        if closed.all() or work.sum() > most:
            break
        share = _share(moment - before, miss - missed) if done else 1.0
        before, missed, moment = moment, miss, np.clip(moment + share * miss, -farthest, farthest)
    if eigenvalue:
        states = solve_chain(*along.under(moment), from_rest=along.begins, eigenvalue=True)
    if chain.remembers:  # steps after one that is not closed continue from a wrong state
        for first in np.flatnonzero(~closed):
            end = first + 1 + np.argmax(np.append(along.begins[first + 1 :], True))
            closed[first:end] = False
    if work.sum() > most:
        states.outcome[~closed] = Outcome.GAVE_UP
    return replace(states, work=work), moment, closed


def _share(change: np.ndarray, of_miss: np.ndarray) -> np.ndarray:
    """Next step of each moment, over its distance to the moment that the law asks for: by the secant, if that leads
    toward the law's moment, else 1.

    `change` (s + 1, n) is the last change of the moments, `of_miss` that of the distances.
    """
    slope = np.divide(of_miss, change, out=np.full_like(change, -1.0), where=change != 0)
    return np.where(slope < 0, np.clip(-1 / np.minimum(slope, -1e-3), SMALLEST_SHARE, LARGEST_SHARE), 1.0)


def kept(states: Equilibria, closed: np.ndarray, detail: bool) -> Equilibria:
    """The `states` (s + 1) without the first, rest; steps that are not `closed` (s + 1,) count as without equilibrium
    and hold NaN.

    Without `detail`, `q`, `tension`, `moment` and `slip` have no steps.
    """
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
