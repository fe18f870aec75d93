"""Tensions for one target: a search from many starts, with declared friction that agrees with the cables' travel.

Some thousand random pulls are solved; of each set of pulled cables the pull that leads nearest to the target is a
start, and `descent.py` finds where it leads.  Declared friction must agree with the travel: a cable that the step pays
out gets the slip +1, and the descent is repeated from there.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy

from prb3r.inverse.descent import along_rim, least_pull, nearest_pull
from prb3r.inverse.pull import Pull, lengths
from prb3r.inverse.target import ARRIVED
from prb3r.mechanics.chain import Chain, loads, no_loads
from prb3r.mechanics.equilibrium import Outcome
from prb3r.model.laws.self_consistent import equilibria_of

START_BITS, START_SEED = 12, 3
"""Starts are looked for among 2^12 random pulls, drawn with this seed: some hundred for each set of the prototype's
four cables."""
STARTS = 6
"""Starts that are followed at most; with few unknowns the best solution is nearly always that of the first or second
(`tests/inverse` compares with brute force)."""
RIM_STARTS = 2
"""Pulls, the nearest first, that are followed on along the rim where a target is out of reach; most lead to one end."""
LET_OFF = (1.0, 0.8, 0.5)
"""Factors on the tensions of the pull before, each a start where friction follows the travel: within the dead band of
such friction the disks hardly move, so that a descent from the pull before itself finds no way out."""

Descent = Callable[[Pull, np.ndarray, np.ndarray], np.ndarray | None]
"""A function from a pull, tensions to start from and the largest tensions to nearer ones; None where none stand."""


@dataclass(frozen=True)
class Found:
    """Tensions that a descent has found, with the state that they lead to."""

    tension: np.ndarray
    """(m,) of the cables, N."""
    slip: np.ndarray
    """(m,) declared slip: -1 drawn in, 0 at rest, 1 paid out."""
    place: np.ndarray
    """(3,) x, y (m) and angle (rad) of the target's disk."""
    distance: float
    """Norm of the scaled errors at the target; see `Target.off`."""
    lengths: np.ndarray
    """(m,) lengths of the cables, m; see `pull.lengths`."""
    stress: float
    """Highest bending stress of a plate, Pa; NaN where it is not known."""
    cost: float
    """What the aim minimises: the sum of the tensions, N, or the highest stress, Pa."""

    @property
    def rank(self) -> tuple[float, float, float]:
        """Order among candidates, smaller is better: distance, cost, force.

        Distances within `ARRIVED` count as zero and costs are rounded to three digits.
        """
        distance = 0.0 if self.distance <= ARRIVED else self.distance
        return distance, float(f"{self.cost:.3g}"), float(self.tension.sum())


def natural_limits(chain: Chain) -> np.ndarray:
    """(m,) tension at which each cable alone would bend the plates that it crosses by 2 pi without friction, N.

    0 for a cable that bends nothing: a broken one, or one without offset.
    """
    stiffness = chain.arc / (1 / chain.elastic_stiffness).sum(1)  # hinges and nodes in series over the arc, N m^2
    bend = [
        float(np.sum(np.abs(chain.offset[:reach, j]) * chain.arc[:reach] / stiffness[:reach]))
        for j, reach in enumerate(chain.reach)
    ]
    return np.array([2 * np.pi / per_newton if per_newton else 0.0 for per_newton in bend])


def starts(pull: Pull, most: np.ndarray) -> list[np.ndarray]:
    """Up to `STARTS` tensions (m,), N, that lead near the target, nearest first, each of another set of pulled cables.

    They are solved from rest; presliding and moments that follow the state are left out.
    """
    chain = pull.chain._replace(presliding=0.0, closure=())
    share = scipy.stats.qmc.Sobol(len(most), rng=START_SEED).random_base2(START_BITS)
    tension = np.concatenate([np.zeros((1, len(most))), np.maximum(2 * share - 1, 0) * most])
    tried = loads(chain, tension, elapsed=float(pull.before.steps))
    states = equilibria_of(chain, tried, from_rest=True, detail=False)
    off = np.linalg.norm(pull.target.off(pull.target.place(states)), axis=1)
    nearest: dict[bytes, int] = {}
    for row in np.argsort(off, kind="stable"):
        if np.isfinite(off[row]):
            nearest.setdefault((tension[row] > 0).tobytes(), int(row))
    return [tension[row] for row in list(nearest.values())[:STARTS]]


def pulls_from(
    pull: Pull, start: np.ndarray, most: np.ndarray, before: np.ndarray, descent: Descent = nearest_pull
) -> Iterator[Found]:
    """The pulls that descents from `start` find whose declared slip agrees with the cables' travel.

    The travel is counted from the lengths `before` (m,), m.  First the slip is that of `pull`, then each as it
    travelled.  A cable that is paid out when declared drawn in, and drawn in when declared paid out, sticks: its
    friction lies between the two and is taken as zero.
    """
    seen, last = set(), pull.slip  # slips that were declared before, and the last of them
    while pull.slip.tobytes() not in seen:
        seen.add(pull.slip.tobytes())
        slip, ended = pull.slip, pull_with_slip(pull, start, most, descent)
        travelled = last  # without an equilibrium, the cables whose slip has just been reversed stick
        if ended is not None:
            travelled, start = travel_slip(pull, ended.lengths - before), ended.tension
            pulled = (ended.tension > 0) | taut_when_idle(pull.chain)
            if np.all((travelled == slip) | (slip == 0) | ~pulled):
                yield replace(ended, slip=np.where(pulled, slip, -1.0))
        if travelled.tobytes() in seen:
            travelled = np.where(travelled == slip, slip, 0.0)
        pull, last = replace(pull, slip=np.where(slip == 0, 0.0, travelled), known={}), slip


def taut_when_idle(chain: Chain) -> np.ndarray:
    """(m,) whether a cable may have a tension, and rub, where none is applied: its zero is off, or drifts."""
    own = (chain.constant or no_loads(chain)).tension[0]
    return (own != 0) | (chain.zero_drift * np.ones_like(own) != 0)


def pull_with_slip(pull: Pull, start: np.ndarray, most: np.ndarray, descent: Descent) -> Found | None:
    """The pull that a descent from `start` finds under the slip of `pull`; None without a stable equilibrium."""
    tension = descent(pull, start, most)
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
    return Found(tension, pull.slip, place, distance, lengths(pull.chain, states)[-1], stress, cost)


def travel_slip(pull: Pull, longer: np.ndarray) -> np.ndarray:
    """(m,) slip that agrees with the travel: +1 for a cable that has become `longer` (m,), m, else -1.

    Of a cable that is not pulled it is the slip with which it would rub, were it pulled.  Where friction is not
    declared, or nothing rubs, at holes or pulleys, it is the slip of `pull`.
    """
    chain = pull.chain
    if chain.presliding > 0 or not (chain.friction.any() or np.any(chain.pulley != 1)):
        return pull.slip
    return np.where(longer > 0, 1.0, -1.0)


def best_pull(pull: Pull, most: np.ndarray, before: np.ndarray, near: np.ndarray | None = None) -> Found | None:
    """The best pull for the target; None if none has a stable equilibrium and friction that goes with the travel.

    Parameters
    ----------
    most : (m,) largest tensions, N; 0 for a cable that cannot be pulled.
    before : (m,) lengths of the cables in the state that the step begins in, m.
    near : (m,) tensions to start from first, N; if they lead to the target, that pull is returned, else what they lead
        to is dropped and the pull is the best of all `starts`.
    """
    if near is not None:
        parts = LET_OFF if pull.chain.presliding > 0 else LET_OFF[:1]
        ways = [candidate for part in parts for candidate in pulls_from(pull, part * near, most, before)]
        followed = min(ways, key=lambda candidate: candidate.rank, default=None)
        if followed is not None and followed.distance <= ARRIVED:
            return followed
    candidates = [candidate for start in starts(pull, most) for candidate in pulls_from(pull, start, most, before)]
    candidates.sort(key=lambda candidate: candidate.rank)
    if candidates and candidates[0].distance > ARRIVED:
        for found in candidates[:RIM_STARTS]:
            there = replace(pull, slip=found.slip, known={})
            candidates += pulls_from(there, found.tension, most, before, along_rim)
    return min(candidates, key=lambda candidate: candidate.rank, default=None)
