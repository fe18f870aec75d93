"""A manipulator as its designer describes it, and its translation into a chain."""

from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from prb3r.errors import did_you_mean
from prb3r.mechanics.chain import Chain
from prb3r.mechanics.plate import plate_model
from prb3r.model.effects import AnyEffect, with_effects
from prb3r.model.files.numbers import NonNegative, Positive
from prb3r.model.files.toml import read_toml

ModelName = Literal["prb3r", "elastica", "constant-curvature"]
MAX_PLATES = 100_000


class Strict(BaseModel):
    """What every part of a file is: frozen, with unknown keys as errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Disk(Strict):
    """The disks of a manipulator, which are all alike."""

    thickness_m: NonNegative
    mass_kg: NonNegative = 0.0
    """Disk, clamp and its share of the plate; used only when gravity acts in the plane."""


class Friction(Strict):
    """Belt friction between the cables and the holes of the disks they pass."""

    coefficient: NonNegative = 0.0
    direction: Literal["declared", "history"] = "declared"
    """Of slip: as each step declares, or from the cables' own travel along the load path."""
    presliding_m: Annotated[float, Field(ge=1e-7, le=0.1)] = 3e-5
    """Travel over which friction builds up, for `history`."""
    wrap: Literal["net", "edges"] = "net"
    """Turning that rubs at a disk: between the spans before and behind it, or at each edge of its holes."""


class Segment(Strict):
    """Plates of one kind in a row, each between two disks."""

    plates: Annotated[int, Field(ge=1, le=MAX_PLATES)]
    length_m: Positive
    clamp_m: NonNegative = 0.0
    width_m: Positive | None = None
    thickness_m: Positive | None = None
    bending_stiffness_n_m2: Positive | None = None
    outer_fibre_m: Positive | None = None

    @model_validator(mode="after")
    def _consistent(self) -> "Segment":
        if 2 * self.clamp_m >= self.length_m:
            raise ValueError(
                f"clamps of {self.clamp_m:g} m at both ends leave nothing of a plate of {self.length_m:g} m to bend; "
                "clamp_m must be less than half of length_m"
            )
        dimensions = self.width_m is not None, self.thickness_m is not None
        if self.bending_stiffness_n_m2 is None and not all(dimensions):
            raise ValueError("give either width_m and thickness_m, or bending_stiffness_n_m2")
        if self.bending_stiffness_n_m2 is not None and any(dimensions):
            raise ValueError("width_m, thickness_m and bending_stiffness_n_m2 exclude each other: give one description")
        if self.outer_fibre_m is not None and self.bending_stiffness_n_m2 is None:
            raise ValueError("outer_fibre_m goes with bending_stiffness_n_m2; a plate of thickness_m has half of it")
        return self

    def bending_stiffness(self, youngs_modulus_pa: float) -> float:
        """EI of one plate, N m^2 [Eq. 17]."""
        if self.width_m is None or self.thickness_m is None:
            return self.bending_stiffness_n_m2 or np.nan  # one of both is given
        return youngs_modulus_pa * self.width_m * self.thickness_m**3 / 12

    @property
    def outer_fibre(self) -> float:
        """Distance of the outermost fibre from the neutral axis, m; NaN where it is not known."""
        if self.thickness_m is not None:
            return self.thickness_m / 2
        return self.outer_fibre_m or np.nan


class Cable(Strict):
    """A cable, from the base through every disk to the last one of the segment it drives."""

    name: Annotated[str, Field(min_length=1)]
    offset_m: float | list[float]
    ends_at_segment: Annotated[int, Field(ge=1)]

    @model_validator(mode="after")
    def _one_offset_each(self) -> "Cable":
        if isinstance(self.offset_m, list) and len(self.offset_m) != self.ends_at_segment:
            raise ValueError(
                f"offset_m lists {len(self.offset_m)} numbers but cable {self.name!r} ends at segment "
                f"{self.ends_at_segment}: give one number for each segment up to there, or a single one"
            )
        return self

    def offset(self, segment: int) -> float:
        """Offset over the plates of `segment` (counted from 0), m; 0 beyond the cable's end."""
        if not isinstance(self.offset_m, list):
            return self.offset_m if segment < self.ends_at_segment else 0.0
        return self.offset_m[segment] if segment < self.ends_at_segment else 0.0


class Manipulator(Strict):
    """A planar manipulator of one or several segments in a row; see the contract of the file format in the README."""

    name: str
    youngs_modulus_pa: Positive
    gravity_m_s2: Positive = 9.80665
    yield_stress_pa: Positive | None = None
    model: ModelName = "prb3r"
    hinges: Literal["chen", "su", "one", "howell"] = "chen"
    disk: Disk
    friction: Friction = Friction()
    segment: Annotated[list[Segment], Field(min_length=1)]
    cable: list[Cable] = []
    effect: list[AnyEffect] = []
    """Extra physics, each a switch."""

    @model_validator(mode="after")
    def _consistent(self) -> "Manipulator":
        problems = []
        names = [cable.name for cable in self.cable]
        for name in dict.fromkeys(names):
            if names.count(name) > 1:
                problems.append(f"{names.count(name)} cables are named {name!r}; names must differ")
        for cable in self.cable:
            if cable.ends_at_segment > len(self.segment):
                problems.append(
                    f"cable {cable.name!r} ends at segment {cable.ends_at_segment}, but there are only "
                    f"{len(self.segment)}"
                )
        if self.model == "constant-curvature" and self.follows_history:
            problems.append("friction.direction = 'history' needs the model 'prb3r' or 'elastica'")
        if sum(segment.plates for segment in self.segment) > MAX_PLATES:
            problems.append(f"more than {MAX_PLATES} plates")
        problems += [problem for effect in self.effect for problem in effect.problems(self)]
        if problems:
            raise ValueError("; ".join(problems))
        return self

    @property
    def follows_history(self) -> bool:
        """Whether slip follows from the load path, so that what steps declare is ignored."""
        return self.friction.direction == "history" or any(effect.follows_history for effect in self.effect)

    @property
    def plates(self) -> int:
        """Number of plates of all segments together."""
        return sum(segment.plates for segment in self.segment)

    @property
    def cable_names(self) -> list[str]:
        """Names of the cables in the order of the file, which is that of all arrays."""
        return [cable.name for cable in self.cable]

    @cached_property
    def segment_ends(self) -> list[int]:
        """Number of the last disk of each segment."""
        return np.cumsum([segment.plates for segment in self.segment]).tolist()

    def per_plate(self, values: Iterable[float]) -> np.ndarray:
        """(plates,) one value for each segment, repeated for its plates."""
        return np.repeat(np.asarray(list(values), float), [segment.plates for segment in self.segment])

    @property
    def bending_stiffness(self) -> np.ndarray:
        """(plates,) bending stiffness EI of every plate, N m^2 [Eq. 17]."""
        return self.per_plate(segment.bending_stiffness(self.youngs_modulus_pa) for segment in self.segment)

    @property
    def outer_fibre(self) -> np.ndarray:
        """(plates,) distance of the outermost fibre from the neutral axis, m; NaN where it is not known."""
        return self.per_plate(segment.outer_fibre for segment in self.segment)

    def cable_arm(self, side: int) -> np.ndarray:
        """(plates,) largest offset of a cable toward positive (`side` 1) or negative offsets (-1), m; 0 without any."""
        arms = [self.per_plate(side * cable.offset(k) for k in range(len(self.segment))) for cable in self.cable]
        return np.maximum.reduce([np.zeros(self.plates), *arms])

    def chain(self, broken: Iterable[str] = ()) -> Chain:
        """The mechanical problem, effects included; `broken` names cables that carry nothing.

        Raises
        ------
        ValueError
            For a broken cable that does not exist.
        """
        return with_effects(self.plain_chain(broken), self, self.effect)

    def plain_chain(self, broken: Iterable[str] = ()) -> Chain:
        """The mechanical problem as :meth:`chain` gives it, but without any effect."""
        broken = set(broken)
        for name in sorted(broken.difference(self.cable_names)):
            raise ValueError(f"there is no cable {name!r} to break{did_you_mean(name, self.cable_names)}")
        model = plate_model(self.model, self.hinges)
        clamp = self.per_plate(segment.clamp_m for segment in self.segment)
        arc = self.per_plate(segment.length_m for segment in self.segment) - 2 * clamp
        stiffness = (self.bending_stiffness / arc)[:, None] * model.stiffness
        segment = self.per_plate(range(len(self.segment))).astype(np.int64)
        offset = [self.per_plate(cable.offset(k) for k in range(len(self.segment))) for cable in self.cable]
        reach = [0 if cable.name in broken else self.segment_ends[cable.ends_at_segment - 1] for cable in self.cable]
        shape = self.plates, len(self.cable)
        return Chain(
            plate=model,
            arc=arc,
            clamp=clamp,
            disk=self.disk.thickness_m,
            stiffness=stiffness,
            rest=np.zeros_like(stiffness),
            offset=np.array(offset, float).T.reshape(shape).copy(),
            reach=np.array(reach, np.int64),
            friction=np.full(shape, self.friction.coefficient),
            segment=segment,
            tied=self.model == "constant-curvature",
            presliding=self.friction.presliding_m if self.friction.direction == "history" else 0.0,
            edges=self.friction.wrap == "edges",
        )


def load_manipulator(path: str | Path) -> Manipulator:
    """Read a manipulator file.

    Raises
    ------
    SpecError
        With every problem of the file and its line.
    """
    return read_toml(path, Manipulator)
