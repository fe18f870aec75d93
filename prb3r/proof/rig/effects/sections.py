"""The effect `superelastic_plate`: bending of sections whose material has stress plateaus, by a table of curvatures."""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from prb3r.proof.rig.arrays import SECTION_LAW
from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.bending import BENT_TOWARD
from prb3r.proof.rig.effects.candidate import Candidate, Conditions
from prb3r.proof.rig.effects.record import FROM_ZERO, POSITIVE, Record, Scale, number_in, one_of, size
from prb3r.proof.rig.section import Material, notched_tube, rectangle, section_table

PLATEAU_PA = 4e8, 5e8
"""Least and largest stress at which the plateau of nitinol begins in tension, Pa, at body temperature (Pelton, DiCello
and Miyazaki, Min. Invasive Ther. Allied Technol. 9 (2000) 107)."""
COMPRESSION_RANGE = 1.2, 1.6
"""Least and largest ratio of its plateau stress in compression to that in tension (Liu, Xie, Van Humbeeck and Delaey,
Acta Mater. 46 (1998) 4325; Gall, Sehitoglu, Chumlyakov and Kireeva, Acta Mater. 47 (1999) 1203)."""
SLOPE_RANGE = 0.02, 0.1
"""Least and largest slope of its plateaus over Young's modulus: 0.02 is 60 MPa over 5 % of strain at 60 GPa;
the steeper ones are those of compression.  The ends are a choice."""
NITINOL_PA = 8.3e10
"""Largest Young's modulus of nitinol, Pa: that of its austenite; martensite has about a third."""
BEYOND = 1.3
"""Ratio to the plateau strain that the largest strain of an elastic plate must reach for the effect to be concealed: a
rectangle gives way by a tenth then, and by half at 1.6."""
TUBE = "tube_outer_m", "tube_inner_m", "notch_depth_m"
"""Parameters of a notched tube, of which a file gives all or none."""


def _plateau(
    draft: Draft,
    plateau_stress_pa=None,
    plateau_strain=None,
    compression_ratio=1.5,
    plateau_slope=0.02,
    notch_side=None,
    **tube,
):
    """Give all plates the bending law of a section with plateaus: a table for each rectangle, one for all tubes.

    Raises ValueError for parameters that do not go together.
    """
    if (plateau_stress_pa is None) == (plateau_strain is None):
        raise ValueError("a superelastic plate takes either plateau_stress_pa or plateau_strain")
    if len(tube) not in (0, 3) or (notch_side and not tube):
        raise ValueError(f"a tube takes {', '.join(TUBE)} together")
    if not tube and np.isnan(draft.fibre).any():
        raise ValueError("a superelastic plate needs the outer fibre of every plate, or a tube")
    if tube and not max(tube["tube_inner_m"], tube["notch_depth_m"]) < tube["tube_outer_m"]:
        raise ValueError("tube_inner_m and notch_depth_m must be less than tube_outer_m")
    strain = plateau_stress_pa / draft.modulus if plateau_strain is None else plateau_strain
    material = Material(strain, compression_ratio * strain, plateau_slope)
    cut = -1 if notch_side == "negative" else 1
    draft.law = SECTION_LAW
    if tube:
        draft.law_table = _tube_table(material, tube["tube_outer_m"], tube["tube_inner_m"], tube["notch_depth_m"], cut)
    else:
        draft.law_table = (
            _rectangle_table(material)
            / np.stack([draft.fibre, draft.fibre, np.ones(len(draft.arc))], -1)[:, None, None]
        )


@lru_cache(maxsize=64)
def _rectangle_table(material: Material) -> np.ndarray:
    """(1, 2, ROWS, 3) table (see `Rig.law_table`) of rectangles whose outermost fibre is 1 m from the middle.

    For another distance, M / EI and the curvature are divided by it.
    """
    return np.array([[section_table(rectangle(1.0), material, side) for side in (-1, 1)]])


@lru_cache(maxsize=64)
def _tube_table(material: Material, outer: float, inner: float, depth: float, cut: int) -> np.ndarray:
    """(1, 2, ROWS, 3) moments over EI, curvatures (1/m) and their derivatives, for either side; all plates share them.
    `outer`, `inner` and `depth` (of the notch) in m, `cut` 1 or -1 the side that is notched."""
    outline = notched_tube(outer, inner, depth, cut)
    return np.array([[section_table(outline, material, side) for side in (-1, 1)]])


def _nitinol(given: Conditions) -> Iterator[Candidate]:
    """Plates of nitinol, if their Young's modulus may be that of nitinol and they bend beyond its plateau."""
    if given.modulus <= NITINOL_PA and _reached(given) > PLATEAU_PA[0]:
        yield _of_material(given, PLATEAU_PA[0], COMPRESSION_RANGE[0], SLOPE_RANGE[0])


def _reached(given: Conditions) -> float:
    """Highest plateau stress that plates exceed by the factor `BEYOND`, Pa."""
    return given.curvature * given.fibre * given.modulus / BEYOND


def _of_material(given: Conditions, plateau: float, compression: float, slope: float) -> Candidate:
    """Plates of a material whose plateau begins at the stress `plateau` (Pa), given as strain; there is no size."""
    shape = plateau / given.modulus, compression, slope
    law = dict(zip(("plateau_strain", "compression_ratio", "plateau_slope"), shape, strict=True))
    return Candidate((), lambda _: law, shape=shape)


def _nitinol_anew(given: Conditions, form: Candidate, rng: np.random.Generator) -> Candidate:
    """Plates of nitinol with plateau stress, compression ratio and slope drawn at random."""
    plateau = PLATEAU_PA[0], min(PLATEAU_PA[1], _reached(given))
    return _of_material(given, *(rng.uniform(*ends) for ends in (plateau, COMPRESSION_RANGE, SLOPE_RANGE)))


SECTION_RECORDS = (
    Record(
        "superelastic_plate",
        _plateau,
        (
            size("plateau_stress_pa", POSITIVE, Scale.LOGARITHM, optional=True),
            size("plateau_strain", POSITIVE, Scale.LOGARITHM, optional=True),
            size("compression_ratio", number_in(1, 3), Scale.LOGARITHM, optional=True),
            size("plateau_slope", number_in(0, 0.5), optional=True),
            size("tube_outer_m", POSITIVE, optional=True),
            size("tube_inner_m", FROM_ZERO, optional=True),
            size("notch_depth_m", FROM_ZERO, optional=True),
            replace(one_of("notch_side", BENT_TOWARD), optional=True),
        ),
        _nitinol,
        rare=True,
        once=True,
        excludes=frozenset({"nonlinear_plate", "hysteretic_plate"}),
        reshaped=_nitinol_anew,
        of_the_kind=True,
    ),
)
