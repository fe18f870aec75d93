"""Designs: a manipulator as its owner describes it, and how it is recorded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Any

import numpy as np

from prb3r.proof.rig.simulate import RigStates, simulate
from prb3r.recording.recording import Kind

LoadSteps = tuple[Mapping[str, float], ...]
"""Steps of one sequence, each a mapping from columns of the table of steps to values."""


class Flavour(StrEnum):
    """What a design is drawn for.  Bench rigs, the first four, are built exactly as drawn; real rigs are not."""

    PLAIN = "plain"
    """Bench rig with declared slip directions."""
    HISTORY = "history"
    """Bench rig whose friction follows the load path."""
    LOADING = "loading"
    """Bench rig that is unloaded in the last sequences alone, so that calibration can hide effects."""
    POOR = "poor"
    """Bench rig with few sequences, loading only, and few kinds of reading, so that effects are confused."""
    REAL = "real"
    """A rig with imperfections; slip directions are declared."""
    REAL_BARE = "real, bare"
    """As `REAL`, but the nominal model has no friction."""
    REAL_HISTORY = "real, history"
    """As `REAL`, but friction follows the load path, in the nominal model too."""
    REAL_UNTOLD = "real, history untold"
    """As `REAL`, but friction follows the load path while the nominal model has declared slip."""
    REAL_NITINOL = "real, nitinol"
    """As `REAL`, but plates are of nitinol and bend beyond its elastic range."""

    @property
    def is_real(self) -> bool:
        """Whether the rigs have imperfections that no file tells."""
        slow = self.REAL_HISTORY, self.REAL_UNTOLD
        return self in (self.REAL, self.REAL_BARE, *slow, self.REAL_NITINOL)

    @property
    def is_slow(self) -> bool:
        """Whether the rig's friction follows the load path, which is slow to simulate: such designs are small."""
        return self in (Flavour.HISTORY, Flavour.REAL_HISTORY, Flavour.REAL_UNTOLD)


@dataclass(frozen=True)
class Design:
    """A manipulator as its owner describes it, and how it is recorded."""

    number: int
    """Number of the design within a run, from 0."""
    flavour: Flavour
    manipulator: Mapping[str, Any]
    """Contents of the nominal manipulator file."""
    measurement: Mapping[str, float]
    """Stated standard deviations, as in a recording's file."""
    prior: Mapping[str, float]
    """Relative standard deviations of the constants' priors, as in a recording's file; absent: flat."""
    kinds: tuple[Kind, ...]
    """Kinds of reading at every disk."""
    program: tuple[LoadSteps, ...]
    """Load steps of every sequence, as noted."""
    largest_bend: float
    """Largest bend of a plate of the nominal manipulator under the program, rad."""

    @property
    def plates(self) -> int:
        """Number of plates of all segments together; disks after the base are as many."""
        return sum(segment["plates"] for segment in self.manipulator["segment"])

    @property
    def cables(self) -> tuple[str, ...]:
        """Names of the cables in the order of the manipulator's file, which is that of all arrays."""
        return tuple(cable["name"] for cable in self.manipulator["cable"])

    @property
    def length(self) -> float:
        """Straight length from the base disk's distal face to the tip's, m."""
        disk = self.manipulator["disk"]["thickness_m"]
        return sum(segment["plates"] * (segment["length_m"] + disk) for segment in self.manipulator["segment"])

    @property
    def friction(self) -> float:
        """Friction coefficient of the holes that the nominal manipulator states; the rig's own may be another."""
        return self.manipulator["friction"]["coefficient"]

    @property
    def follows_path(self) -> bool:
        """Whether friction follows the load path, so that a tension matters to all later steps."""
        return self.manipulator["friction"].get("direction", "declared") == "history"

    @property
    def pull(self) -> float:
        """Largest noted tension of any cable at any step of the program, N."""
        return max(step[f"cable_{name}_n"] for steps in self.program for step in steps for name in self.cables)

    @property
    def image_centre(self) -> tuple[float, float]:
        """Centre of the camera's image: half-way along the straight arm, m."""
        return (self.length / 2, 0.0)

    @property
    def loading_only(self) -> tuple[int, ...]:
        """Numbers of the sequences in which no tension ever falls."""
        names = [f"cable_{name}_n" for name in self.cables]
        rising = [all(b[n] >= a[n] for a, b in pairwise(s) for n in names) for s in self.program]
        return tuple(k for k, on in enumerate(rising) if on)

    def deviation(self, kind: Kind) -> float:
        """Stated standard deviation of a reading of a kind, m or rad."""
        return self.measurement["position_sd_m" if kind.is_position else "angle_sd_rad"]

    def described(self) -> dict[str, Any]:
        """The design as a row of the report; nothing in it tells what is concealed."""
        return {
            "design": self.number,
            "flavour": str(self.flavour),
            "segments": len(self.manipulator["segment"]),
            "plates": self.plates,
            "cables": len(self.cables),
            "sequences": len(self.program),
            "steps": sum(len(steps) for steps in self.program),
            "read": ", ".join(kind.name.lower() for kind in self.kinds),
            "friction": self.friction,
            "largest_bend_rad": self.largest_bend,
        }


def followed(manipulator: Mapping[str, Any], program: Sequence[LoadSteps]) -> list[RigStates] | None:
    """The rig's states along each sequence of a program; None where a step has no equilibrium."""
    out, before = list[RigStates](), 0
    for steps in program:
        states = simulate(manipulator, steps, before=before)
        if not states.converged.all():
            return None
        out.append(states)
        before += len(steps)
    return out


def plate_bends(states: Sequence[RigStates]) -> np.ndarray:
    """(steps, plates) bend of each plate, rad: the difference of its two disks' angles, sequence after sequence."""
    return np.concatenate([np.diff(part.angle, axis=1) for part in states])


def largest_bend(states: Sequence[RigStates]) -> float:
    """Largest bend of any plate at any step, to either side, rad."""
    return float(np.abs(plate_bends(states)).max())
