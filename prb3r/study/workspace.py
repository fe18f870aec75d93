"""Force-controlled workspaces: clouds of loads, and the area, outline and width of the region that the tip reaches."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
import scipy

from prb3r.mechanics.chain import Chain, Loads, loads
from prb3r.mechanics.equilibrium import Equilibria, Outcome
from prb3r.mechanics.strain import peak_strain
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator

CLOUD_SEED = 20181
"""Seed of the Sobol sequence of every cloud."""
MOST_DISKS = 2**18
"""Largest number of disks, over all loads, that are solved in one call: about 50 MB of states."""


@dataclass(frozen=True)
class Tips:
    """Position of the tip disk and peak values under each load of a cloud, (count,) each."""

    x: np.ndarray
    """m; NaN without an equilibrium."""
    y: np.ndarray
    """m; NaN without an equilibrium."""
    solved: np.ndarray
    """Whether the outcome is `CONVERGED`: an equilibrium, and a stable one if its eigenvalue was computed."""
    strain: np.ndarray
    """Highest bending strain of a plate; NaN where it is not known."""
    pull: np.ndarray
    """Highest tension of a cable, N."""
    corner: np.ndarray
    """Whether the load counts and its tip is on the outline of those solved in the same call; see `on_outline`."""

    def beyond(self, manipulator: Manipulator, safety: float) -> np.ndarray:
        """(count,) whether a load brings a plate nearer to yield than `safety`; False without yield stress."""
        if not safety or manipulator.yield_stress_pa is None:
            return np.zeros(len(self.x), bool)
        return self.strain * manipulator.youngs_modulus_pa * safety > manipulator.yield_stress_pa

    def without(self, rows: np.ndarray) -> "Tips":
        """A copy with NaN for the loads in the mask `rows` (count,); `solved` is kept."""
        kept = {name: np.where(rows, np.nan, getattr(self, name)) for name in ("x", "y", "strain", "pull")}
        return replace(self, **kept)


def tips_of(manipulator: Manipulator, some: Loads, states: Equilibria, safety: float) -> Tips:
    """The `Tips` of loads, from their equilibria, which must hold details such as strain.

    Loads that bring a plate nearer to yield than `safety` do not count for the outline.
    """
    strain = peak_strain(states, manipulator.bending_stiffness, manipulator.outer_fibre)
    solved, pull = states.outcome == Outcome.CONVERGED, some.tension.max(1, initial=0.0)
    x, y = states.x[:, -1], states.y[:, -1]
    tips = Tips(x, y, solved, np.fmax.reduce(strain, axis=1), pull, np.ones(len(x), bool))
    counted = tips.without(tips.beyond(manipulator, safety))
    return replace(tips, corner=on_outline(counted.x, counted.y))


def cloud_loads(manipulator: Manipulator, chain: Chain, limits: Mapping[str, float], numbers: np.ndarray) -> Loads:
    """Loads of a cloud by their numbers, with the tensions of :func:`cloud_tension`."""
    return loads(chain, cloud_tension(manipulator, limits, numbers))


def cloud_tension(manipulator: Manipulator, limits: Mapping[str, float], numbers: np.ndarray) -> np.ndarray:
    """(n, cables) independent tensions, N: each cable of `limits` is idle or pulled up to its largest tension.

    A Sobol sequence gives each cable a share in [-1, 1]; at negative shares it is idle.  Every subset of the cables
    thus comes up equally often, and with it the rim of the workspace.  The shares are the same for every design.

    Parameters
    ----------
    limits : largest tension of each driven cable, N, by name.
    numbers : (n,) numbers of the loads in the whole cloud, from 0, ascending.
    """
    names = sorted(limits)
    tension = np.zeros((len(numbers), len(manipulator.cable)))
    if names:
        sequence = scipy.stats.qmc.Sobol(len(names), rng=CLOUD_SEED)
        begins = (np.diff(numbers) != 1) | (numbers[:-1] == 0)  # scipy warns unless the first point is drawn alone
        shares = []
        for run in np.split(numbers, np.flatnonzero(begins) + 1):
            if skipped := int(run[0]) - sequence.num_generated:
                sequence.fast_forward(skipped)
            shares.append(sequence.random(len(run)))
        columns = [manipulator.cable_names.index(name) for name in names]
        tension[:, columns] = np.maximum(2 * np.concatenate(shares) - 1, 0) * [limits[name] for name in names]
    return tension


def block_size(plates: int) -> int:
    """Number of loads of a cloud that are solved in one call, a power of 2."""
    return 2 ** max(4, int(np.log2(MOST_DISKS / (plates + 1))))


def tips_reached(
    manipulator: Manipulator, chain: Chain, limits: Mapping[str, float], count: int, safety: float
) -> Tips:
    """The `Tips` of all loads of a cloud, solved block by block so that the states of one block at most are in memory.

    Eigenvalues are not computed, so that unstable equilibria count as solved; `safety`: as for :func:`tips_of`.
    """
    blocks = []
    for start in range(0, count, size := block_size(chain.plates)):
        some = cloud_loads(manipulator, chain, limits, np.arange(start, min(start + size, count)))
        blocks.append(tips_of(manipulator, some, equilibria_of(chain, some, from_rest=True), safety))
    return Tips(*(np.concatenate([getattr(block, field.name) for block in blocks]) for field in fields(Tips)))


def area(x: np.ndarray, y: np.ndarray, side: float) -> float:
    """Area (m^2) of the square cells of `side` (m) that hold a point, with gaps of a single cell between them closed.

    It overestimates a smooth region by about half a cell along its boundary; see `extrapolated`.  It is 0 without
    points; NaN points do not count.
    """
    reached = np.isfinite(x) & np.isfinite(y)
    if not reached.any():
        return 0.0
    column, row = (np.floor(values[reached] / side).astype(int) for values in (x, y))
    mask = np.zeros((np.ptp(column) + 5, np.ptp(row) + 5), bool)
    mask[column - column.min() + 2, row - row.min() + 2] = True
    return float(scipy.ndimage.binary_closing(mask, np.ones((3, 3))).sum() * side**2)


def extrapolated(fine: float, coarse: float) -> float:
    """Area (m^2) in cells of no size, from those in cells of a side and of twice that side.

    What cells add along a boundary grows as their side: of a region twice as much in cells twice as wide, of a curve
    the whole area.  At least 0.
    """
    return max(0.0, 2 * fine - coarse)


def on_outline(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n,) whether each point is a corner of the convex hull of all; of points on a line each counts.

    The :func:`outline` of many points is that of such corners of parts of them.  NaN points are none.
    """
    corner = np.isfinite(x) & np.isfinite(y)
    points = np.stack([x, y], 1)[corner]
    if not _on_a_line(points):
        corner[np.delete(np.flatnonzero(corner), scipy.spatial.ConvexHull(points).vertices)] = False
    return corner


def outline(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Area of the convex hull of points, m^2, and their extent in y, m.

    The area is 0 for points on a line; both are 0 without points.  NaN points do not count.
    """
    points = np.stack([x, y], 1)[np.isfinite(x) & np.isfinite(y)]
    if not len(points):
        return 0.0, 0.0
    enclosed = 0.0 if _on_a_line(points) else float(scipy.spatial.ConvexHull(points).volume)
    return enclosed, float(np.ptp(points[:, 1]))


def _on_a_line(points: np.ndarray) -> bool:
    """Whether points (n, 2), m, lie on a line, as any two do."""
    return len(points) < 3 or min(np.linalg.svd(points - points.mean(0), compute_uv=False)) < 1e-9
