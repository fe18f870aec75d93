"""A solved load path, with the states at which its derivatives are taken."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from prb3r.mechanics.accepted import AcceptedStates, room_for_states
from prb3r.mechanics.acting import clock
from prb3r.mechanics.budget import Allowance
from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.derivatives.partials import PathStates
from prb3r.mechanics.equilibrium import Equilibria, solve_chain
from prb3r.mechanics.path import SMALLEST_STEP
from prb3r.mechanics.relaxation import times_waited

SUBSTEPS = 64
"""Accepted sub-steps per load step for which there is room in the first solve, where states depend on those before; if
there are more, the path is solved once more with room for all."""
FOLLOWS_STATE = "moments that follow the state are not differentiated"


@dataclass(frozen=True)
class SolvedPath:
    """A chain, its `s` load steps and their equilibria; derivatives by any parameters can be asked for later."""

    chain: Chain
    loads: Loads
    begins: np.ndarray
    """(s,) whether a step follows on rest instead of on the step before."""
    equilibria: Equilibria
    states: PathStates
    """The states to differentiate: the equilibria of the solved steps, or, where states depend on those before, rest
    and all accepted sub-steps of the solved steps."""


def solve_path(
    chain: Chain,
    loads: Loads,
    *,
    from_rest: bool | np.ndarray = False,
    smallest_step: float = SMALLEST_STEP,
    allowance: Allowance | None = None,
) -> SolvedPath:
    """Solve `chain` under every step of `loads`, and keep the states at which derivatives are taken.

    `from_rest`, `smallest_step` and `allowance` are those of `solve_chain`.

    Raises
    ------
    ValueError
        For a chain with terms of a moment law; `prb3r.model.laws.derivatives` differentiates such chains.
    """
    if chain.closure:
        raise ValueError(FOLLOWS_STATE)
    anew = np.array(np.broadcast_to(from_rest, loads.steps), bool)
    kept = room_for_states(chain)
    if chain.remembers:
        kept = room_for_states(chain, 1 + SUBSTEPS * loads.steps)
    asked: dict[str, Any] = {"from_rest": anew, "smallest_step": smallest_step, "allowance": allowance}
    equilibria = solve_chain(chain, loads, accepted=kept, **asked)
    if kept.noted[0] > len(kept.row) > 0:
        kept = room_for_states(chain, int(kept.noted[0]))
        equilibria = solve_chain(chain, loads, accepted=kept, **asked)
    good = ~np.isnan(equilibria.angle[:, -1])
    if chain.remembers:
        return SolvedPath(chain, loads, anew, equilibria, _sub_steps(kept, good, anew, clock(chain, loads)[:, 0]))
    row = 1 + np.flatnonzero(good)
    nothing = np.zeros((len(row), *chain.offset.shape))
    ones = np.ones(len(row))
    states = PathStates(row, row, ones, ones, row < 0, row - 1, equilibria.q[good], nothing)
    return SolvedPath(chain, loads, anew, equilibria, states)


def _sub_steps(kept: AcceptedStates, good: np.ndarray, from_rest: np.ndarray, time: np.ndarray) -> PathStates:
    """Rest and all accepted sub-steps `kept` of the solved (`good`, (s,)) steps; those of failed steps are left out.

    `from_rest` (s,): the steps that start from rest; `time` (s,): that of each by the `clock`.
    """
    came_from, last = np.zeros(1 + len(good), np.int64), 0
    for s, converged in enumerate(good, 1):
        last = 0 if from_rest[s - 1] else last
        came_from[s] = last
        last = s if converged else last
    states = np.flatnonzero(np.concatenate([[good.any()], good])[kept.row[: kept.noted[0]]])
    row = kept.row[states]
    edge = np.flatnonzero(np.diff(row, prepend=-1, append=-1))
    first, final = np.zeros(len(row), bool), np.zeros(len(row), bool)
    first[edge[:-1]], final[edge[1:] - 1] = True, True
    last_row, share = came_from[row], kept.share[states]
    takes = np.concatenate([[0.0], times_waited(time, came_from[1:], from_rest)])
    return PathStates(
        row=row,
        last=last_row,
        share=share,
        waited=share * takes[row],
        fresh=first & (last_row == 0),
        write=np.where(final, row - 1, -1),
        q=kept.q[states],
        slip=kept.slip[states],
    )
