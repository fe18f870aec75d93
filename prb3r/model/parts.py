"""The parts of a manipulator as its designer describes them: disks, friction, segments of plates, cables."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue

from prb3r.model.files.docstrings import field_docstrings
from prb3r.model.files.plausible import (
    ClampLength,
    Coefficient,
    DiskThickness,
    Length,
    Mass,
    Offset,
    Stiffness,
    Thickness,
)

MAX_PLATES = 100_000


class Strict(BaseModel):
    """What every part of a file is: frozen, with unknown keys as errors; docstrings describe the fields in schemas."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    def __setattr__(self, name: str, value: Any) -> None:
        """Refused: parts are checked once and stay as they are."""
        how = 'Manipulator.replace gives a changed copy, such as .replace("segment.1.thickness_m", 1e-3)'
        raise AttributeError(f"{name} of a {type(self).__name__} is not set in place; {how}")

    @classmethod
    def __get_pydantic_json_schema__(cls, core: Any, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        schema = handler(core)
        properties, said = handler.resolve_ref_schema(schema).get("properties", {}), field_docstrings(cls)
        for name in said.keys() & cls.model_fields.keys():
            properties[cls.model_fields[name].alias or name].setdefault("description", said[name])
        return schema


class Disk(Strict):
    """The disks of a manipulator, which are all alike.

    Examples
    --------
    >>> import prb3r
    >>> prb3r.Disk(thickness_m=0.004)
    Disk(thickness_m=0.004, mass_kg=0.0, tip_mass_kg=0.0)
    """

    thickness_m: DiskThickness
    """Thickness of a disk along the manipulator, m; it adds to the length, and holes lie in its two faces."""
    mass_kg: Mass = 0.0
    """Mass of a disk with its clamps, kg, and with its share of the plates where these have no plate_mass_kg; used only
    where a gravity effect is present."""
    tip_mass_kg: Mass = 0.0
    """Mass that the last disk carries besides, such as a gripper or a camera, kg; used as mass_kg is."""


class Friction(Strict):
    """Belt friction between the cables and the holes of the disks they pass."""

    coefficient: Coefficient = 0.0
    """Friction force over normal force between cable and hole; 0: nothing rubs."""
    direction: Literal["declared", "history"] = "declared"
    """Direction of slip: as each step declares, or (history) from the cables' own travel along the load path."""
    presliding_m: Annotated[float, Field(ge=1e-7, le=0.1)] = 3e-5
    """With direction = "history": travel of a cable over which friction builds up, m."""
    wrap: Literal["net", "edges"] = "net"
    """Turning that rubs at a disk: between the spans before and behind it, or at each edge of its holes."""


class Segment(Strict):
    """Plates of one kind in a row, each between two disks.

    Examples
    --------
    >>> import prb3r
    >>> prb3r.Segment(plates=7, length_m=0.030, clamp_m=0.008, width_m=0.030, thickness_m=0.0008).plates
    7
    """

    plates: Annotated[int, Field(ge=1, le=MAX_PLATES)]
    """Number of plates, and of the disks at their far ends."""
    length_m: Length
    """Length of one plate from disk to disk, its clamps included, m; not that of the segment."""
    clamp_m: ClampLength = 0.0
    """Rigid length at each of the two ends of a plate, m."""
    width_m: Length | None = None
    """Width of a plate, out of the plane that it bends in, m."""
    thickness_m: Thickness | None = None
    """Thickness of a plate in the plane that it bends in, m."""
    bending_stiffness_n_m2: Stiffness | None = None
    """Instead of width and thickness: bending stiffness EI of a plate, N m^2."""
    outer_fibre_m: Thickness | None = None
    """With bending_stiffness_n_m2: distance of the outermost fibre from the neutral axis, m, for strain and stress."""
    plate_mass_kg: Mass = 0.0
    """Mass of one plate, kg, half of which hangs on the disk at either end; used only where a gravity effect is
    present."""

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
    """A cable, from the base through every disk to the last one of the segment it drives.

    Examples
    --------
    >>> import prb3r
    >>> prb3r.Cable(name="1", offset_m=0.0255, ends_at_segment=2)
    Cable(name='1', offset_m=0.0255, ends_at_segment=2)
    """

    name: Annotated[str, Field(min_length=1)]
    """Any text; the columns of its loads are `cable_<name>_n` and `slip_<name>`."""
    offset_m: Offset
    """Signed distance of its holes from the axis, m; a list gives one for each segment up to the last it drives."""
    ends_at_segment: Annotated[int, Field(ge=1)]
    """The segment, counted from 1 at the base, at whose last disk the cable ends."""

    @model_validator(mode="after")
    def _one_offset_each(self) -> "Cable":
        if isinstance(self.offset_m, list) and len(self.offset_m) != self.ends_at_segment:
            raise ValueError(
                f"offset_m lists {len(self.offset_m)} numbers but cable {self.name!r} ends at segment "
                f"{self.ends_at_segment} (ends_at_segment): give one number for each segment up to the last that it "
                "drives, or a single one"
            )
        return self

    def offset(self, segment: int) -> float:
        """Offset over the plates of `segment` (counted from 0), m; 0 beyond the cable's end."""
        if not isinstance(self.offset_m, list):
            return self.offset_m if segment < self.ends_at_segment else 0.0
        return self.offset_m[segment] if segment < self.ends_at_segment else 0.0
