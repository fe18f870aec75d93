"""What plates resist bending with beside their stiffness: laws of moment over curvature, hysteresis, contact of disks.

All by numbers that hold for every plate, or by arrays with a row for each.
"""

from typing import NamedTuple

import numpy as np

LAW_ROWS = 129
"""Rows of a table of a law: with the curvature at which plates begin to yield at every sixteenth, a law whose second
derivative jumps there by 3 of its own units is met to 2e-4."""


class Law(NamedTuple):
    """``M = EI f(k)`` for the curvature `k` beyond the stress-free one: f = k (1 + cubic k^2) up to the curvature
    `knee` (1/m), beyond it with the slope `ratio`.

    With a finite `sharpness` R the slope passes over smoothly (Menegotto and Pinto, IABSE Symposium, Lisbon 1973):
    f = cubic k^3 + ratio k + (1 - ratio) k / (1 + |k / knee|^R)^(1/R).

    A `table` stands in the place of all that: f by cubics (Hermite's) between curvatures that are evenly spaced from 0
    to `knee`, and straight on beyond.
    """

    cubic: float = 0.0
    knee: np.ndarray | float = np.inf
    """(n, 2) of every plate for negative and for positive curvature, or what broadcasts to that."""
    ratio: float = 1.0
    sharpness: float = np.inf
    table: np.ndarray | None = None
    """(2, `LAW_ROWS`, 2) for negative and for positive curvature: f over the knee, and df / dk."""

    @property
    def linear(self) -> bool:
        """Whether moment is proportional to curvature: no table, no cubic term, no knee that changes the slope."""
        return self.table is None and self.cubic == 0 and (self.ratio == 1 or bool(np.all(np.isinf(self.knee))))


MOST_ELEMENTS = 3
"""Jenkin elements of a plate's hysteresis for which records have room."""


class Hysteresis(NamedTuple):
    """A `share` of the plates' stiffness slips, as `elements` Jenkin elements side by side do: a spring each, of equal
    stiffness, behind a slider (Prandtl and Ishlinskii; Iwan, J. Appl. Mech. 33 (1966) 893).  With `m` of them

        M = EI [(1 - share) f(k) + share / m sum_e clip(k - p_e, -y_e, y_e)],    y_e = (2 e - 1) / m curvature

    for the law `f`; e = 1 .. m.  The curvature `p_e` where a slider stands moves when its spring is at its bound:
    p_e <- clip(p_e, k - y_e, k + y_e).  All stand at 0 in virgin plates.  Where `k` never turns back, one element is
    the bilinear law with its knee at `curvature` and the ratio 1 - share; unloading is twice as long (Masing).

    With a `reverse` s below 1 plates give back less than they took, in flag-shaped loops that close at rest: the whole
    stiffness is one such spring, and its bounds are the law, loading, and the law of a material that yields at s times
    the stress, unloading:

        M = EI min(f(k), max(s f(k / s), k - p))    where k > 0, and mirrored where k < 0;    p <- k - M / EI

    Between the two it is elastic.  Where the law does not soften there is no loop.  What softens must not stiffen
    elsewhere: with 0 <= f' <= 1 where there is a loop, states do not depend on how finely a path is sampled.
    """

    share: float = 0.0
    curvature: np.ndarray | float = np.inf
    """(n,) from which the elements slip, on average, or one for all, 1/m."""
    elements: int = 1
    reverse: float = 1.0
    """Stress at which a material turns back over that at which it yields; 1: as one."""

    @property
    def slipping(self) -> int:
        """Number of elements whose sliders remember how a plate was bent; 0 where nothing does."""
        return 1 if self.flagged else self.elements if self.share > 0 else 0

    @property
    def flagged(self) -> bool:
        """Whether the law has flag-shaped loops."""
        return self.reverse < 1


class Contact(NamedTuple):
    """A plate whose bend exceeds `angle` (rad) is helped by its disks with `stiffness` (N m/rad) times the excess.

    Both (n, 2), of every plate for negative and for positive bends, or what broadcasts to that.
    """

    angle: np.ndarray | float = np.inf
    stiffness: np.ndarray | float = 0.0
