"""Bending of a section whose material follows a stress plateau, as a table for the law that chains have.

The material is elastic up to the plateau strain in tension, `compression` times that in compression, and has `slope`
times its modulus beyond.  The neutral axis is where the forces of a section balance, so that it shifts wherever section
or material are not symmetric.  All lengths are in units of the section's height before any notch, all strains in units
of the plateau strain in tension: what comes back holds for every size.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.plate_law import LAW_ROWS

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
"""Gauss and Legendre's, for each part of a section between kinks of its width or its stress: moments are within 1e-4
of their closed forms, and as smooth in all parameters."""
PASSED = 8.0
"""Plateau strains of the outermost fibre up to which a section is followed: 6 % of strain where nitinol's begins at
0.75 %; beyond, its moment grows as it did there.  Choice: about where the plateau of nitinol ends."""
MOST_AXES, AXIS_FOUND = 60, 1e-14
"""Steps of Newton's to a neutral axis, by halves where they lead beyond its bracket, and the last step that ends them,
in heights of a section."""


class Tube(NamedTuple):
    """A tube with a notch cut from the positive side, in units of its outer diameter."""

    inner: float
    """Its inner diameter."""
    depth: float
    """Of the notch; 0 for a whole tube."""


class SectionLaw(NamedTuple):
    """What `prb3r.mechanics.plate_law.Law` takes."""

    end: float
    """Curvature to which it reaches, times the section's height over the plateau strain."""
    table: np.ndarray
    """(2, LAW_ROWS, 2) curvature that an elastic section would have under the same moment, over the end, and its slope:
    bending toward the negative side, and toward the positive one, which closes a notch."""


def width(tube: Tube | None, y: np.ndarray) -> np.ndarray:
    """Width at heights `y` of a rectangle of height 1 or of a tube whose middle is at 0."""
    if tube is None:
        return np.ones_like(y)
    return 2 * np.sqrt(np.maximum(0.25 - y**2, 0)) - 2 * np.sqrt(np.maximum(tube.inner**2 / 4 - y**2, 0))


def quadrature(tube: Tube | None, kinks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heights and areas, both (k, points), by which a section is summed up; stress has `kinks` (k, 2) there."""
    low, high = ends(tube)
    bore = np.zeros(1) if tube is None else np.array([-tube.inner, tube.inner]) / 2
    cuts = np.concatenate([np.broadcast_to([low, high, *bore], (len(kinks), 2 + len(bore))), kinks], axis=1)
    cuts = np.sort(np.clip(cuts, low, high), axis=1)
    half = np.diff(cuts, axis=1)[:, :, None] / 2
    y = (cuts[:, :-1, None] + half * (1 + NODES)).reshape(len(kinks), -1)
    return y, (half * WEIGHTS).reshape(len(kinks), -1) * width(tube, y)


def ends(tube: Tube | None) -> tuple[float, float]:
    """The lowest and the highest fibre of a section."""
    return -0.5, 0.5 - (0.0 if tube is None else tube.depth)


def stress(strain: np.ndarray, compression: float, slope: float) -> np.ndarray:
    """Stress over that of the plateau in tension, of strains in plateau strains; positive in tension."""
    return slope * strain + (1 - slope) * np.clip(strain, -compression, 1.0)


def bending(
    tube: Tube | None, compression: float, slope: float, side: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Moments of a section bent toward the positive (`side` 1) or negative side (-1).

    Returns
    -------
    Curvatures from the first above none to the last, the curvatures that an elastic section would have under the same
    moments, and the slopes of these; all (LAW_ROWS - 1,).
    """
    y, area = (part[0] for part in quadrature(tube, np.zeros((1, 2))))
    centre = float(np.average(y, weights=area))
    count = LAW_ROWS - 1
    low, high = (np.full(count, end) for end in ends(tube))
    curvature = np.linspace(0, PASSED, LAW_ROWS)[1:] / max(centre - low[0], high[0] - centre)

    def summed(axis: np.ndarray) -> np.ndarray:
        """(5, k) force that grows as the axis moves up and moment about the axis; sums of the stiffness, and of its
        first and second moment."""
        kinks = side / curvature[:, None] * np.array([-1.0, compression])
        y, area = quadrature(tube, axis[:, None] + kinks)
        arm = y - axis[:, None]
        strain = -side * curvature[:, None] * arm
        carried = side * area * stress(strain, compression, slope)
        held = area * np.where((strain > -compression) & (strain < 1), 1.0, slope)
        return np.stack([carried.sum(1), -(carried * arm).sum(1), *(np.sum(held * arm**k, axis=1) for k in range(3))])

    axis = np.full(count, centre)
    for _ in range(MOST_AXES):
        force, _, stiff, *_ = summed(axis)
        low, high = np.where(force < 0, axis, low), np.where(force < 0, high, axis)
        step = axis - force / (curvature * stiff)
        within = (step >= low) & (step <= high)
        before, axis = axis, np.where(within, step, (low + high) / 2)
        if np.abs(axis - before).max() < AXIS_FOUND:
            break
    _, moment, stiff, first, second = summed(axis)
    inertia = area @ (y - centre) ** 2
    return curvature, moment / inertia, (second - first**2 / stiff) / inertia


@lru_cache(maxsize=512)
def section_law(tube: Tube | None, compression: float, slope: float) -> SectionLaw:
    """The law of a section on both sides, within 2e-4 of its moments between the rows of the table."""
    sides = [bending(tube, compression, slope, side) for side in ((-1, 1) if tube else (1,))]
    end, rows = float(sides[0][0][-1]), [_rows(*side) for side in sides]
    return SectionLaw(end, np.array(rows if tube else rows * 2))  # a rectangle bends alike to both sides


def _rows(curvature: np.ndarray, moment: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """(LAW_ROWS, 2) of a table, from no curvature on."""
    return np.vstack([[0.0, 1.0], np.stack([moment / curvature[-1], slope], axis=1)])
