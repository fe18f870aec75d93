"""Local optimisation of cable tensions: first to the target, then to the least force or stress that stays on it.

The distance to the target is minimised by bounded least squares.  If it vanishes, the sum of the tensions or the
highest stress is then minimised by sequential quadratic programming, with the target as an equality constraint.  If it
does not, the distance itself is minimised further, along the rim of the workspace.  Derivatives are exact, except those
of the stress, which are differenced.
"""

import numpy as np
import scipy

from prb3r.inverse.pull import Pull
from prb3r.inverse.target import ARRIVED

SETTLED = 1e-10
"""Relative change of the squared distance, or of the tensions, at which least squares stop.  Where the target is
reached the squared distance falls to nothing, so that its change ends only searches that stay away from the target."""
MOST_STEPS = 60
"""Largest number of evaluations of a least-squares search.  Gauss-Newton reaches a target within the workspace in about
ten; a search that takes more creeps along the rim of the workspace."""
FAR_OFF = 1e3
"""Distance, in straight lengths, that is assigned to tensions without an equilibrium."""
STANDING_PARTS = (1.0, 0.7, 0.5, 0.3, 0.1)
"""Factors on the tensions of a start, tried in turn until the manipulator has an equilibrium under the scaled start."""
STRESS_STEP = 1e-6
"""Step of a tension for the differences of the stress, as a share of the largest allowed tension."""
WORTH_FORCE = 1e-3
"""Share by which the stress must be below that of the tensions of least sum for other tensions to be preferred."""
IDLE_SHARE = 1e-9
"""Share of the largest allowed tension below which a tension counts as zero."""


def _with_idle(free: np.ndarray, tension: np.ndarray) -> np.ndarray:
    """(m,) the tensions of the cables in the mask `free` (m,), and 0 for the cables that cannot be pulled."""
    out = np.zeros(len(free))
    out[free] = tension
    return out


def nearest_pull(pull: Pull, start: np.ndarray, most: np.ndarray) -> np.ndarray | None:
    """(m,) tensions between 0 and `most`, N, with the least distance to the target that a descent from `start` finds.

    Where the manipulator has no equilibrium under `start`, the factors `STANDING_PARTS` of it are tried; None if it has
    none under any of them.
    """
    standing = [part * start for part in STANDING_PARTS if pull.stands(part * start)][:1]
    if not standing:
        return None
    free = most > 0

    def whole(part: np.ndarray) -> np.ndarray:
        """(m,) tensions, N, from the free ones as shares of their limits."""
        return _with_idle(free, part * most[free])

    result = scipy.optimize.least_squares(
        lambda part: pull(whole(part)).off,
        np.clip(standing[0][free] / most[free], 0, 1),
        jac=lambda part: np.nan_to_num(pull(whole(part)).rate[:, free]) * most[free],
        bounds=(0, 1),
        method="dogbox",
        ftol=SETTLED,
        xtol=SETTLED,
        gtol=SETTLED,
        max_nfev=MOST_STEPS,
    )
    return whole(result.x)


def along_rim(pull: Pull, start: np.ndarray, most: np.ndarray) -> np.ndarray | None:
    """(m,) tensions, N, that bring the disk nearer to a target out of reach, by a quasi-Newton descent from `start`.

    On the rim of the workspace, cables that pull against each other bring the disk nearer only slowly.  Least squares
    neglect second derivatives and stop far from the end of such a valley.  `start` comes back if nothing nearer is
    found, and None if the manipulator has no equilibrium under it.
    """
    if not pull.stands(start):
        return None
    free = most > 0

    def whole(part: np.ndarray) -> np.ndarray:
        """(m,) tensions, N, from the free ones as shares of their limits."""
        return _with_idle(free, np.clip(part, 0, 1) * most[free])

    def distance(part: np.ndarray) -> tuple[float, np.ndarray]:
        """The norm of the errors and its derivatives by the shares; `FAR_OFF` and 0 without an equilibrium."""
        off, rate = pull(whole(part))
        norm = float(np.linalg.norm(off))
        if not np.isfinite(norm) or not np.isfinite(rate).all() or norm == 0:
            return (0.0 if norm == 0 else FAR_OFF), np.zeros(free.sum())
        return norm, off / norm @ rate[:, free] * most[free]

    result = scipy.optimize.minimize(
        distance,
        start[free] / most[free],
        jac=True,
        method="SLSQP",
        bounds=[(0, 1)] * int(free.sum()),
        options={"ftol": SETTLED, "maxiter": 100},
    )
    tension = np.where(whole(result.x) < IDLE_SHARE * most, 0.0, whole(result.x))
    return tension if np.linalg.norm(pull(tension).off) < np.linalg.norm(pull(start).off) else start


def least_pull(pull: Pull, start: np.ndarray, most: np.ndarray) -> np.ndarray:
    """(m,) tensions, N, of least force or stress, by the aim, that keep the disk on the target as `start` does.

    If none cost less, these are `start` without spare cables.
    """
    lightest = least_force(pull, start, most)
    return lightest if pull.aim.least == "force" else least_stress(pull, lightest, most)


def least_force(pull: Pull, start: np.ndarray, most: np.ndarray) -> np.ndarray:
    """(m,) tensions, N, of least sum that keep the disk on the target as `start` does, without spare cables.

    If no smaller sum is found, these are `start` without spare cables.
    """
    free = most > 0
    scale = most[free].max()

    def whole(part: np.ndarray) -> np.ndarray:
        """(m,) tensions, N, from the free ones in units of `scale`."""
        return _with_idle(free, part * scale)

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
    tension = np.where(whole(result.x) < IDLE_SHARE * scale, 0.0, whole(result.x))
    tension = settled_on_target(pull, tension, most)
    better = np.linalg.norm(pull(tension).off) <= ARRIVED and tension.sum() < start.sum()
    return without_spare(pull, tension if better else start, most)


def least_stress(pull: Pull, start: np.ndarray, most: np.ndarray) -> np.ndarray:
    """(m,) tensions, N, on the target with the lowest peak stress of all plates, by a descent from `start`.

    The variables are the free tensions and, last, a common bound on the stresses of all plates, which is minimised.  In
    this form the problem stays smooth where another plate becomes the most stressed one.  `start` is returned unless
    the stress falls by more than the share `WORTH_FORCE`.
    """
    free = most > 0
    scale, highest = most.max(), pull.cost(start)
    known = np.isfinite(pull.aim.fibre)
    if not highest > 0:
        return start

    def whole(part: np.ndarray) -> np.ndarray:
        """(m,) tensions, N, from the free ones in units of `scale`; the last variable, the bound, is left out."""
        return _with_idle(free, np.clip(part[:-1], 0, most[free] / scale) * scale)

    def room(part: np.ndarray) -> np.ndarray:
        """The bound less the stress of each plate whose stress is known, in units of `highest`; to be kept positive."""
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
    tension = np.where(whole(result.x) < IDLE_SHARE * scale, 0.0, whole(result.x))
    tension = settled_on_target(pull, tension, most)
    better = np.linalg.norm(pull(tension).off) <= ARRIVED and pull.cost(tension) < (1 - WORTH_FORCE) * highest
    return tension if better else start


def without_spare(pull: Pull, tension: np.ndarray, most: np.ndarray) -> np.ndarray:
    """(m,) tensions, N, without the cables that can be left idle; the cable of least tension is tried first.

    The least sum of tensions needs no more cables than the target has coordinates.  At the kinks of friction that
    follows the cables' travel, the descent may have stopped with more.
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
    """(m,) tensions, N, after up to five Newton steps onto the target, by the cables that are pulled and below `most`.

    A descent under constraints ends near the target; this brings it well within `ARRIVED`.
    """
    for _ in range(5):
        off, rate = pull(tension)
        if np.linalg.norm(off) < 1e-3 * ARRIVED or not pull.stands(tension):
            break
        free = (tension > 0) & (tension < most)
        step = np.zeros_like(tension)
        step[free] = np.linalg.lstsq(rate[:, free], -off, rcond=None)[0]
        tension = np.clip(tension + step, 0, most)
    return tension
