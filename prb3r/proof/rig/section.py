"""Moments of a section whose material has plateaus in tension and compression, in closed form.

The section is not cut into strips: with W_j(y) the integral of the width times y^j, force and moment follow from W at
the section's ends and at the heights where the material reaches a plateau.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

ROWS = 400
"""Rows of a table of moments, evenly spaced in the logarithm of the curvature: within 1e-6 of the closed form."""
FARTHEST = 60.0
"""Curvature at which tables end, over that at which the first fibre reaches its plateau; beyond they go on linearly."""
HALVINGS = 60
"""Bisections for the neutral axis from the height of the section on: the error left is below rounding."""


class Outline(NamedTuple):
    """A cross-section between its lowest and highest fibre (heights y, m); `moments` maps y to the (3, ...)
    antiderivatives of its width times 1, y and y^2."""

    low: float
    high: float
    moments: Callable[[np.ndarray], np.ndarray]


class Material(NamedTuple):
    """Strains at which the plateaus begin in tension and in compression, and their slope over Young's modulus."""

    tension: float
    compression: float
    slope: float


def rectangle(fibre: float) -> Outline:
    """The outline of a rectangle of unit width whose outermost fibres are `fibre` from the middle."""
    return Outline(-fibre, fibre, lambda y: np.stack([y, y**2 / 2, y**3 / 3]))


def notched_tube(outer: float, inner: float, depth: float, side: int) -> Outline:
    """The outline of a tube of diameters `outer` and `inner`, cut `depth` deep from the side of positive (`side` 1) or
    negative (-1) heights."""

    def disk(y: np.ndarray, radius: float) -> np.ndarray:
        """(3, ...) antiderivatives of the width of a full circle times 1, y and y^2."""
        if radius == 0:
            return np.zeros((3, *np.shape(y)))
        y = np.clip(y, -radius, radius)
        root, turn = np.sqrt(radius**2 - y**2), radius**2 * np.arcsin(y / radius)
        second = (y * (2 * y**2 - radius**2) * root + radius**2 * turn) / 4
        return np.stack([y * root + turn, -2 / 3 * root**3, second])

    ends = (-outer / 2, outer / 2 - depth) if side > 0 else (depth - outer / 2, outer / 2)
    return Outline(*ends, lambda y: disk(y, outer / 2) - disk(y, inner / 2))


def between(outline: Outline, start: np.ndarray, end: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(3, ...) area, first and second moment about `axis` of the part of an outline from height `start` to `end`."""
    ends = np.clip([start, end], outline.low, outline.high)
    area, first, second = outline.moments(ends[1]) - outline.moments(ends[0])
    return np.stack([area, first - axis * area, second - 2 * axis * first + axis**2 * area])


def resultants(outline: Outline, material: Material, side: int, curvature: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(3, k) force and moment about the neutral axis over Young's modulus, and the tangent dM/dk / E.

    `curvature` and `axis` (height of the neutral axis) are (k,).  Bending toward positive heights (`side` 1) compresses
    these.  A moment that bends toward `side` is positive.
    """
    to_tension, to_compression = -side * material.tension / curvature, side * material.compression / curvature
    from_axis = np.sort([to_tension, to_compression], axis=0)
    core = between(outline, axis + from_axis[0], axis + from_axis[1], axis)
    below = between(outline, np.full_like(axis, outline.low), axis + from_axis[0], axis)
    above = between(outline, axis + from_axis[1], np.full_like(axis, outline.high), axis)
    whole = core + below + above
    stretched, pressed = (below, above) if side > 0 else (above, below)
    rest, held = material.slope, 1 - material.slope
    strained = -side * curvature * (rest * whole + held * core)[1]
    force = strained + held * (material.tension * stretched[0] - material.compression * pressed[0])
    plateaus = material.tension * stretched[1] - material.compression * pressed[1]
    moment = curvature * (rest * whole + held * core)[2] - side * held * plateaus
    area, first, second = rest * whole + held * core
    return np.stack([force, moment, second - first**2 / area])


def section_table(outline: Outline, material: Material, side: int) -> np.ndarray:
    """(ROWS, 3) M / EI, curvature and its derivative by M / EI, for bending toward one side (1 or -1)."""
    ends = np.array(outline.low), np.array(outline.high)
    area, first, _ = between(outline, *ends, np.array(0.0))
    centre = float(first / area)
    inertia = float(between(outline, *ends, np.array(centre))[2])
    arms = (centre - outline.low, outline.high - centre)
    stretched, pressed = arms if side > 0 else arms[::-1]
    begins = min(material.tension / stretched, material.compression / pressed)
    curvature = begins * np.geomspace(1, FARTHEST, ROWS)
    low, high = np.full(ROWS, outline.low), np.full(ROWS, outline.high)
    for _ in range(HALVINGS):  # the tensile force grows as the axis moves toward the compressed side
        axis = (low + high) / 2
        pulled = side * resultants(outline, material, side, curvature, axis)[0] > 0
        low, high = np.where(pulled, low, axis), np.where(pulled, axis, high)
    _, moment, tangent = resultants(outline, material, side, curvature, (low + high) / 2)
    return np.stack([moment / inertia, curvature, inertia / tangent], axis=1)
