"""Metrics of how disks move under a small additional load, reversed friction, or a cable released and pulled again."""

from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from prb3r.model.files.numbers import Positive
from prb3r.model.manipulator import Manipulator
from prb3r.quantities import Quantity
from prb3r.study.metrics.base import DiskNumber, Metric, Solved, column_stem, disk_in_words


class Coupling(Metric):
    """How a newton more on a cable that drives an outer segment moves and turns an inner disk."""

    kind: Literal["coupling"]
    together: ClassVar[bool] = True
    from_rest: ClassVar[bool] = True
    cable: str
    disk: DiskNumber | None = None
    """Number of the disk that moves, 0 at the base, or tip."""
    segment: Annotated[int, Field(ge=1)] | None = None
    """Instead of a disk: the last one of this segment, whatever its number."""
    load_n: Positive = 1.0
    """Tension that is added to see it, N; results are per newton."""

    @model_validator(mode="after")
    def _one_place(self) -> "Coupling":
        if (self.disk is None) == (self.segment is None):
            raise ValueError("give one of disk and segment")
        return self

    def quantities(self) -> list[Quantity]:
        disk = f"the last disk of segment {self.segment}" if self.disk is None else disk_in_words(self.disk)
        return [
            Quantity("coupling_m_per_n", "", "m/N", f"shift of {disk} per newton added to cable {self.cable}"),
            Quantity("coupling_rad_per_n", "", "rad/N", f"turn of {disk} per newton added to cable {self.cable}"),
        ]

    def values(self, cases: Solved) -> Sequence[np.ndarray]:
        last = cases.manipulator.segment_ends[(self.segment or 1) - 1]
        disk, more = cases.at(last if self.disk is None else self.disk), cases.last.tension.copy()
        more[:, cases.cable(self.cable)] += self.load_n
        pulled, states, ends = cases.continued(cases.last._replace(tension=more)), cases.states, cases.ends
        if cases.chain.relaxation:  # both without time for the plates to relax further
            states, ends = cases.continued(cases.last), np.arange(cases.count)
        shift = np.hypot(pulled.x[:, disk] - states.x[ends, disk], pulled.y[:, disk] - states.y[ends, disk])
        return shift / self.load_n, np.abs(pulled.angle[:, disk] - states.angle[ends, disk]) / self.load_n


SECTORS = 12
"""Sectors of 30 degrees into which the directions of a force are divided where friction follows the load path."""
BETWEEN = 8
"""Directions within a sector at which its largest shift is sought."""


class TipCompliance(Metric):
    """Largest shift of the tip disk per newton of a small force on it, over all directions of the force.

    Where friction or plates remember the load path the arm is stiffer one way than the other: it is pushed from the
    last step in `SECTORS` directions, between which the shift is linear in the force.  Otherwise it is the largest
    singular value of the shifts by a push and a pull along either axis.
    """

    kind: Literal["tip-compliance"]
    together: ClassVar[bool] = True
    from_rest: ClassVar[bool] = True
    load_n: Positive = 0.05
    """Size of that force, N."""

    def quantities(self) -> list[Quantity]:
        return [Quantity("tip_compliance_m_per_n", "", "m/N", "largest shift of the tip disk per newton of tip force")]

    def values(self, cases: Solved) -> Sequence[np.ndarray]:
        if cases.chain.remembers:
            return [self._one_way(cases)]
        pushes = self.load_n * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]], float)
        pushed = cases.continued(*(cases.last._replace(tip=cases.last.tip + push) for push in pushes))
        moved = np.array([pushed.x[:, -1], pushed.y[:, -1]]).reshape(2, 4, cases.count)
        compliance = np.moveaxis((moved[:, ::2] - moved[:, 1::2]) / (2 * self.load_n), -1, 0)
        known, largest = np.isfinite(compliance).all((1, 2)), np.full(cases.count, np.nan)
        largest[known] = np.linalg.norm(compliance[known], 2, axis=(1, 2))
        return [largest]

    def _one_way(self, cases: Solved) -> np.ndarray:
        """(c,) the largest shift per newton of pushes from the last step; NaN where one has no equilibrium."""
        angles = 2 * np.pi / SECTORS * np.arange(SECTORS)
        pushes = self.load_n * np.stack([np.cos(angles), np.sin(angles)], 1)
        still = cases.last
        pushed = cases.continued(still, *(still._replace(tip=still.tip + push) for push in pushes))
        tips = np.array([pushed.x[:, -1], pushed.y[:, -1]]).reshape(2, SECTORS + 1, cases.count)
        shift = (tips[:, 1:] - tips[:, :1]) / self.load_n
        part = angles[1] * np.linspace(0, 1, BETWEEN + 1)[:, None, None, None]
        share = np.sin(part) / np.sin(angles[1]), np.sin(angles[1] - part) / np.sin(angles[1])
        between = share[0] * np.roll(shift, -1, 1) + share[1] * shift
        return np.hypot(*np.moveaxis(between, 1, 0)).max((0, 1))


class FrictionDirection(Metric):
    """How far a disk moves when all friction reverses at the same tensions: cables paid out instead of drawn in."""

    kind: Literal["friction-direction"]
    together: ClassVar[bool] = True
    disk: DiskNumber = "tip"

    def quantities(self) -> list[Quantity]:
        meaning = f"distance of {disk_in_words(self.disk)} between all cables drawn in and all paid out"
        return [Quantity("friction_direction_shift_m", "", "m", meaning)]

    def problems(self, manipulator: Manipulator, cloud: bool) -> Iterator[str]:
        """As of any metric; and it needs slip that is declared."""
        yield from super().problems(manipulator, cloud)
        if manipulator.follows_history:
            yield 'needs declared slip: with friction.direction = "history" it follows from the travel of the cables'

    def values(self, cases: Solved) -> Sequence[np.ndarray]:
        disk, ones = cases.at(self.disk), np.ones_like(cases.last.slip)
        states = cases.continued(cases.last._replace(slip=-ones), cases.last._replace(slip=ones))
        drawn, paid = np.split(np.array([states.x[:, disk], states.y[:, disk]]), 2, axis=1)
        return [np.hypot(*(paid - drawn))]


class Loop(Metric):
    """What a disk does where a cable is let go and drawn in again: the last fall and rise of the cable's tension."""

    kind: Literal["loop"]
    cable: str
    disk: DiskNumber = "tip"
    share: Annotated[float, Field(gt=0, lt=1)] = 0.05
    """Of its way back that the disk must have gone to count as moving."""

    def quantities(self) -> list[Quantity]:
        stem, disk = column_stem(self.disk), disk_in_words(self.disk)
        way = f"tension of cable {self.cable} over the way of {disk} across the manipulator"
        back = f"fall of the tension of cable {self.cable} until {disk} has gone {100 * self.share:g} % of its way back"
        return [
            Quantity(f"{stem}_loop_area_n_m", "", "N m", f"area of the loop of the {way}; no energy"),
            Quantity(f"{stem}_loop_opening_m", "", "m", f"largest gap in y of {disk} between fall and rise"),
            Quantity(f"{stem}_dead_band_n", "", "N", back),
        ]

    def values(self, case: Solved) -> Sequence[float]:
        tension, y = case.loads.tension[:, case.cable(self.cable)], case.states.y[:, case.at(self.disk)]
        top, bottom, end = last_loop(tension)
        if not tension[top] > tension[bottom]:
            raise ValueError(f"the tension of cable {self.cable} does not fall and rise at the end")
        pull, way = (np.append(values[top : end + 1], values[top]) for values in (tension, y))
        area = abs(np.sum((way[1:] + way[:-1]) / 2 * np.diff(pull)))
        fall, rise = slice(top, bottom + 1), slice(bottom, end + 1)
        shared = tension[fall] <= tension[end]
        opening = np.abs(y[fall] - np.interp(tension[fall], tension[rise], y[rise]))[shared].max()
        gone = (y[fall] - y[top]) / ((y[bottom] - y[top]) or np.nan)
        first = int(np.argmax(gone >= self.share))
        if not first:
            return area, opening, np.nan
        part = (self.share - gone[first - 1]) / (gone[first] - gone[first - 1])
        moves = tension[fall][first - 1] + part * np.diff(tension[fall])[first - 1]
        return area, opening, tension[top] - moves


def last_loop(tension: np.ndarray) -> tuple[int, int, int]:
    """Rows where the last but one monotonic part of `tension` starts, where the last one starts, and where it ends."""
    going = np.sign(np.diff(tension))
    moving = np.flatnonzero(going)
    turns = moving[1:][np.diff(going[moving]) != 0]
    first, second, third = ([0, 0, *turns.tolist(), len(tension) - 1])[-3:]
    return first, second, third
