"""Parameters of how plates resist bending beyond linear stiffness: bending law, hysteresis, contact of the disks.

Each is a number that holds for every plate, or an array with a row per plate.  `bending.py` computes with them.
"""

from typing import NamedTuple

import numpy as np

LAW_ROWS = 129
"""Rows of a tabulated bending law.  With sixteen intervals per yield curvature, interpolation errs by 2e-4 where the
second derivative of a law jumps by 3 (in yield curvatures) at the onset of yield."""


class Law(NamedTuple):
    """Bending law ``M = EI f(k)`` for the curvature `k` beyond the stress-free one.

    f = k (1 + cubic k^2) up to the curvature `knee`, and a straight line of the slope `ratio` beyond it.

    With a finite `sharpness` R the slope changes smoothly (Menegotto and Pinto, IABSE Symposium, Lisbon 1973):
    f = cubic k^3 + ratio k + (1 - ratio) k / (1 + |k / knee|^R)^(1/R).

    A `table` replaces these formulas: f is then interpolated by Hermite cubics between curvatures that are evenly
    spaced from 0 to `knee`, and continued as a straight line beyond.
    """

    cubic: float = 0.0
    """Coefficient of the cubic term, m^2."""
    knee: np.ndarray | float = np.inf
    """(n, 2) curvature of the knee of every plate, 1/m, for negative and for positive curvature, or what broadcasts to
    that; with a `table`, the curvature of its last row."""
    ratio: float = 1.0
    """Tangent stiffness beyond the knee over EI."""
    sharpness: float = np.inf
    """Exponent R of the smooth law; infinite: a sharp knee."""
    table: np.ndarray | None = None
    """(2, `LAW_ROWS`, 2) for negative and for positive curvature: f divided by the knee, and df / dk."""

    @property
    def linear(self) -> bool:
        """Whether moment is proportional to curvature: no table, no cubic term, no knee that changes the slope."""
        return self.table is None and self.cubic == 0 and (self.ratio == 1 or bool(np.all(np.isinf(self.knee))))


MOST_ELEMENTS = 3
"""Largest number of Jenkin elements per node for which the records of `records.py` have room."""


class Hysteresis(NamedTuple):
    """Hysteresis of the plates, by Jenkin elements or in flag-shaped loops.

    A `share` of the stiffness is carried by `elements` Jenkin elements in parallel, each a spring in series with a
    slider, all of equal stiffness (Prandtl and Ishlinskii; Iwan, J. Appl. Mech. 33 (1966) 893).  With `m` of them

        M = EI [(1 - share) f(k) + share / m sum_e clip(k - p_e, -y_e, y_e)],    y_e = (2 e - 1) / m curvature

    for the bending law `f`; e = 1 .. m.  The curvature `p_e` at which slider e stands changes only where its spring is
    at a bound: p_e <- clip(p_e, k - y_e, k + y_e).  All sliders stand at 0 in virgin plates.  While `k` never turns
    back, one element is the bilinear law with its knee at `curvature` and the ratio 1 - share; unloading takes twice
    the range of loading (Masing).

    With a `reverse` s below 1 plates give back less energy than they took, in flag-shaped loops that close at rest.
    The whole stiffness is then one such spring between two bounds, the law itself (loading) and the law of a material
    that yields at s times the stress (unloading):

        M = EI min(f(k), max(s f(k / s), k - p))    where k > 0, and mirrored where k < 0;    p <- k - M / EI

    Between the bounds the plate is elastic.  A law that does not soften has no loop.  A law that softens must not
    stiffen elsewhere: with 0 <= f' <= 1 where there is a loop, states do not depend on how finely a path is sampled.
    """

    share: float = 0.0
    """Part of the plates' stiffness that the Jenkin elements carry."""
    curvature: np.ndarray | float = np.inf
    """(n,) mean curvature at which the elements of each plate begin to slip, or one for all plates, 1/m."""
    elements: int = 1
    """Number `m` of Jenkin elements, at most `MOST_ELEMENTS`."""
    reverse: float = 1.0
    """Stress of reverse yielding over that of yielding, `s`; 1: no flag-shaped loops."""

    @property
    def slipping(self) -> int:
        """Number of sliders at each node that remember how a plate was bent; 0 for plates without hysteresis."""
        return 1 if self.flagged else self.elements if self.share > 0 else 0

    @property
    def flagged(self) -> bool:
        """Whether the plates have flag-shaped loops."""
        return self.reverse < 1


class Contact(NamedTuple):
    """Contact of neighbouring disks: where a plate bends beyond `angle`, its disks carry `stiffness` times the excess.

    Both are (n, 2), of every plate for negative and for positive bends, or what broadcasts to that.
    """

    angle: np.ndarray | float = np.inf
    """Bend of a plate at which its disks touch, rad."""
    stiffness: np.ndarray | float = 0.0
    """Stiffness of the contact, N m/rad."""
