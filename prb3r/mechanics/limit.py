r"""Limit load: how far the loads can grow before the manipulator jumps or buckles.

The path of growing loads is followed until its branch ends (a limit point: no equilibrium nearby under more load) or
the lowest eigenvalue of the tangent ceases to be positive (a bifurcation, as of a straight column), and the factor on
the loads is bracketed.  Equilibria beyond that are not looked for.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.equilibrium import Outcome, solve_chain

FIRST = 0.125
"""First growth of the factor that is tried; every further growth, counted from the start too, is twice as large."""


class Limit(NamedTuple):
    """The limit of growing loads."""

    factor: float
    """Largest stable factor on the loads; infinity if there is no limit up to the largest factor asked for; NaN if a
    step of the path itself is unstable or not solved, or if the work allowed was used up."""
    outcome: Outcome
    """What larger loads meet: `UNSTABLE`, `LIMIT_POINT` or `NO_EQUILIBRIUM`; `CONVERGED` if there is no limit.  With a
    factor of NaN: `GAVE_UP`, or the highest-numbered outcome of the steps of the path."""


def limit_load(
    chain: Chain, path: Loads, *, from_rest: bool = False, most: float = 100.0, tolerance: float = 1e-6
) -> Limit:
    """The largest factor by which all loads of the last step of `path` can be multiplied before the branch of stable
    equilibria ends.

    Constant loads of the chain are not multiplied, and declared slips stay.

    Parameters
    ----------
    from_rest : grow the last step's loads from zero, without the steps before; else follow `path` and grow from there.
        Where plates relax, each load from zero is held for a step, and one beyond the path acts at once.
    most : largest factor that is tried.
    tolerance : relative accuracy of the factor.

    Raises
    ------
    ValueError
        If moments of the chain follow the state (`chain.closure`): they are not followed to a limit.
    """
    if chain.closure:
        raise ValueError("moments that follow the state (empirical_moment) are not followed to a limit")
    start = 0.0 if from_rest else 1.0
    last = Loads(*(field[-1:] for field in path))
    before = Loads(*(field[:0] for field in path)) if from_rest else path
    growth = np.array([FIRST * 2.0**k for k in range(64)])
    trial = np.unique(np.minimum(start + growth, most))

    def outcomes(factors) -> np.ndarray:
        factors = np.asarray(factors, float)
        more = Loads(
            tension=factors[:, None] * last.tension,
            slip=np.repeat(last.slip, len(factors), axis=0),
            force=factors[:, None, None] * last.force,
            tip=factors[:, None] * last.tip,
            moment=factors[:, None] * last.moment,
            elapsed=np.repeat(last.elapsed, len(factors), axis=0),
            rate=np.repeat(last.rate, len(factors), axis=0),
            time=np.repeat(last.time, len(factors), axis=0),
            travel=(0.0 if from_rest else last.travel) + np.abs(factors - start)[:, None] * last.tension,
        )
        steps = Loads(*(np.concatenate(pair) for pair in zip(before, more, strict=True)))
        anew = from_rest and chain.relaxation != 0
        return solve_chain(chain, steps, from_rest=anew, eigenvalue=True, only_its_sign=True).outcome

    ended = outcomes(trial)
    if (ended[: before.steps] != Outcome.CONVERGED).any():
        return Limit(np.nan, Outcome(ended[: before.steps].max()))
    ended = ended[before.steps :]
    if (ended == Outcome.CONVERGED).all():
        return Limit(np.inf, Outcome.CONVERGED)
    first = int(np.argmax(ended != Outcome.CONVERGED))
    low, high, beyond = (trial[first - 1] if first else start), trial[first], Outcome(ended[first])
    while high - low > tolerance * high:
        middle = (low + high) / 2
        outcome = Outcome(outcomes([*trial[:first], low, middle])[-1])
        if outcome == Outcome.CONVERGED:
            low = middle
        else:
            high, beyond = middle, outcome
    if beyond == Outcome.GAVE_UP:
        return Limit(np.nan, beyond)
    return Limit(float(low), beyond)
