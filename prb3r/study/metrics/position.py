"""Metrics of the positions of disks and their distances from shapes of constant curvature."""

from collections.abc import Sequence
from typing import ClassVar, Literal

import numpy as np
import scipy

from prb3r.mechanics.chain import pose
from prb3r.mechanics.plate import gauss_collocation
from prb3r.quantities import Quantity
from prb3r.study.metrics.base import DiskNumber, Metric, Solved, column_stem, disk_in_words

CIRCLE_POINTS = 6
"""Number of Gauss points that integrate a circular arc up to rounding errors."""


class Position(Metric):
    """Where a disk is and how it is turned at the last load step."""

    kind: Literal["position"]
    together: ClassVar[bool] = True
    disk: DiskNumber = "tip"

    def quantities(self) -> list[Quantity]:
        stem, disk = column_stem(self.disk), disk_in_words(self.disk)
        return [
            Quantity(f"{stem}_x_m", "x", "m", f"centre of {disk} along the straight manipulator"),
            Quantity(f"{stem}_y_m", "y", "m", f"centre of {disk} across the manipulator"),
            Quantity(f"{stem}_angle_rad", "θ", "rad", f"absolute angle of {disk}"),
        ]

    def values(self, cases: Solved) -> Sequence[np.ndarray]:
        disk, states, ends = cases.at(self.disk), cases.states, cases.ends
        return states.x[ends, disk], states.y[ends, disk], states.angle[ends, disk]


class Shift(Metric):
    """How far a disk moves and turns from the initial configuration to the last step."""

    kind: Literal["shift"]
    together: ClassVar[bool] = True
    disk: DiskNumber

    def quantities(self) -> list[Quantity]:
        stem, disk = column_stem(self.disk), disk_in_words(self.disk)
        return [
            Quantity(f"{stem}_shift_m", "Δ", "m", f"distance {disk} moves from the initial configuration"),
            Quantity(f"{stem}_turn_rad", "Δθ", "rad", f"angle {disk} turns from the initial configuration"),
        ]

    def values(self, cases: Solved) -> Sequence[np.ndarray]:
        disk, states, ends = cases.at(self.disk), cases.states, cases.ends
        if cases.initial:
            x, y, angle = (values[cases.begins, disk] for values in (states.x, states.y, states.angle))
        else:
            rest = cases.unloaded.states
            x, y, angle = rest.x[0, disk], rest.y[0, disk], rest.angle[0, disk]
        return np.hypot(states.x[ends, disk] - x, states.y[ends, disk] - y), states.angle[ends, disk] - angle


class CurvatureError(Metric):
    """How far disks lie from constant curvature with the same total angle (Eq. 13, 14; Fig. 9, 10)."""

    kind: Literal["curvature-error"]
    over: Literal["manipulator", "segment"] = "segment"
    """What has one curvature: every segment, or the whole manipulator where one cable bends it all."""

    def quantities(self) -> list[Quantity]:
        return [
            Quantity("curvature_error", "e", "1", "largest distance of a disk from constant curvature, of the length"),
            Quantity(
                "curvature_error_y",
                "e_y",
                "1",
                "largest distance of a disk from constant curvature across the manipulator, of the length",
            ),
            Quantity("total_angle_rad", "Σθ", "rad", "angle of the tip disk"),
        ]

    def values(self, case: Solved) -> Sequence[float]:
        states, chain = case.states, case.chain
        ends = np.array(case.manipulator.segment_ends if self.over == "segment" else [chain.plates])
        plates = np.diff(ends, prepend=0)
        bends = np.repeat(np.diff(states.angle[-1, ends], prepend=0.0) / plates, plates)
        arcs = gauss_collocation(CIRCLE_POINTS)
        circle = pose(chain._replace(plate=arcs), bends[:, None] * arcs.end)
        dx, dy = states.x[-1] - circle.x, states.y[-1] - circle.y
        return np.hypot(dx, dy).max() / chain.length, np.abs(dy).max() / chain.length, states.angle[-1, -1]


class LocusError(Metric):
    """How far the tip lies from the locus of tips under constant curvature, at the same x (Fig. 10 read so).

    The constant curvature is that of the whole manipulator, as one cable bends it.
    """

    kind: Literal["locus-error"]

    def quantities(self) -> list[Quantity]:
        meaning = "distance of the tip in y from the locus of constant curvature at the same x, of its own y"
        return [Quantity("locus_error_y", "e_x", "1", meaning)]

    def values(self, case: Solved) -> Sequence[float]:
        chain, x, y = case.chain, case.states.x[-1, -1], case.states.y[-1, -1]
        arcs = gauss_collocation(CIRCLE_POINTS)

        def tip(total: float) -> tuple[float, float]:
            """Position (x, y) of the tip disk, m, under constant curvature with the total angle, rad."""
            bends = np.full(chain.plates, total / chain.plates)
            circle = pose(chain._replace(plate=arcs), bends[:, None] * arcs.end)
            return circle.x[-1], circle.y[-1]

        turn = np.copysign(np.pi, y)  # x falls all the way from straight to half a turn
        if y == 0 or not tip(turn)[0] < x < tip(0.0)[0]:
            return [np.nan]
        total = scipy.optimize.brentq(lambda angle: tip(angle)[0] - x, 0.0, turn, xtol=1e-12)
        return [abs((y - tip(total)[1]) / y)]
