"""Force-controlled workspaces: load clouds, and the area, outline and width that a tip reaches."""

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
MOST_DISKS = 2**18
"""Disks of all loads that are solved in one call: about 50 MB of states."""


SETTLED_SHARE = 0.9
"""Share of a workspace that the first half of its loads must reach for the other half to add little."""


def convergence_warning(shares: np.ndarray) -> str:
    """What is to be said of workspaces whose first half of the loads reaches these shares; empty if nothing is."""
    few = shares[shares < SETTLED_SHARE]
    if not len(few):
        return ""
    return (
        f"{len(few)} of {len(shares)} workspaces still grow with the number of loads: the first half reaches as "
        f"little as {100 * few.min():.0f} % of the area. Give more loads (count) or larger cells (cell)."
    )


@dataclass(frozen=True)
class Tips:
    """Where the tip disk comes under each load of a cloud, (count,) each."""

    x: np.ndarray
    """m; NaN without an equilibrium."""
    y: np.ndarray
    solved: np.ndarray
    """Whether a stable equilibrium was found."""
    strain: np.ndarray
    """Highest bending strain of a plate; NaN where it is not known."""
    pull: np.ndarray
    """Highest tension of a cable, N."""

    def beyond(self, manipulator: Manipulator, safety: float) -> np.ndarray:
        """(count,) whether a plate is nearer to yield than the factor `safety`; nowhere if no yield stress is known."""
        if not safety or manipulator.yield_stress_pa is None:
            return np.zeros(len(self.x), bool)
        return self.strain * manipulator.youngs_modulus_pa * safety > manipulator.yield_stress_pa

    def without(self, rows: np.ndarray) -> "Tips":
        """The same with nothing known of some loads (count,), a mask, but whether they were solved."""
        kept = {name: np.where(rows, np.nan, getattr(self, name)) for name in ("x", "y", "strain", "pull")}
        return replace(self, **kept)


def tips_of(manipulator: Manipulator, some: Loads, states: Equilibria) -> Tips:
    """What is known of the tip under loads, from their equilibria with detail."""
    strain = peak_strain(states, manipulator.bending_stiffness, manipulator.outer_fibre)
    solved, pull = states.outcome == Outcome.CONVERGED, some.tension.max(1, initial=0.0)
    return Tips(states.x[:, -1], states.y[:, -1], solved, np.fmax.reduce(strain, axis=1), pull)


def cloud_loads(
    manipulator: Manipulator, chain: Chain, limits: Mapping[str, float], count: int, start: int = 0
) -> Loads:
    """Loads of a part of a cloud; see :func:`cloud_tension`."""
    return loads(chain, cloud_tension(manipulator, limits, count, start))


def cloud_tension(manipulator: Manipulator, limits: Mapping[str, float], count: int, start: int = 0) -> np.ndarray:
    """(count, cables) independent tensions: every cable of `limits` idle or pulled up to its largest tension (N).

    A Sobol sequence gives each cable a share in [-1, 1], negative shares are idle: so every subset of the cables,
    and with it the rim of the workspace, comes up equally often.  The same shares come up for every design.

    Parameters
    ----------
    start : number of the first of these loads, which are a part of a larger cloud.
    """
    names = sorted(limits)
    tension = np.zeros((count, len(manipulator.cable)))
    if names:
        sequence = scipy.stats.qmc.Sobol(len(names), rng=CLOUD_SEED)
        if start:
            share = sequence.fast_forward(start).random(count)
        else:
            share = sequence.random_base2(int(np.ceil(np.log2(count))))[:count]
        for column, name in enumerate(names):
            tension[:, manipulator.cable_names.index(name)] = np.maximum(2 * share[:, column] - 1, 0) * limits[name]
    return tension


def block_size(plates: int) -> int:
    """Loads of a cloud that are solved in one call."""
    return 2 ** max(4, int(np.log2(MOST_DISKS / (plates + 1))))


def tips_reached(manipulator: Manipulator, chain: Chain, limits: Mapping[str, float], count: int) -> Tips:
    """The tip under each of the loads of a cloud, solved block by block: no more than one is in memory."""
    blocks = []
    for start in range(0, count, size := block_size(chain.plates)):
        rows = slice(start, min(start + size, count))
        some = cloud_loads(manipulator, chain, limits, rows.stop - start, start)
        blocks.append(tips_of(manipulator, some, equilibria_of(chain, some, from_rest=True)))
    return Tips(*(np.concatenate([getattr(block, field.name) for block in blocks]) for field in fields(Tips)))


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
