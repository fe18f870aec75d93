"""Tensions for one target: nearest first, then least force or stress; from many starts, with friction along the travel.

The places that some thousand pulls lead to give the starts, one for each set of cables that are pulled; what each leads
to is found by descents.  Declared friction must go with the travel: a cable that the step pays out gets the slip +1,
and the search goes on from there.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy

from prb3r.inverse.descent import least_pull, nearest_pull
from prb3r.inverse.pull import Pull, lengths
from prb3r.inverse.target import ARRIVED
from prb3r.mechanics.chain import Chain, loads
from prb3r.mechanics.equilibrium import Outcome
from prb3r.model.laws.self_consistent import equilibria_of

START_BITS, START_SEED = 12, 3
"""Starts are looked for among 2^12 pulls: some hundred for each set of cables of the prototype's four."""
STARTS = 6
"""So many starts are followed; the solution of a problem with few unknowns is nearly always that of the first or
second (`tests/inverse` compares with brute force)."""
LET_OFF = (1.0, 0.8, 0.5)
"""Parts of the pull before that are followed on where friction goes with the travel: within its dead band the disks
hardly move, so that a search that begins there sees no way out of it."""


@dataclass(frozen=True)
class Found:
    """Tensions, and what they do."""

    tension: np.ndarray
    """(m,) of the cables, N."""
    slip: np.ndarray
    """(m,) declared slip: -1 drawn in, 0 at rest, 1 paid out."""
    place: np.ndarray
    """(3,) of the target's disk."""
    distance: float
    """Off the target, in shares of the length and rad."""
    lengths: np.ndarray
    """(m,) of the cables."""
    stress: float
    """Highest bending stress of a plate, Pa; NaN where it is not known."""
    cost: float
    """What is to be least: the sum of the tensions, N, or the highest stress, Pa."""
    steady: bool
    """Whether the slip goes with the travel of every cable that is pulled, or is none as the cable sticks."""

    @property
    def rank(self) -> tuple[bool, float, float, float]:
        """Smaller is better: first friction that goes with the travel, distance, cost (to three digits), force."""
        distance = 0.0 if self.distance <= ARRIVED else self.distance
        return not self.steady, distance, float(f"{self.cost:.3g}"), float(self.tension.sum())


def natural_limits(chain: Chain) -> np.ndarray:
    """(m,) tension at which each cable alone would bend what it drives by a whole turn if nothing rubbed, N."""
    stiffness = chain.arc / (1 / chain.stiffness).sum(1)  # bending stiffness: hinges and nodes in series over the arc
    bend = [
        float(np.sum(np.abs(chain.offset[:reach, j]) * chain.arc[:reach] / stiffness[:reach]))
        for j, reach in enumerate(chain.reach)
    ]
    return np.array([2 * np.pi / per_newton if per_newton else 0.0 for per_newton in bend])


def starts(pull: Pull, most: np.ndarray) -> list[np.ndarray]:
    """Tensions that lead near the target, nearest first, each with another set of cables."""
    chain = pull.chain._replace(presliding=0.0, closure=())
    share = scipy.stats.qmc.Sobol(len(most), rng=START_SEED).random_base2(START_BITS)
    tension = np.concatenate([np.zeros((1, len(most))), np.maximum(2 * share - 1, 0) * most])
    states = equilibria_of(chain, loads(chain, tension), from_rest=True, detail=False)
    off = np.linalg.norm(pull.target.off(pull.target.place(states)), axis=1)
    nearest: dict[bytes, int] = {}
    for row in np.argsort(off, kind="stable"):
        if np.isfinite(off[row]):
            nearest.setdefault((tension[row] > 0).tobytes(), int(row))
    return [tension[row] for row in list(nearest.values())[:STARTS]]


def pulls_from(pull: Pull, start: np.ndarray, most: np.ndarray, before: np.ndarray) -> Iterator[Found]:
    """What `start` leads to, with the slip that goes with the travel from the lengths `before` (m,).

    First all cables are drawn in, then each as it travelled.  A cable that is paid out when it is thought drawn in and
    the reverse sticks: its friction lies between the two and is taken as none.
    """
    seen, last = set(), pull.slip
    while pull.slip.tobytes() not in seen:
        seen.add(pull.slip.tobytes())
        slip, ended = pull.slip, pull_with_slip(pull, start, most)
        travelled = last  # where nothing stands still, the cables that have been turned stick
        if ended is not None:
            travelled, start = travel_slip(pull, ended.tension, ended.lengths - before), ended.tension
            yield replace(ended, steady=bool(np.all((travelled == slip) | (slip == 0))))
        if travelled.tobytes() in seen:
            travelled = np.where(travelled == slip, slip, 0.0)
        pull, last = replace(pull, slip=np.where(slip == 0, 0.0, travelled), known={}), slip


def pull_with_slip(pull: Pull, start: np.ndarray, most: np.ndarray) -> Found | None:
    """What `start` leads to with the slip of `pull`; None where nothing stable does."""
    tension = nearest_pull(pull, start, most)
    if tension is None:
        return None
    if np.linalg.norm(pull(tension).off) <= ARRIVED:
        tension = least_pull(pull, tension, most)
    states = pull.states(tension)
    if states.outcome[-1] != Outcome.CONVERGED:
        return None
    place = pull.target.place(states)[-1]
    distance = float(np.linalg.norm(pull.target.off(place)))
    stress, cost = float(np.fmax.reduce(pull.stress_of(states))), pull.cost(tension)
    return Found(tension, pull.slip, place, distance, lengths(pull.chain, states)[-1], stress, cost, steady=False)


def travel_slip(pull: Pull, tension: np.ndarray, longer: np.ndarray) -> np.ndarray:
    """(m,) slip of each cable that has become so much `longer` (m,) in the step; -1 where nothing is pulled."""
    if pull.chain.presliding > 0 or not pull.chain.friction.any():
        return pull.slip
    return np.where((tension > 0) & (longer > 0), 1.0, -1.0)


def best_pull(pull: Pull, most: np.ndarray, before: np.ndarray, near: np.ndarray | None = None) -> Found | None:
    """The best of all that the starts lead to, `near` among them; None where nothing stands still.

    Parameters
    ----------
    most : (m,) largest tensions, N; 0 for a cable that cannot be pulled.
    before : (m,) lengths of the cables in the state that the step begins in, m.
    near : (m,) tensions to follow first; others are looked for only if they do not lead to the target.
    """
    if near is not None:
        parts = LET_OFF if pull.chain.presliding > 0 else LET_OFF[:1]
        ways = [candidate for part in parts for candidate in pulls_from(pull, part * near, most, before)]
        followed = min(ways, key=lambda candidate: candidate.rank, default=None)
        if followed is not None and followed.steady and followed.distance <= ARRIVED:
            return followed
    candidates = [candidate for start in starts(pull, most) for candidate in pulls_from(pull, start, most, before)]
    return min(candidates, key=lambda candidate: candidate.rank, default=None)
