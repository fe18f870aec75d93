"""Descents from tensions: to the target, and along the pulls that lead there to the one of least force or stress.

The distance to the target is brought down (bounded least squares); where it vanishes, the sum of the tensions, or the
highest stress, is brought down along the pulls that keep it at zero (sequential quadratic programming).  Both use exact
derivatives, but for those of the stress, which are differences.
"""

import numpy as np
import scipy

from prb3r.inverse.pull import Pull
from prb3r.inverse.target import ARRIVED

SETTLED = 1e-10
"""Relative change of squared distance and tensions at which the nearest pull has settled; where the target is reached
the former falls to nothing, so that only what stays away from it ends so."""
MOST_STEPS = 60
"""Steps of a search; Gauss-Newton reaches what can be reached in ten, the rest creeps along the workspace's rim."""
STANDING_PARTS = (1.0, 0.7, 0.5, 0.3, 0.1)
"""What is tried of a start, the first under which the manipulator stands still."""
STRESS_STEP = 1e-6
"""Change of a tension for differences of the stress, of the largest one."""
WORTH_FORCE = 1e-3
"""Share by which the stress must fall for tensions that are not of least sum."""
SHUT = 1e-9
"""A tension below this share of the largest allowed one is none."""


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
    """Tensions of least cost that keep the disk where `start` has brought it; `start` where nothing costs less."""
    lightest = least_force(pull, start, most)
    return lightest if pull.aim.least == "force" else least_stress(pull, lightest, most)


def least_force(pull: Pull, start: np.ndarray, most: np.ndarray) -> np.ndarray:
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


def least_stress(pull: Pull, start: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Tensions with the least highest stress of a plate that keep the disk where `start` has brought it.

    A bound on the stress of every plate is brought down together with the tensions.
    """
    free = np.flatnonzero(most > 0)
    scale, highest = most.max(), pull.cost(start)
    known = np.isfinite(pull.aim.fibre)
    if not highest > 0:
        return start

    def whole(part: np.ndarray) -> np.ndarray:
        tension = np.zeros_like(most)
        tension[free] = np.clip(part[:-1], 0, most[free] / scale) * scale
        return tension

    def room(part: np.ndarray) -> np.ndarray:
        return part[-1] - pull.stress(whole(part))[known] / highest

    def room_rate(part: np.ndarray) -> np.ndarray:
        here, columns = room(part), []
        for unit in np.eye(len(part))[:-1] * STRESS_STEP:
            way = -1.0 if part[unit > 0][0] * scale >= most[free][unit[:-1] > 0][0] else 1.0  # not beyond the bound
            columns.append((room(part + way * unit) - here) / (way * STRESS_STEP))
        return np.column_stack([*columns, np.ones(len(here))])

    def off_rate(part: np.ndarray) -> np.ndarray:
        rate = pull(whole(part)).rate[:, free] * scale
        return np.column_stack([rate, np.zeros(len(rate))])

    result = scipy.optimize.minimize(
        lambda part: part[-1],
        np.append(start[free] / scale, 1.0),
        jac=lambda part: np.eye(len(part))[-1],
        method="SLSQP",
        bounds=[*((0, bound / scale) for bound in most[free]), (0, None)],
        constraints=[
            {"type": "eq", "fun": lambda part: pull(whole(part)).off, "jac": off_rate},
            {"type": "ineq", "fun": room, "jac": room_rate},
        ],
        options={"ftol": 1e-9, "maxiter": 100},
    )
    tension = np.where(whole(result.x) < SHUT * scale, 0.0, whole(result.x))
    tension = settled_on_target(pull, tension, most)
    better = np.linalg.norm(pull(tension).off) <= ARRIVED and pull.cost(tension) < (1 - WORTH_FORCE) * highest
    return tension if better else start


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
