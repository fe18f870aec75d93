"""Squared distances, in units of noise, from a change of readings to the nearest that other explanations come to it.

They are found in the linear model first; where a rival comes close, it is refitted with the full rig (Gauss-Newton
steps with the Jacobian kept).
"""

from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np

from prb3r.proof.concealed.responses import Response, Responses
from prb3r.proof.settings import SETTINGS


def linear_distance(responses: Responses, change: np.ndarray, rival: Response) -> float:
    """Squared distance from a whitened change (r + c,) to a rival effect in the linear model.

    Constants and sizes are fitted by least squares; a lone size stays within the limits of its candidate.
    """
    a, b = responses.free(change), responses.free(rival.columns)
    if not rival.sized:
        return float(((a - b[:, 0]) ** 2).sum())
    sizes = np.linalg.lstsq(b, a, rcond=None)[0]
    if len(sizes) == 1:  # gravity and tip forces may point anywhere
        sizes = np.clip(sizes, rival.group[0].low, rival.group[0].high)
    return float(((a - b @ sizes) ** 2).sum())


def distance_to_pairs(responses: Responses, change: np.ndarray, rivals: Sequence[Response]) -> float:
    """Squared distance from a whitened change (r + c,) to the nearest pair of rivals of any size, in the linear model.

    Infinite with fewer than two rivals.
    """
    a, columns = responses.free(change), [responses.free(rival.columns) for rival in rivals]
    best = np.inf
    for pair in combinations(range(len(rivals)), 2):
        left = a - sum(columns[k][:, 0] for k in pair if not rivals[k].sized)
        gain, free = 0.0, [columns[k] for k in pair if rivals[k].sized]
        if free:
            both = np.hstack(free)
            normal, along = both.T @ both, both.T @ left
            gain = along @ np.linalg.lstsq(normal, along, rcond=SETTINGS.sizes.rank_tolerance)[0]
        best = min(best, float(left @ left - gain))
    return max(best, 0.0)


def distance_without_a_step(responses: Responses, change: np.ndarray) -> float:
    """Squared distance from a whitened change (r + c,) to a wrong weight at some one step, in the linear model.

    As the weight may be any, this is the least that calibration leaves in the readings of all steps but one.
    """
    constants = len(responses.constants)
    count, readings = len(responses.nominal), len(change) - constants
    step = np.append(np.repeat(np.arange(count), readings // count), np.full(constants, count))
    least = np.inf
    for k in range(count):
        others = step != k
        basis = np.linalg.qr(responses.calibration[others])[0]
        left = change[others] - basis @ (basis.T @ change[others])
        least = min(least, float(left @ left))
    return least


def refitted_distance(responses: Responses, change: np.ndarray, rival: Response | None) -> float:
    """Squared distance from a whitened change (r + c,) to a rival, or to calibration alone if that is None.

    The refit takes a few Gauss-Newton steps with the full rig from the nominal constants; infinite if a rival without a
    size has no equilibrium.
    """
    group = rival.group if rival is not None else ()
    free = [form for form in group if form.sized]
    calibration = responses.calibration
    jacobian = np.hstack([calibration, rival.columns]) if rival is not None and free else calibration
    inverse, c = np.linalg.pinv(jacobian), calibration.shape[1]
    p = np.zeros(jacobian.shape[1])
    fixed = [form.effect(1.0) for form in group if not form.sized]
    start = responses.at(p, fixed) if fixed else np.zeros_like(change)
    if start is None:
        return np.inf
    left = change - start
    best = float(left @ left)
    for _ in range(SETTINGS.sizes.refits):
        p = p + inverse @ left
        for k, form in enumerate(free):
            p[c + k] = np.clip(p[c + k], form.low if len(free) == 1 else -form.high, form.high)
        moved = responses.at(p[:c], fixed + [form.effect(p[c + k]) for k, form in enumerate(free)])
        if moved is None:
            break
        left, before = change - moved, best
        best = min(best, float(left @ left))
        if left @ left > SETTINGS.sizes.refit_gain * before:
            break
    return best


def nearest_by_kind(
    responses: Responses,
    change: np.ndarray,
    rivals: Sequence[Response],
    without: Collection[str],
    near: float = SETTINGS.sizes.refitted_below,
) -> dict[str, float]:
    """Squared distance from a whitened change to the nearest rival of every kind but those in `without`.

    The nearest few kinds are refitted with the full rig if they have a size and their linear distance is below `near`.
    """
    best: dict[str, tuple[float, Response]] = {}
    for rival in rivals:
        if rival.kind not in without:
            far = linear_distance(responses, change, rival)
            if rival.kind not in best or far < best[rival.kind][0]:
                best[rival.kind] = far, rival
    out: dict[str, float] = {}
    for kind, (far, rival) in sorted(best.items(), key=lambda item: item[1][0]):
        if far < near and len(out) < SETTINGS.sizes.most_refitted and rival.sized:
            far = min(far, refitted_distance(responses, change, rival))
        out[kind] = round(float(far), 3)
    return out
