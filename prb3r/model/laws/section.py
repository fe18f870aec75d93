"""Bending of a section whose material follows a stress plateau, reduced to the smooth law that chains have.

The material is elastic up to the plateau strain in tension, `compression` times that in compression, and has `slope`
times its modulus beyond.  The neutral axis is where the forces of a section balance, so that it shifts wherever section
or material are not symmetric.  All lengths are in units of the section's height before any notch, all strains in units
of the plateau strain in tension: what comes back holds for every size.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.optimize.elementwise import find_root

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
"""Gauss and Legendre's, for each part of a section between kinks of its width or its stress: moments are within 1e-4
of their closed forms, and as smooth in all parameters."""
PASSED = 8.0
"""Plateau strains of the outermost fibre up to which a law is fitted: 6 % of strain where nitinol's begins at 0.75 %.
Choice: about where the plateau of nitinol ends."""
CURVATURES = 40
"""At which it is, evenly spaced from none."""
POLISHED = 10
"""Steps of Gauss and Newton with which a fit ends, to rounding: derivatives are taken of it by differences."""


class Tube(NamedTuple):
    """A tube with a notch cut from the positive side, in units of its outer diameter."""

    inner: float
    """Its inner diameter."""
    depth: float
    """Of the notch; 0 for a whole tube."""


class SmoothLaw(NamedTuple):
    """What `prb3r.mechanics.chain.Law` takes: stiffness ratio, sharpness, and a knee by side."""

    ratio: float
    sharpness: float
    knee: tuple[float, float]
    """Curvature of the knee times the section's height, over the plateau strain: bending toward the negative side, and
    toward the positive one, which closes a notch."""


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


def bending(tube: Tube | None, compression: float, slope: float, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Curvatures of a section bent toward the positive (`side` 1) or negative side (-1), and the curvatures that an
    elastic section would have under the same moments; both (CURVATURES,)."""
    y, area = (each[0] for each in quadrature(tube, np.zeros((1, 2))))
    centre = float(np.average(y, weights=area))
    low, high = ends(tube)
    curvature = np.linspace(0, PASSED, CURVATURES + 1)[1:] / max(centre - low, high - centre)

    def summed(axis: np.ndarray, k: np.ndarray, power: int) -> np.ndarray:
        """Force (power 0) or moment (1) about the axis, (k,)."""
        y, area = quadrature(tube, axis[:, None] + side / k[:, None] * np.array([-1.0, compression]))
        arm = y - axis[:, None]
        return np.sum(area * arm**power * stress(-side * k[:, None] * arm, compression, slope), axis=1)

    bracket = np.full(CURVATURES, low), np.full(CURVATURES, high)
    axis = find_root(lambda axis, k: summed(axis, k, 0), bracket, args=(curvature,)).x
    return curvature, -side * summed(axis, curvature, 1) / (area @ (y - centre) ** 2)


def smooth_moment(curvature: np.ndarray, ratio: float, sharpness: float, knee: float) -> tuple[np.ndarray, np.ndarray]:
    """Moments over EI by the chain's law, as `curvature` (k,), and their derivatives (k, 3) by the logarithms of ratio,
    sharpness and knee."""
    x = curvature / knee
    passed = x**sharpness
    left = (1 + passed) ** (-1 / sharpness)
    gone = passed / (1 + passed)
    softer = np.log1p(passed) / sharpness - gone * np.log(x)
    by = ratio * (1 - left), (1 - ratio) * left * softer, (1 - ratio) * left * gone
    return curvature * (ratio + (1 - ratio) * left), curvature[:, None] * np.stack(by, axis=1)


@lru_cache(maxsize=512)
def smooth_law(tube: Tube | None, compression: float, slope: float) -> SmoothLaw:
    """The smooth law next to a section's own, for both sides at once, by relative moments up to `PASSED`.

    It is within 3 % of the moments of rectangles and within 5.5 % of those of notched tubes
    (`tests/model/test_superelastic.py`).
    """
    sides = [bending(tube, compression, slope, side) for side in (-1, 1)]

    def moments(p: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        ratio, sharpness, *knees = np.exp(p)
        return [smooth_moment(k, ratio, sharpness, knee) for knee, (k, _) in zip(knees, sides, strict=True)]

    def off(p: np.ndarray) -> np.ndarray:
        return np.concatenate([fitted / m - 1 for (fitted, _), (_, m) in zip(moments(p), sides, strict=True)])

    def slopes(p: np.ndarray) -> np.ndarray:
        out = np.zeros((2, CURVATURES, len(p)))
        for column, ((_, by), (_, m)) in enumerate(zip(moments(p), sides, strict=True)):
            out[column][:, [0, 1, 2 + column]] = by / m[:, None]
        return out.reshape(-1, len(p))

    begin = np.log([slope + 0.02, 4.0, *(float(m[-1]) for _, m in sides)])
    p = least_squares(off, begin, slopes, method="lm").x
    for _ in range(POLISHED):
        p = p - np.linalg.lstsq(slopes(p), off(p), rcond=None)[0]
    ratio, sharpness, negative, positive = np.exp(p).tolist()
    return SmoothLaw(ratio, sharpness, (negative, positive))
