"""Metrics: numbers that a case is judged by, each one small class.

A metric names its columns and computes them from a solved case.  Some read the states of the case, others load the
case further (`coupling`, `drive-tension`, ...): they are small experiments on the same manipulator.
"""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.optimize import brentq

from prb3r.mechanics.chain import Chain, Loads, loads, pose
from prb3r.mechanics.equilibrium import Equilibria, Outcome
from prb3r.mechanics.limit import limit_load
from prb3r.mechanics.plate import gauss_collocation
from prb3r.mechanics.strain import peak_strain
from prb3r.model.files.numbers import Positive
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator, Strict
from prb3r.quantities import Quantity
from prb3r.study.workspace import area, cloud_loads

LEFT_OUT_OF_FURTHER = ("lowest_eigenvalue", "closed")
"""What equilibria of a metric's own loads do without."""
CIRCLE_POINTS = 6
"""Gauss points that integrate a circular arc to rounding error."""

DiskNumber = Annotated[int, Field(ge=0)] | Literal["tip"]


@dataclass(frozen=True)
class Solved:
    """A case with its equilibria.

    `initial` tells whether the first load step is the initial configuration (else the case starts from rest).
    """

    manipulator: Manipulator
    chain: Chain
    loads: Loads
    states: Equilibria
    initial: bool = False
    cloud: bool = False

    def at(self, disk: DiskNumber) -> int:
        """Number of a disk.

        Raises
        ------
        ValueError
            If the manipulator has no such disk.
        """
        number = self.chain.plates if disk == "tip" else disk
        if number > self.chain.plates:
            raise ValueError(f"there is no disk {number}, the tip is disk {self.chain.plates}")
        return number

    def cable(self, name: str) -> int:
        return self.manipulator.cable_names.index(name)

    @cached_property
    def last(self) -> Loads:
        """The loads of the last step, as one step."""
        return Loads(*(field[-1:] for field in self.loads))

    def continued(self, *further: Loads) -> Equilibria:
        """Equilibria of further load steps, each reached from the last one of the case."""
        paths = [Loads(*(np.concatenate(pair) for pair in zip(self.last, step, strict=True))) for step in further]
        found = [equilibria_of(self.chain, path, number=np.ones(2)) for path in paths]
        names = [field.name for field in dataclasses.fields(Equilibria) if field.name not in LEFT_OUT_OF_FURTHER]
        last = {name: np.concatenate([getattr(one, name)[-1:] for one in found]) for name in names}
        return Equilibria(**last, lowest_eigenvalue=None)


class Metric(Strict, ABC):
    """A metric; `kind` names it in a study file."""

    kind: str

    @abstractmethod
    def quantities(self) -> list[Quantity]:
        """Its columns."""

    @abstractmethod
    def values(self, case: Solved) -> Sequence[float]:
        """Its numbers, in the order of the columns; NaN where a load has no equilibrium."""


def _stem(disk: DiskNumber) -> str:
    return "tip" if disk == "tip" else f"disk{disk}"


def _words(disk: DiskNumber) -> str:
    return "the tip disk" if disk == "tip" else f"disk {disk}"


class Position(Metric):
    """Where a disk ends up."""

    kind: Literal["position"]
    disk: DiskNumber = "tip"

    def quantities(self) -> list[Quantity]:
        stem, disk = _stem(self.disk), _words(self.disk)
        return [
            Quantity(f"{stem}_x_m", "x", "m", f"centre of {disk} along the straight manipulator"),
            Quantity(f"{stem}_y_m", "y", "m", f"centre of {disk} across the manipulator"),
            Quantity(f"{stem}_angle_rad", "θ", "rad", f"absolute angle of {disk}"),
        ]

    def values(self, case: Solved) -> Sequence[float]:
        disk, states = case.at(self.disk), case.states
        return states.x[-1, disk], states.y[-1, disk], states.angle[-1, disk]


class Shift(Metric):
    """How far a disk moves and turns from the initial configuration to the last step."""

    kind: Literal["shift"]
    disk: DiskNumber

    def quantities(self) -> list[Quantity]:
        stem, disk = _stem(self.disk), _words(self.disk)
        return [
            Quantity(f"{stem}_shift_m", "Δ", "m", f"distance {disk} moves from the initial configuration"),
            Quantity(f"{stem}_turn_rad", "Δθ", "rad", f"angle {disk} turns from the initial configuration"),
        ]

    def values(self, case: Solved) -> Sequence[float]:
        disk, states = case.at(self.disk), case.states
        if case.initial:
            x, y, angle = states.x[0, disk], states.y[0, disk], states.angle[0, disk]
        else:
            straight = pose(case.chain, case.chain.rest)
            x, y, angle = straight.x[disk], straight.y[disk], straight.angle[disk]
        return np.hypot(states.x[-1, disk] - x, states.y[-1, disk] - y), states.angle[-1, disk] - angle


class CurvatureError(Metric):
    """How far disks lie from constant curvature with the same total angle (Eq. 13, 14; Fig. 9, 10)."""

    kind: Literal["curvature-error"]
    over: Literal["manipulator", "segment"] = "segment"
    """What has one curvature: every segment, or the whole manipulator where one cable bends it all."""

    def quantities(self) -> list[Quantity]:
        return [
            Quantity("curvature_error", "e", "1", "largest distance of a disk from constant curvature, of the length"),
            Quantity("curvature_error_y", "e_y", "1", "the largest distance across the manipulator, of the length"),
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


class Coupling(Metric):
    """How a newton more on a cable that drives an outer segment moves and turns an inner disk."""

    kind: Literal["coupling"]
    cable: str
    disk: DiskNumber
    load_n: Positive = 1.0

    def quantities(self) -> list[Quantity]:
        disk = _words(self.disk)
        return [
            Quantity("coupling_m_per_n", "", "m/N", f"shift of {disk} per newton added to cable {self.cable}"),
            Quantity("coupling_rad_per_n", "", "rad/N", f"turn of {disk} per newton added to cable {self.cable}"),
        ]

    def values(self, case: Solved) -> Sequence[float]:
        disk, more = case.at(self.disk), case.last.tension.copy()
        more[0, case.cable(self.cable)] += self.load_n
        found, states = case.continued(case.last._replace(tension=more)), case.states
        shift = np.hypot(found.x[0, disk] - states.x[-1, disk], found.y[0, disk] - states.y[-1, disk])
        return shift / self.load_n, abs(found.angle[0, disk] - states.angle[-1, disk]) / self.load_n


class Workspace(Metric):
    """Area that the tip disk's centre reaches, counted in square cells, with its convergence.

    Without `tension_n` the loads are the study's own cloud.
    """

    kind: Literal["workspace"]
    cell: Positive = 0.01
    """Side of a cell, of the straight length."""
    count: Annotated[int, Field(ge=16, le=4_194_304)] = 8192
    tension_n: dict[str, Positive] | None = None

    def quantities(self) -> list[Quantity]:
        cell = f"cells of {100 * self.cell:g} % of the length"
        return [
            Quantity("workspace_area_m2", "A", "m^2", f"area reached by the tip disk's centre, {cell}"),
            Quantity(
                "workspace_half_share", "", "1", "share of it that the first half of the loads reaches: convergence"
            ),
            Quantity("workspace_failed", "", "1", "share of the loads that have no equilibrium"),
        ]

    def values(self, case: Solved) -> Sequence[float]:
        states = case.states
        if self.tension_n is not None:
            limits = {name: tension for name, tension in self.tension_n.items() if case.chain.reach[case.cable(name)]}
            cloud = cloud_loads(case.manipulator, case.chain, limits, self.count)
            states = equilibria_of(case.chain, cloud, from_rest=True, detail=False)
        x, y, side = states.x[:, -1], states.y[:, -1], self.cell * case.chain.length
        half, whole = len(x) // 2, area(x, y, side)
        share = area(x[:half], y[:half], side) / whole if whole else np.nan
        return whole, share, float(np.mean(states.outcome != Outcome.CONVERGED))


class DriveTension(Metric):
    """Tension of one cable alone that bends a segment by a given angle; NaN where `up_to_n` does not."""

    kind: Literal["drive-tension"]
    cable: str
    segment: Annotated[int, Field(ge=1)]
    bend_rad: Positive
    up_to_n: Positive = 2000.0

    def quantities(self) -> list[Quantity]:
        angle = f"{np.degrees(self.bend_rad):.0f} degrees"
        meaning = f"tension of cable {self.cable} alone that bends segment {self.segment} by {angle}"
        return [Quantity("drive_tension_n", "T", "N", meaning)]

    def values(self, case: Solved) -> Sequence[float]:
        return [drive_tension(case.manipulator, case.chain, self.cable, self.segment, self.bend_rad, self.up_to_n)]


def drive_tension(manipulator: Manipulator, chain: Chain, cable: str, segment: int, bend: float, up_to: float) -> float:
    """Tension (N) of `cable` alone at which `segment` (from 1) bends by `bend` (rad); NaN above `up_to`."""
    start, end = [0, *manipulator.segment_ends][segment - 1 : segment + 1]
    column = manipulator.cable_names.index(cable)

    def bends(pulls: np.ndarray) -> np.ndarray:
        tension = np.zeros((len(pulls), len(manipulator.cable)))
        tension[:, column] = pulls
        states = equilibria_of(chain, loads(chain, tension))
        return np.abs(states.angle[:, end] - states.angle[:, start])

    grid = np.linspace(0.0, up_to, 41)
    above = np.flatnonzero(bends(grid) >= bend)
    if not len(above):
        return np.nan
    return brentq(lambda pull: bends(np.array([pull]))[0] - bend, grid[above[0] - 1], grid[above[0]], xtol=1e-9)


class FrictionDirection(Metric):
    """How far a disk moves when all friction reverses at the same tensions: cables paid out instead of drawn in."""

    kind: Literal["friction-direction"]
    disk: DiskNumber = "tip"

    def quantities(self) -> list[Quantity]:
        meaning = f"distance of {_words(self.disk)} between all cables drawn in and all paid out"
        return [Quantity("friction_direction_shift_m", "", "m", meaning)]

    def values(self, case: Solved) -> Sequence[float]:
        disk, ones = case.at(self.disk), np.ones_like(case.last.slip)
        found = case.continued(case.last._replace(slip=-ones), case.last._replace(slip=ones))
        return [np.hypot(*np.diff([found.x[:, disk], found.y[:, disk]]).ravel())]


class Loop(Metric):
    """What a disk does where a cable is let go and drawn in again: the last fall and rise of the cable's tension."""

    kind: Literal["loop"]
    cable: str
    disk: DiskNumber = "tip"
    share: Annotated[float, Field(gt=0, lt=1)] = 0.05
    """Of its way back that the disk must have gone to count as moving."""

    def quantities(self) -> list[Quantity]:
        stem, disk = _stem(self.disk), _words(self.disk)
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
    """Rows at which the last two monotonic parts of `tension` begin and the last one ends."""
    going = np.sign(np.diff(tension))
    moving = np.flatnonzero(going)
    turns = moving[1:][np.diff(going[moving]) != 0]
    first, second, third = ([0, 0, *turns.tolist(), len(tension) - 1])[-3:]
    return first, second, third


class TipCompliance(Metric):
    """Largest shift of the tip disk per newton of a small force on it, over all directions of the force."""

    kind: Literal["tip-compliance"]
    load_n: Positive = 0.05

    def quantities(self) -> list[Quantity]:
        return [Quantity("tip_compliance_m_per_n", "", "m/N", "largest shift of the tip disk per newton of tip force")]

    def values(self, case: Solved) -> Sequence[float]:
        pushes = self.load_n * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]], float)
        found = case.continued(*(case.last._replace(tip=case.last.tip + push) for push in pushes))
        moved = np.array([found.x[:, -1], found.y[:, -1]])
        compliance = (moved[:, ::2] - moved[:, 1::2]) / (2 * self.load_n)
        return [float(np.linalg.norm(compliance, 2)) if np.isfinite(compliance).all() else np.nan]


class Safety(Metric):
    """Highest strain and stress of a plate over all load steps, and the safety factor against yield."""

    kind: Literal["safety"]

    def quantities(self) -> list[Quantity]:
        return [
            Quantity("peak_strain", "ε", "1", "highest bending strain of a plate over all load steps"),
            Quantity("peak_stress_pa", "σ", "Pa", "highest bending stress of a plate over all load steps"),
            Quantity("safety_factor", "S", "1", "yield stress over the highest bending stress"),
        ]

    def values(self, case: Solved) -> Sequence[float]:
        strain = peak_strain(case.states, case.manipulator.bending_stiffness, case.manipulator.outer_fibre)
        peak = float(np.nanmax(strain)) if np.isfinite(strain).any() else np.nan
        stress = peak * case.manipulator.youngs_modulus_pa
        return peak, stress, (case.manipulator.yield_stress_pa or np.nan) / stress if stress else np.inf


class Stability(Metric):
    """Lowest eigenvalue of the tangent over all load steps, relative to that of the unloaded manipulator."""

    kind: Literal["stability"]
    about: ClassVar[str] = "lowest eigenvalue of the tangent over all load steps, relative to the unloaded one"

    def quantities(self) -> list[Quantity]:
        return [Quantity("stability_margin", "", "1", self.about)]

    def values(self, case: Solved) -> Sequence[float]:
        rest = equilibria_of(case.chain, Loads(*(np.zeros_like(field) for field in case.last)), eigenvalue=True)
        loaded, unloaded = case.states.lowest_eigenvalue, rest.lowest_eigenvalue
        return [float(np.nanmin(loaded) / unloaded[0]) if loaded is not None and unloaded is not None else np.nan]


class LimitLoad(Metric):
    """Factor by which all loads of the last step can grow before the branch ends or loses stability.

    Infinite where they can grow to `up_to` times what they are.
    """

    kind: Literal["limit-load"]
    since: Literal["path", "rest"] = "path"
    """Grow from the end of the case's path, or the last step's loads alone from rest."""
    up_to: Annotated[float, Field(gt=1, le=1e6)] = 20.0

    def quantities(self) -> list[Quantity]:
        meaning = "factor by which all loads of the last step can grow before the branch ends or loses stability"
        return [Quantity("limit_load_factor", "", "1", meaning)]

    def values(self, case: Solved) -> Sequence[float]:
        return [limit_load(case.chain, case.loads, from_rest=self.since == "rest", most=self.up_to).factor]


class ChangingPoint(Metric):
    """Tension of a cable at which a segment is straight under the other loads of the last step (Fig. 14)."""

    kind: Literal["changing-point"]
    cable: str
    segment: Annotated[int, Field(ge=1)] = 1
    up_to_n: Positive = 500.0

    def quantities(self) -> list[Quantity]:
        meaning = f"tension of cable {self.cable} at which segment {self.segment} is straight"
        return [Quantity("changing_point_n", "T_c", "N", meaning)]

    def values(self, case: Solved) -> Sequence[float]:
        start, end = [0, *case.manipulator.segment_ends][self.segment - 1 : self.segment + 1]
        slip = -np.ones_like(case.last.slip)  # at a straight segment the direction of friction does not matter

        def bend(pull: float) -> float:
            tension = case.last.tension.copy()
            tension[0, case.cable(self.cable)] = pull
            found = equilibria_of(case.chain, case.last._replace(tension=tension, slip=slip))
            return found.angle[0, end] - found.angle[0, start]

        if not bend(0.0) * bend(self.up_to_n) < 0:
            return [np.nan]
        return [brentq(bend, 0.0, self.up_to_n, xtol=1e-10)]


AnyMetric = Annotated[
    Position
    | Shift
    | CurvatureError
    | Coupling
    | Workspace
    | DriveTension
    | FrictionDirection
    | Loop
    | TipCompliance
    | Safety
    | Stability
    | LimitLoad
    | ChangingPoint,
    Field(discriminator="kind"),
]
