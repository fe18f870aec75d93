"""Force-controlled workspaces: load clouds, and the area, outline and width that a tip reaches."""

from collections.abc import Mapping

import numpy as np
import scipy

from prb3r.mechanics.chain import Chain, Loads, loads
from prb3r.model.manipulator import Manipulator

CLOUD_SEED = 20181


def cloud_loads(manipulator: Manipulator, chain: Chain, limits: Mapping[str, float], count: int) -> Loads:
    """`count` independent loads: every cable of `limits` idle or pulled up to its largest tension (N).

    A Sobol sequence gives each cable a share in [-1, 1], negative shares are idle: so every subset of the cables,
    and with it the rim of the workspace, comes up equally often.  The same shares come up for every design.
    """
    names = sorted(limits)
    tension = np.zeros((count, len(manipulator.cable)))
    if names:
        bits = int(np.ceil(np.log2(count)))
        share = scipy.stats.qmc.Sobol(len(names), rng=CLOUD_SEED).random_base2(bits)[:count]
        for column, name in enumerate(names):
            tension[:, manipulator.cable_names.index(name)] = np.maximum(2 * share[:, column] - 1, 0) * limits[name]
    return loads(chain, tension)


def area(x: np.ndarray, y: np.ndarray, side: float) -> float:
    """Area (m^2) of the square cells of `side` (m) that hold a point, single gaps between them closed.

    It overestimates a smooth region by about half a cell along its boundary; regions without points have area 0.
    """
    reached = np.isfinite(x) & np.isfinite(y)
    if not reached.any():
        return 0.0
    column, row = (np.floor(values[reached] / side).astype(int) for values in (x, y))
    mask = np.zeros((np.ptp(column) + 5, np.ptp(row) + 5), bool)
    mask[column - column.min() + 2, row - row.min() + 2] = True
    return float(scipy.ndimage.binary_closing(mask, np.ones((3, 3))).sum() * side**2)


def outline(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Area of the convex hull (m^2) of points, and their extent in y (m); 0 of points on a line or none."""
    points = np.stack([x, y], 1)[np.isfinite(x) & np.isfinite(y)]
    if not len(points):
        return 0.0, 0.0
    flat = min(np.linalg.svd(points - points.mean(0), compute_uv=False)) < 1e-9 if len(points) > 2 else True
    return 0.0 if flat else float(scipy.spatial.ConvexHull(points).volume), float(np.ptp(points[:, 1]))
