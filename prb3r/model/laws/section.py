"""Moment over curvature of a section whose material has a stress plateau, as a table for the bending law of a chain.

The material is elastic up to the plateau strain in tension, `compression` times that in compression, and has `slope`
times its modulus beyond.  The neutral axis is where the forces of a section balance, so it shifts wherever section or
material is not symmetric.  All lengths are in units of the section's height before any notch, all strains in units of
the plateau strain in tension, so that the results hold for every size.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.plate_law import LAW_ROWS

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
"""Gauss-Legendre quadrature for each part of a section between kinks of its width or its stress: moments are within
1e-4 of their closed forms, and as smooth in all parameters."""
PASSED = 8.0
"""Strain of the outermost fibre, in plateau strains, up to which a section is tabulated: 6 % where nitinol's plateau
begins at 0.75 %; beyond, its moment grows as it did there.  Choice: about where the plateau of nitinol ends."""
MOST_AXES, AXIS_FOUND = 60, 1e-14
"""Most Newton steps to a neutral axis (a step that leaves its bracket is replaced by bisection), and the step that ends
them, in heights of a section."""


class Tube(NamedTuple):
    """A tube with a notch cut from the positive side, in units of its outer diameter."""

    inner: float
    """Inner diameter of the tube."""
    depth: float
    """Depth of the notch; 0 for a whole tube."""


class SectionLaw(NamedTuple):
    """A tabulated bending law, as the fields `knee` (after scaling) and `table` of `prb3r.mechanics.plate_law.Law`."""

    end: float
    """Last curvature of the table, times the section's height over the plateau strain."""
    table: np.ndarray
    """(2, LAW_ROWS, 2) curvature that an elastic section would have under the same moment, over `end`, and its
    derivative by the curvature: for bending toward the negative side, and toward the positive one, which closes a
    notch."""


def width(tube: Tube | None, y: np.ndarray) -> np.ndarray:
    """Width at heights `y` of the section: a rectangle of height and width 1, or a tube; the middle is at 0."""
    if tube is None:
        return np.ones_like(y)
    return 2 * np.sqrt(np.maximum(0.25 - y**2, 0)) - 2 * np.sqrt(np.maximum(tube.inner**2 / 4 - y**2, 0))


def quadrature(tube: Tube | None, kinks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heights and areas, both (k, points), of the quadrature over a section for k curvatures.

    `kinks` (k, 2) are the heights at which the slope of the stress changes; parts of the quadrature end there.
    """
    low, high = ends(tube)
    bore = np.zeros(1) if tube is None else np.array([-tube.inner, tube.inner]) / 2
    cuts = np.concatenate([np.broadcast_to([low, high, *bore], (len(kinks), 2 + len(bore))), kinks], axis=1)
    cuts = np.sort(np.clip(cuts, low, high), axis=1)
    half = np.diff(cuts, axis=1)[:, :, None] / 2
    y = (cuts[:, :-1, None] + half * (1 + NODES)).reshape(len(kinks), -1)
    return y, (half * WEIGHTS).reshape(len(kinks), -1) * width(tube, y)


def ends(tube: Tube | None) -> tuple[float, float]:
    """Heights of the lowest and the highest fibre of a section."""
    return -0.5, 0.5 - (0.0 if tube is None else tube.depth)


def stress(strain: np.ndarray, compression: float, slope: float) -> np.ndarray:
    """Stress over the plateau stress in tension, for strains in plateau strains; positive in tension.

    `compression` is the plateau stress in compression over that in tension, `slope` the slope of the plateau over the
    modulus.
    """
    return slope * strain + (1 - slope) * np.clip(strain, -compression, 1.0)


def bending(
    tube: Tube | None, compression: float, slope: float, side: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Moments of a section bent toward the positive (`side` 1) or negative side (-1).

    The neutral axis at each curvature is found by Newton's method.

    Returns
    -------
    Evenly spaced curvatures without the first, 0; the curvatures that an elastic section would have under the same
    moments; and the derivatives of the latter by the curvature.  All (LAW_ROWS - 1,).
    """
    y, area = (part[0] for part in quadrature(tube, np.zeros((1, 2))))
    centre = float(np.average(y, weights=area))
    count = LAW_ROWS - 1
    low, high = (np.full(count, end) for end in ends(tube))
    curvature = np.linspace(0, PASSED, LAW_ROWS)[1:] / max(centre - low[0], high[0] - centre)

    def summed(axis: np.ndarray) -> np.ndarray:
        """(5, k) axial force (signed so that it grows as the axis moves up), moment about the axis, and the zeroth to
        second moments of the tangent stiffness about the axis, for axes (k,) at the k curvatures."""
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
    """The bending law of a section to both sides; between the rows of the table moments are within 2e-4."""
    sides = [bending(tube, compression, slope, side) for side in ((-1, 1) if tube else (1,))]
    end, rows = float(sides[0][0][-1]), [_rows(*side) for side in sides]
    return SectionLaw(end, np.array(rows if tube else rows * 2))  # a rectangle bends alike to both sides


def _rows(curvature: np.ndarray, moment: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """(LAW_ROWS, 2) one side of the table, from what `bending` returns and the row at zero curvature."""
    return np.vstack([[0.0, 1.0], np.stack([moment / curvature[-1], slope], axis=1)])
