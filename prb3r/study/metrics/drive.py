"""Metrics of tensions that bring a segment to a given bend, or make it straight."""

import math
from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
import scipy
from pydantic import Field, field_validator

from prb3r.mechanics.chain import Chain, loads
from prb3r.model.files.numbers import Positive
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator
from prb3r.quantities import Quantity
from prb3r.study.metrics.base import Metric, Solved

MOST_BEND = 2 * math.tau
"""Bend of a segment, rad, beyond which it is taken for degrees: two turns.  Choice: no segment coils so far."""


class DriveTension(Metric):
    """Tension of one cable alone that bends a segment by a given angle; NaN where `up_to_n` does not."""

    kind: Literal["drive-tension"]
    together: ClassVar[bool] = True
    from_rest: ClassVar[bool] = True
    cable: str
    segment: Annotated[int, Field(ge=1)]
    bend_rad: Positive
    """Bend of the segment, rad."""
    up_to_n: Positive = 2000.0

    @field_validator("bend_rad")
    @classmethod
    def _in_radians(cls, bend: float) -> float:
        if bend > MOST_BEND:
            turned = f"{bend:g} rad are {bend / math.tau:.1f} turns; {bend:g} degrees are {math.radians(bend):.4g} rad"
            raise ValueError(f"is the bend in radians: {turned}")
        return bend

    def quantities(self) -> list[Quantity]:
        angle = f"{math.degrees(self.bend_rad):.0f} degrees"
        meaning = f"tension of cable {self.cable} alone that bends segment {self.segment} by {angle}"
        meaning += f"; empty: none up to {self.up_to_n:g} N does"
        return [Quantity("drive_tension_n", "T", "N", meaning)]

    def values(self, cases: Solved) -> Sequence[float]:
        return [drive_tension(cases.manipulator, cases.chain, self.cable, self.segment, self.bend_rad, self.up_to_n)]


def drive_tension(manipulator: Manipulator, chain: Chain, cable: str, segment: int, bend: float, up_to: float) -> float:
    """Smallest tension of `cable` alone, N, at which `segment` (from 1) bends by `bend` (rad) either way.

    NaN if it does not bend that far up to the tension `up_to` (N), searched at 40 equal steps.
    """
    start, end = [0, *manipulator.segment_ends][segment - 1 : segment + 1]
    column = manipulator.cable_names.index(cable)

    def bends(pulls: np.ndarray) -> np.ndarray:
        """(s,) magnitude of the segment's bend, rad, under tensions `pulls` (s,), N, applied one after the other; where
        plates relax, each from rest and held for a step."""
        tension = np.zeros((len(pulls), len(manipulator.cable)))
        tension[:, column] = pulls
        states = equilibria_of(chain, loads(chain, tension), from_rest=chain.relaxation != 0)
        return np.abs(states.angle[:, end] - states.angle[:, start])

    grid = np.linspace(0.0, up_to, 41)
    on_grid = bends(grid)
    above = np.flatnonzero(on_grid >= bend)
    if not len(above):
        return np.nan
    if above[0] == 0:  # bent that far without the cable, as by rest curvature
        return 0.0
    around = slice(above[0] - 1, above[0] + 1)
    known = dict(zip(grid[around], on_grid[around], strict=True))

    def missing(pull: float) -> float:
        """Bend beyond the one that is asked for, rad; at the ends of the bracket it is known."""
        return (known[pull] if pull in known else bends(np.array([pull]))[0]) - bend

    return scipy.optimize.brentq(missing, *known, xtol=1e-9)


class ChangingPoint(Metric):
    """Tension of a cable at which a segment is straight under the other loads of the last step (Fig. 14)."""

    kind: Literal["changing-point"]
    cable: str
    segment: Annotated[int, Field(ge=1)] = 1
    up_to_n: Positive = 500.0

    def quantities(self) -> list[Quantity]:
        meaning = f"tension of cable {self.cable} at which segment {self.segment} is straight"
        meaning += f"; empty: at none up to {self.up_to_n:g} N"
        return [Quantity("changing_point_n", "T_c", "N", meaning)]

    def values(self, case: Solved) -> Sequence[float]:
        start, end = [0, *case.manipulator.segment_ends][self.segment - 1 : self.segment + 1]
        slip = -np.ones_like(case.last.slip)  # at a straight segment the direction of friction does not matter

        def bend(pull: float) -> float:
            """Bend of the segment, rad, at the tension `pull`, N, of the cable, from rest."""
            tension = case.last.tension.copy()
            tension[0, case.cable(self.cable)] = pull
            pulled = case.last._replace(tension=tension, slip=slip, travel=tension)
            states = equilibria_of(case.chain, pulled)
            return states.angle[0, end] - states.angle[0, start]

        if not bend(0.0) * bend(self.up_to_n) < 0:
            return [np.nan]
        return [scipy.optimize.brentq(bend, 0.0, self.up_to_n, xtol=1e-10)]
