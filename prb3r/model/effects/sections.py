"""Effects of materials that are stressed beyond their elastic range: superelastic sections and flag-shaped loops."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from prb3r.mechanics.chain import Chain
from prb3r.mechanics.plate_law import Hysteresis, Law
from prb3r.model.effects.base import Effect, Host, Side
from prb3r.model.files.numbers import Positive
from prb3r.model.files.plausible import TubeDiameter, TubeSize
from prb3r.model.laws.section import Tube, section_law

COMPRESSION_RATIO = 1.5
"""Plateau stress of nitinol in compression over that in tension: 1.2 to 1.6 (Liu, Xie, Van Humbeeck and Delaey, Acta
Mater. 46 (1998) 4325; Gall, Sehitoglu, Chumlyakov and Kireeva, Acta Mater. 47 (1999) 1203)."""
PLATEAU_SLOPE = 0.02
"""Slope of nitinol's plateau over Young's modulus: some 60 MPa over 5 % of strain at 60 GPa."""
PLATEAU_STRAINS = 1e-4, 0.1
"""Least and largest strain at which the plateau of any metal begins."""


class SuperelasticPlate(Effect):
    """Plates of a superelastic material such as nitinol: beyond the stress `plateau_stress_pa` in tension (or the
    strain `plateau_strain`, that stress over Young's modulus), and `compression_ratio` (absent: 1.5) times it in
    compression, stress grows with `plateau_slope` (absent: 0.02) times Young's modulus alone; the neutral axis is where
    forces balance. Sections are rectangles of twice the outer fibre (the thickness), or all of them those of a tube of
    the diameters `tube_outer_m` and `tube_inner_m` with notches of `notch_depth_m`, cut from the side of positive (or
    negative: `notch_side`) offsets, which bends otherwise to either side. Moments are the section's own, within 0.02 %,
    up to eight plateau strains of the outermost fibre, and grow on from there as they did. What unloading dissipates is
    left to `flag_hysteresis`."""

    kind: Literal["superelastic_plate"]
    once: ClassVar[bool] = True
    instead_of: ClassVar[frozenset[str]] = frozenset({"nonlinear_plate"})
    plateau_stress_pa: Annotated[
        Positive | None, Field(description="Stress in tension at which the plateau begins, Pa.")
    ] = None
    plateau_strain: Annotated[Positive | None, Field(description="Strain in tension at which the plateau begins.")] = (
        None
    )
    compression_ratio: Annotated[
        float | None, Field(ge=1, le=3, description="Plateau stress in compression over that in tension.")
    ] = None
    plateau_slope: Annotated[
        float | None, Field(ge=0, le=0.5, description="Slope of the plateau over Young's modulus.")
    ] = None
    tube_outer_m: Annotated[TubeDiameter | None, Field(description="Outer diameter of the tube, m.")] = None
    tube_inner_m: Annotated[TubeSize | None, Field(description="Inner diameter of the tube, m.")] = None
    notch_depth_m: Annotated[TubeSize | None, Field(description="Depth of the notches, across the tube, m.")] = None
    notch_side: Annotated[Side | None, Field(description="From which side the notches are cut.")] = None

    @model_validator(mode="after")
    def _complete(self) -> SuperelasticPlate:
        if (self.plateau_stress_pa is None) == (self.plateau_strain is None):
            raise ValueError("a superelastic plate takes either plateau_stress_pa or plateau_strain")
        outer, inner, depth = self.tube_outer_m, self.tube_inner_m, self.notch_depth_m
        given = [value is not None for value in (outer, inner, depth)]
        if any(given) != all(given) or (self.notch_side is not None and not all(given)):
            raise ValueError("a tube takes tube_outer_m, tube_inner_m and notch_depth_m (0 without notches) together")
        if outer is not None and inner is not None and depth is not None and not (inner < outer and depth < outer):
            raise ValueError("tube_inner_m and notch_depth_m must be less than tube_outer_m")
        return self

    @property
    def tube(self) -> Tube | None:
        """The notched tube, with its notch on the positive side; None for a rectangular section."""
        if self.tube_outer_m is None:
            return None
        return Tube((self.tube_inner_m or 0) / self.tube_outer_m, (self.notch_depth_m or 0) / self.tube_outer_m)

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        compression = COMPRESSION_RATIO if self.compression_ratio is None else self.compression_ratio
        slope = PLATEAU_SLOPE if self.plateau_slope is None else self.plateau_slope
        law = section_law(self.tube, compression, slope)
        height = 2 * manipulator.outer_fibre if self.tube_outer_m is None else np.full(chain.plates, self.tube_outer_m)
        table = law.table[::-1] if self.notch_side == "negative" else law.table
        return chain._replace(law=Law(knee=(self.strain(manipulator) * law.end / height)[:, None], table=table))

    def strain(self, manipulator: Host) -> float:
        """Strain in tension at which the plateau begins."""
        if self.plateau_strain is not None:
            return self.plateau_strain
        return (self.plateau_stress_pa or np.nan) / manipulator.youngs_modulus_pa

    def problems(self, manipulator: Host) -> Iterator[str]:
        """Messages if the plateau begins at a strain that no metal has, if the outer fibre of a segment is not known
        and no tube is given, or if a tube is given beside width and thickness."""
        yield from super().problems(manipulator)
        low, high = PLATEAU_STRAINS
        if not low <= self.strain(manipulator) <= high:
            yield (
                f"effect {self.kind}: the plateau begins at a strain of {self.strain(manipulator):.3g} by "
                f"youngs_modulus_pa; metals have {low:g} to {high:g}"
            )
        if self.tube_outer_m is None and np.isnan(manipulator.outer_fibre).any():
            yield f"effect {self.kind} needs outer_fibre_m (or thickness_m) of every segment, or a tube"
        if self.tube_outer_m is not None and any(segment.thickness_m is not None for segment in manipulator.segment):
            yield f"effect {self.kind}: a tube goes with bending_stiffness_n_m2, not with width_m and thickness_m"


class FlagHysteresis(Effect):
    """Plates that soften give back less than they took, in the flag-shaped loops of superelastic materials: they follow
    their law f (`nonlinear_plate`, `superelastic_plate`) as they are bent, M = EI f(k), and as they are let go that of
    a material which yields at `reverse_ratio` (r) times the stress, M = r EI f(k / r); between the two they are
    elastic. They come back straight and as new. Where plates do not soften there is no loop."""

    kind: Literal["flag_hysteresis"]
    once: ClassVar[bool] = True
    instead_of: ClassVar[frozenset[str]] = frozenset({"hysteretic_plate"})
    reverse_ratio: Annotated[float, Field(gt=0, le=1)]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(hysteresis=Hysteresis(reverse=self.reverse_ratio))
