"""Tensions for one target: nearest first, then least force; from many starts, with friction that goes with the travel.

The places that some thousand pulls lead to give the starts, one for each set of cables that are pulled.  From each, the
distance to the target is brought down (bounded least squares); where it vanishes, the sum of the tensions is brought
down along the pulls that keep it at zero (sequential quadratic programming).  Both use exact derivatives.  Declared
friction must go with the travel: a cable that the step pays out gets the slip +1, and the search goes on from there.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy

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
SETTLED = 1e-10
"""Relative change of squared distance and tensions at which the nearest pull has settled; where the target is reached
the former falls to nothing, so that only what stays away from it ends so."""
MOST_STEPS = 60
"""Steps of a search; Gauss-Newton reaches what can be reached in ten, the rest creeps along the workspace's rim."""
STANDING_PARTS = (1.0, 0.7, 0.5, 0.3, 0.1)
"""What is tried of a start, the first under which the manipulator stands still."""
LET_OFF = (1.0, 0.8, 0.5)
"""Parts of the pull before that are followed on where friction goes with the travel: within its dead band the disks
hardly move, so that a search that begins there sees no way out of it."""
SHUT = 1e-9
"""A tension below this share of the largest allowed one is none."""


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
    steady: bool
    """Whether the slip goes with the travel of every cable that is pulled, or is none as the cable sticks."""

    @property
    def rank(self) -> tuple[bool, float, float]:
        """Smaller is better: first friction that goes with the travel, then the distance, then the force."""
        return not self.steady, 0.0 if self.distance <= ARRIVED else self.distance, float(self.tension.sum())


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


def nearest_pull(pull: Pull, start: np.ndarray, most: np.ndarray) -> np.ndarray | None:
    """Tensions within 0 and `most` that bring the disk as near to the target as `start` leads.

    Where the manipulator does not stand still under `start`, parts of it are tried; None if nothing does.
    """
    standing = [part * start for part in STANDING_PARTS if pull.stands(part * start)][:1]
    if not standing:
        return None
    free = most > 0

    def whole(part: np.ndarray) -> np.ndarray:
        tension = np.zeros_like(most)
        tension[free] = part * most[free]
        return tension

    result = scipy.optimize.least_squares(
        lambda part: pull(whole(part)).off,
        np.clip(standing[0][free] / most[free], 0, 1),
        jac=lambda part: pull(whole(part)).rate[:, free] * most[free],
        bounds=(0, 1),
        method="dogbox",
        ftol=SETTLED,
        xtol=SETTLED,
        gtol=SETTLED,
        max_nfev=MOST_STEPS,
    )
    return whole(result.x)


def least_pull(pull: Pull, start: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Tensions of least sum that keep the disk where `start` has brought it; `start` where nothing less does."""
    free = most > 0
    scale = most[free].max()

    def whole(part: np.ndarray) -> np.ndarray:
        tension = np.zeros_like(most)
        tension[free] = part * scale
        return tension

    result = scipy.optimize.minimize(
        np.sum,
        start[free] / scale,
        jac=np.ones_like,
        method="SLSQP",
        bounds=[(0, bound / scale) for bound in most[free]],
        constraints={
            "type": "eq",
            "fun": lambda part: pull(whole(part)).off,
            "jac": lambda part: pull(whole(part)).rate[:, free] * scale,
        },
        options={"ftol": 1e-12, "maxiter": 100},
    )
    tension = np.where(whole(result.x) < SHUT * scale, 0.0, whole(result.x))
    tension = settled_on_target(pull, tension, most)
    better = np.linalg.norm(pull(tension).off) <= ARRIVED and tension.sum() < start.sum()
    return without_spare(pull, tension if better else start, most)


def without_spare(pull: Pull, tension: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Tensions without those cables that can be left idle, the least pulled first.

    A sum of tensions is least with as many cables as coordinates are asked for; at the kinks of friction that follows
    the travel, the descent before may have stopped short of that.
    """
    for cable in np.argsort(tension):
        if (tension > 0).sum() <= pull.target.asked.sum():
            break
        idle = np.where(np.arange(len(most)) == cable, 0.0, most)
        other = nearest_pull(pull, np.minimum(tension, idle), idle) if tension[cable] > 0 else None
        if other is not None and np.linalg.norm(pull(other).off) <= ARRIVED and other.sum() < tension.sum():
            tension = other
    return tension


def settled_on_target(pull: Pull, tension: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Tensions moved onto the target by those cables alone that are pulled and not at their limit."""
    for _ in range(5):
        off, rate = pull(tension)
        if np.linalg.norm(off) < 1e-3 * ARRIVED:
            break
        free = (tension > 0) & (tension < most)
        step = np.zeros_like(tension)
        step[free] = np.linalg.lstsq(rate[:, free], -off, rcond=None)[0]
        tension = np.clip(tension + step, 0, most)
    return tension


def pulls_from(pull: Pull, start: np.ndarray, most: np.ndarray, before: np.ndarray) -> Iterator[Found]:
    """What `start` leads to, with the slip that goes with the travel from the lengths `before` (m,).

    First all cables are drawn in, then each as it travelled.  A cable that is paid out when it is thought drawn in and
    the reverse sticks: its friction lies between the two and is taken as none.
    """
    seen, last = set(), pull.slip
    while pull.slip.tobytes() not in seen:
        seen.add(pull.slip.tobytes())
        slip, found = pull.slip, pull_with_slip(pull, start, most)
        travelled = last  # where nothing stands still, the cables that have been turned stick
        if found is not None:
            travelled, start = travel_slip(pull, found.tension, found.lengths - before), found.tension
            yield replace(found, steady=bool(np.all((travelled == slip) | (slip == 0))))
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
    return Found(tension, pull.slip, place, distance, lengths(pull.chain, states)[-1], steady=False)


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
        ways = [found for part in parts for found in pulls_from(pull, part * near, most, before)]
        followed = min(ways, key=lambda found: found.rank, default=None)
        if followed is not None and followed.steady and followed.distance <= ARRIVED:
            return followed
    candidates = [found for start in starts(pull, most) for found in pulls_from(pull, start, most, before)]
    return min(candidates, key=lambda found: found.rank, default=None)
