"""What the library needs to know of a recording: the places where effects could sit, and the scales of their sizes."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.chain import Chain
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.effects.base import Side
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Kind, Recording

Place = Mapping[str, Any]
"""The parameters of an effect that say where it sits, by name; several cables or plates as a tuple."""

READ_SHARE = 0.95
"""Share of the bends as read by which the farthest one is told.  Choice: up to one gross reading in twenty, many more
than are usual, does not count."""


class Scope(NamedTuple):
    """A recording with its nominal chain and the bends of its calibrated model.

    Scales such as `pull` and `curvature` are 1 where nothing is pulled or bent: no effect can be seen there.
    """

    recording: Recording
    chain: Chain
    """The chain of the nominal manipulator, without the effects that are suspected."""
    bend: np.ndarray
    """(s, n) bends of the plates in the calibrated model, rad; NaN where a step has no equilibrium."""
    settings: Settings = Settings()

    @classmethod
    def of(cls, recording: Recording, chain: Chain, states: Equilibria, settings: Settings | None = None) -> "Scope":
        """The scope of a recording with its nominal `chain` and the calibrated `states` of its steps; without
        `settings`, with the usual ones."""
        return cls(recording, chain, np.diff(states.angle, axis=1), settings or Settings())

    @property
    def manipulator(self) -> Manipulator:
        """The manipulator as the recording's file has it, before any constant was fitted or effect added."""
        return self.recording.manipulator

    @property
    def plates(self) -> range:
        """Numbers of all plates from the base to the tip, counted from 1 as places of effects have them."""
        return range(1, self.chain.plates + 1)

    @property
    def segments(self) -> Iterator[tuple[int, tuple[int, ...]]]:
        """Number and plates, both from 1, of every segment of several plates on a rig of several segments.

        A single segment is the whole rig, and a segment of one plate is that plate; both are places already.
        """
        begin = 1
        for number, segment in enumerate(self.manipulator.segment, 1):
            if segment.plates > 1 and len(self.manipulator.segment) > 1:
                yield number, tuple(range(begin, begin + segment.plates))
            begin += segment.plates

    @property
    def pulled(self) -> list[str]:
        """Names of the cables that carry tension at some step."""
        names = self.manipulator.cable_names
        return [names[j] for j in np.flatnonzero((self.recording.loads.tension > 0).any(0))]

    def reach(self, cable: str) -> int:
        """Number of plates that a cable, by name, crosses, which is also the number of holes where it rubs."""
        return int(self.chain.reach[self.manipulator.cable_names.index(cable)])

    @property
    def pull(self) -> float:
        """Largest tension of any cable at any step, N; 1 where nothing is pulled."""
        return float(self.recording.loads.tension.max(initial=0.0)) or 1.0

    @property
    def elapsed(self) -> int:
        """Largest number of steps that precede any step of the recording, in mean step times where times are known; at
        least 1."""
        return max(int(self.recording.loads.elapsed.max(initial=0.0)), 1)

    @property
    def tells_time(self) -> bool:
        """Whether a drift with time can be told from what goes with the load, as there are enough sequences, each of
        which begins with the load anew."""
        return int(self.recording.begins.sum()) >= self.settings.fewest_to_tell_time

    @property
    def usual_step_s(self) -> float | None:
        """How long the median step of a sequence after its first one lasts, s, to one digit, so that recordings at much
        the same pace have it alike; None where no times are known."""
        time = self.recording.loads.time[:, 0]
        lasts = np.diff(time)[~self.recording.begins[1:]]
        return float(f"{np.median(lasts):.1g}") if time.any() and lasts.size else None

    @property
    def dead_loads_noted(self) -> bool:
        """Whether loads on the tip or on disks are noted."""
        return bool(self.recording.loads.force.any() or self.recording.loads.tip.any())

    @property
    def weighs(self) -> bool:
        """Whether the manipulator file has gravity in the plane, and masses on which it acts."""
        return bool(np.any(self.manipulator.chain().gravity)) and bool(self.manipulator.disk_masses.any())

    @property
    def dead_loads_known(self) -> bool:
        """Whether dead loads are noted, or the manipulator file has gravity in the plane."""
        return self.dead_loads_noted or self.weighs

    @property
    def arm(self) -> float:
        """Largest distance of any cable from the axis over any plate, m; 0 without cables."""
        return float(np.abs(self.chain.offset).max(initial=0.0))

    def arm_of(self, cable: str) -> float:
        """Largest distance of one cable, by name, from the axis over any plate, m."""
        return float(np.abs(self.chain.offset[:, self.manipulator.cable_names.index(cable)]).max())

    @property
    def moment(self) -> float:
        """Scale of bending moments, N m: the largest tension at the largest offset; 1 where nothing is pulled."""
        return self.pull * self.arm or 1.0

    @property
    def largest_bend(self) -> float:
        """Largest bend of a plate at any step of the calibrated model, rad; 1 where none bends."""
        return float(np.nanmax(np.abs(self.bend))) or 1.0

    @property
    def bend_read(self) -> np.ndarray:
        """(s, n) bends of the plates as read, rad: read directly, or from the angles of the disks at both ends (the
        base at 0 unless it was read); NaN where neither is known."""
        step, disk, kind, value = self.recording.readings
        angle = np.full((len(self.recording.of_sequence), self.chain.plates + 1), np.nan)
        angle[:, 0] = 0.0
        angle[step[kind == Kind.ANGLE], disk[kind == Kind.ANGLE]] = value[kind == Kind.ANGLE]
        bend = np.diff(angle, axis=1)
        bend[step[kind == Kind.BEND], disk[kind == Kind.BEND] - 1] = value[kind == Kind.BEND]
        return bend

    @property
    def farthest_bend(self) -> float:
        """The larger of `largest_bend` and of what the share `READ_SHARE` of the bends as read does not exceed, rad.

        Plates that soften bend much further than calibrated constants let them.  Of positions alone no bend is read.
        """
        read = np.abs(self.bend_read[np.isfinite(self.bend_read)])
        return max(self.largest_bend, float(np.quantile(read, READ_SHARE)) if read.size else 0.0)

    @property
    def curvature(self) -> float:
        """Largest curvature of a plate at any step of the calibrated model, 1/m; 1 where none bends."""
        return float(np.nanmax(np.abs(self.bend) / self.chain.arc)) or 1.0

    @property
    def in_strain(self) -> bool:
        """Whether the outer fibre of every plate is known, so that strain follows from curvature."""
        return bool(np.isfinite(self.manipulator.outer_fibre).all())

    @property
    def strain(self) -> float:
        """Largest strain of an outermost fibre by bending, at any step of the calibrated model, over the plates whose
        outer fibre is known; 1 where none bends, NaN where no fibre is known."""
        return float(np.nanmax(np.abs(self.bend) / self.chain.arc * self.manipulator.outer_fibre)) or 1.0

    @property
    def sides(self) -> list[Side]:
        """The sides to which some plate bends by more than `Settings.side_share` of the largest bend, which is enough
        to see the law of one side."""
        most: dict[Side, float] = {"negative": -np.nanmin(self.bend), "positive": np.nanmax(self.bend)}
        return [side for side, bend in most.items() if bend > self.settings.side_share * self.largest_bend]

    @property
    def unloads(self) -> bool:
        """Whether some plate bends back within a sequence by more than `Settings.side_share` of the largest bend.

        A sequence begins with straight plates, so that bending away from straight, to either side, is loading.
        """
        return bends_back(self.bend, self.recording.begins, self.settings.side_share * self.largest_bend)

    @property
    def mean_node_rigidity(self) -> np.ndarray:
        """(n,) mean stiffness of the nodes of each plate times its arc, N m^2: 4.4 EI on the elastica with four
        nodes."""
        return (self.chain.elastic_stiffness * self.chain.arc[:, None]).mean(1)


def whole_rig_if(sensible: bool) -> list[Place]:
    """The place of an effect of the whole rig, without parameters, as the only place; no place unless `sensible`."""
    return [{}] if sensible else []


def whole_rig(scope: Scope) -> list[Place]:
    """The place of an effect of the whole rig, without parameters, as the only place."""
    return whole_rig_if(True)


def pulled_cables(scope: Scope) -> Iterator[Place]:
    """A place for each cable that carries tension at some step."""
    return ({"cable": name} for name in scope.pulled)


def together_and_alone(scope: Scope) -> Iterator[Place]:
    """All cables together, then, on a rig of several cables, each pulled cable alone."""
    yield {}
    if len(scope.manipulator.cable_names) > 1:
        yield from ({"cables": (name,)} for name in scope.pulled)


def structure(chain: Chain) -> tuple[Any, ...]:
    """What two chains have alike if one differs from the other by a small change of numbers alone: node counts,
    routing, and the rules of friction and of slip."""
    slips = chain.hysteresis.slipping, chain.hysteresis.flagged
    memory = chain.presliding > 0, chain.relaxation != 0, slips
    return chain.stiffness.shape, tuple(chain.reach.tolist()), chain.edges, memory


def bends_back(bend: np.ndarray, begins: np.ndarray, least: float) -> bool:
    """Whether some plate bends back by more than `least` within a sequence, after it was bent as far to that side.

    Parameters
    ----------
    bend : (s, n) bend of every plate at each step, rad; NaN without an equilibrium.
    begins : (s,) whether a step is the first of its sequence.
    """
    for rows in np.split(bend, np.flatnonzero(begins)[1:]):
        known = rows[np.isfinite(rows).all(1)]
        for side in (known, -known):
            farthest = np.maximum.accumulate(side, axis=0)
            if ((farthest > least) & (farthest - side > least)).any():
                return True
    return False
