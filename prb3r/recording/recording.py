"""A recording in memory: the load steps of every sequence and the readings at each, and the models of its file."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from typing import Annotated, Any, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field

from prb3r.mechanics.chain import Loads
from prb3r.model.files.numbers import NonNegative, Positive
from prb3r.model.manipulator import Manipulator, Segment, Strict
from prb3r.model.steps import pace_of


class Kind(IntEnum):
    """What a number in the table of markers is."""

    X = 0
    Y = 1
    ANGLE = 2
    BEND = 3

    @property
    def column(self) -> str:
        """Name of the column of the table of markers that holds such readings; it ends with their unit."""
        return ("x_m", "y_m", "angle_rad", "bend_rad")[self]

    @property
    def is_position(self) -> bool:
        """Whether it is a coordinate, m; else it is an angle, rad."""
        return self <= Kind.Y


class Measurement(Strict):
    """How exactly was measured: standard deviations of what was read and applied."""

    position_sd_m: Positive | None = None
    angle_sd_rad: Positive | None = None
    """Standard deviation of an angle or a bend as read, rad."""
    tension_sd_relative: NonNegative = 0.0
    """Standard deviation of each applied tension at each step, over the tension."""
    frame_rotation_sd_rad: NonNegative = 0.0
    """Standard deviation of the one rotation of the whole recording, rad; 0: known."""
    frame_position_sd_m: NonNegative = 0.0


class Prior(Strict):
    """Independent knowledge of the calibrated constants: relative standard deviations; absent is flat."""

    youngs_modulus: Positive | None = None
    friction_coefficient: Positive | None = None


class Tolerance(Strict):
    """How exactly the rig was made: standard deviations of its own geometry, the same through a recording."""

    offset_m: NonNegative | None = None
    """Standard deviation of each cable's place, as a whole and at each plate, m; absent: 0.5 % of its offset."""
    length_m: NonNegative | None = None
    """Standard deviation of each plate's length, m; absent: 0.5 % of it."""
    thickness_relative: NonNegative = 0.005
    """Standard deviation of the thickness of plates, by segment and each, over the thickness."""
    marker_m: NonNegative | None = None
    """Standard deviation of a marker's place in its disk's own frame, m; absent: 1 % of the longest plate."""
    marker_rad: NonNegative | None = None
    """Standard deviation of the angle at which a marker sits on its disk, rad; absent: 0.002, or 0 if `marker_m` is
    0."""

    def offset(self, arm: float) -> float:
        """Standard deviation of the place of a cable with an offset of `arm`, m; by itself a share of `arm`."""
        return OWN_SHARE * arm if self.offset_m is None else self.offset_m

    def length(self, segment: Segment) -> float:
        """Standard deviation of the length of each plate of a segment, m; by itself a share of that length."""
        return OWN_SHARE * segment.length_m if self.length_m is None else self.length_m

    def marker(self, segments: Sequence[Segment]) -> float:
        """Standard deviation of a marker in its disk's frame, m; by itself a share of the longest plate."""
        longest = max(segment.length_m for segment in segments)
        return MARKER_SHARE * longest if self.marker_m is None else self.marker_m

    @property
    def marker_turn(self) -> float:
        """Standard deviation of the angle of a marker on its disk, rad."""
        if self.marker_rad is None:
            return 0.0 if self.marker_m == 0 else MARKER_TURN
        return self.marker_rad


class Sharing(Strict):
    """What the rig has in common with those that it is diagnosed together with."""

    material: bool = True
    """Whether its plates are of the same stock: Young's modulus and how it changes with strain."""
    friction: bool = True
    """Whether its cables rub in its holes as theirs do."""
    bench: bool = True
    """Whether it stands on the bench of a recording that predicts it (`--holdout`), mounted alike."""


OWN_SHARE, MARKER_SHARE = 0.005, 0.01
"""Standard deviations where a recording states none, of offsets and lengths, and of marker places in plate lengths.
Choice: a part made by hand, and a marker of the width of a plate's thickness put on by eye."""
MARKER_TURN = 0.002
"""Standard deviation of a marker's angle on its disk where a recording states none, rad.  Choice: 0.1 mm over 50 mm, as
put on with care.  With 0.005 some effects of simulated rigs with perfect markers are no longer found; of 0.01 six
single rest curvatures were told while it was taken for 0."""
FRAME_REACH = 3.0
"""Standard deviations of the camera's frame that it may be off by: more by chance once in 370."""


class RecordingFile(Strict):
    """What the file `recording.toml` says, which describes a recording and names its manipulator."""

    name: Annotated[str, Field(min_length=1)]
    """Any text, for reports."""
    manipulator: Annotated[str, Field(min_length=1)]
    """File of the nominal manipulator, seen from the recording's folder."""
    image_centre_m: tuple[float, float] = (0.0, 0.0)
    measurement: Measurement
    prior: Prior = Prior()
    tolerance: Tolerance = Tolerance()
    sharing: Sharing = Sharing()


class Readings(NamedTuple):
    """The `r` readings of a recording: single numbers that were read at a load step."""

    step: np.ndarray
    """(r,) row of the load step in the recording's table of steps, from 0."""
    disk: np.ndarray
    """(r,) number of the disk; a bend is that of the plate which ends there."""
    kind: np.ndarray
    """(r,) values of :class:`Kind`."""
    value: np.ndarray
    """(r,) value that was read, m or rad."""

    @property
    def count(self) -> int:  # type: ignore[override]
        """Number `r` of readings; each coordinate, angle and bend of a marker is one."""
        return len(self.value)

    @property
    def is_position(self) -> np.ndarray:
        """(r,) whether each reading is a coordinate, m; else it is an angle or a bend, rad."""
        return self.kind <= Kind.Y

    def where(self, chosen: np.ndarray) -> "Readings":
        """The readings that a mask or an array of indices selects."""
        return Readings(*(field[chosen] for field in self))


class SerialNoise(NamedTuple):
    """Share of the variance of the reading noise that lasts from step to step, and over how many."""

    share: float = 0.0
    span: float = np.inf
    """Correlation length, in steps: exp(-steps / span)."""


NO_SERIAL_NOISE = SerialNoise()
"""Noise of which nothing lasts from one step to the next, or nothing is known."""


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """A recording: `s` load steps in one or more sequences, each starting from rest, and their readings."""

    name: str
    manipulator: Manipulator
    """The nominal manipulator, as its file describes it."""
    measurement: Measurement
    prior: Prior
    image_centre_m: tuple[float, float]
    sequences: tuple[str, ...]
    steps: pd.DataFrame
    """The table of steps: `sequence, step` and loads, one row a step, the steps of a sequence together and in order."""
    of_sequence: np.ndarray
    """(s,) index in `sequences` of the sequence of each row of `steps`."""
    loads: Loads
    """Loads of the rows of `steps`."""
    readings: Readings
    tolerance: Tolerance = Tolerance()
    sharing: Sharing = Sharing()
    remarks: tuple[str, ...] = ()
    """Sentences on what was repaired, counted or reinterpreted when the recording was read."""
    serial_noise: SerialNoise = NO_SERIAL_NOISE
    """Noise of the readings of a log that lasts from one step to the next."""
    modulus_of_several: bool = False
    """Whether Young's modulus is that of several rigs (`--together`): the thickness of an only segment as a whole,
    which a rig by itself cannot tell from its modulus, then is a tolerance of its own."""
    as_read: np.ndarray | None = None
    """(s,) row that each step had in the table as read, where steps were left out; absent: none were."""

    def __repr__(self) -> str:
        """Name and numbers of sequences, load steps and readings, on one line."""
        sizes = f"sequences={len(self.sequences)}, steps={len(self.steps)}, readings={self.readings.count}"
        return f"Recording({self.name!r}, {sizes})"

    @cached_property
    def begins(self) -> np.ndarray:
        """(s,) whether each step is the first of its sequence, which starts from rest."""
        return np.concatenate([[True], np.diff(self.of_sequence) != 0])

    @cached_property
    def every_load(self) -> np.ndarray:
        """(s, l) all loads of every step side by side, N: tensions, forces on disks and tip."""
        loads = self.loads
        return np.concatenate([loads.tension, loads.force.reshape(loads.steps, -1), loads.tip], axis=1)

    @cached_property
    def row_as_read(self) -> np.ndarray:
        """(s,) row that each step had in the table as read."""
        return np.arange(len(self.steps)) if self.as_read is None else self.as_read

    @cached_property
    def pace_s(self) -> float | None:
        """Median time from one step of a sequence to the next as read, s; None where no times are known."""
        return pace_of(self.loads.time[:, 0], self.begins, self.row_as_read)

    @cached_property
    def lets_go(self) -> bool:
        """Whether any tension falls from one step of a sequence to the next."""
        return bool((np.diff(self.loads.tension, axis=0)[~self.begins[1:]] < 0).any())

    def only(self, sequences: Iterable[int]) -> "Recording":
        """The recording of the sequences with these indices, in their order in the recording."""
        chosen = sorted(set(sequences))
        part = self.at_steps(np.flatnonzero(np.isin(self.of_sequence, chosen)))
        names = tuple(self.sequences[k] for k in chosen)
        return replace(part, sequences=names, of_sequence=np.searchsorted(chosen, part.of_sequence))

    def at_steps(self, rows: np.ndarray) -> "Recording":
        """The recording with the steps in these rows (k,) alone, which grow; its sequences are all named still."""
        place = np.full(len(self.steps), -1)
        place[rows] = np.arange(len(rows))
        readings = self.readings.where(place[self.readings.step] >= 0)
        return replace(
            self,
            steps=self.steps.iloc[rows].reset_index(drop=True),
            of_sequence=self.of_sequence[rows],
            loads=Loads(*(field[rows] for field in self.loads)),
            readings=readings._replace(step=place[readings.step]),
            as_read=self.row_as_read[rows],
        )

    def with_remark(self, text: str) -> "Recording":
        """A copy with one more remark."""
        return replace(self, remarks=(*self.remarks, text))

    def rows_of(self, part: "Recording") -> np.ndarray:
        """Rows of `steps` that belong to the sequences of `part`, a recording of some of them (:meth:`only`)."""
        return np.flatnonzero(np.isin(self.of_sequence, [self.sequences.index(name) for name in part.sequences]))

    def with_values(self, value: np.ndarray, **changes: Any) -> "Recording":
        """A copy with the values of all readings replaced by `value` (r,), m or rad, and other fields by `changes`."""
        return replace(self, readings=self.readings._replace(value=value), **changes)
