"""Plates whose section is followed through the plateaus of its material, by closed forms and a table of curvatures."""

from dataclasses import replace

import numpy as np

from prb3r.proof.rig.arrays import SECTION_LAW
from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.bending import BENT_TOWARD
from prb3r.proof.rig.effects.record import FROM_ZERO, POSITIVE, Record, Scale, number_in, one_of, size
from prb3r.proof.rig.section import Material, notched_tube, rectangle, section_table

TUBE = "tube_outer_m", "tube_inner_m", "notch_depth_m"


def _plateau(
    draft: Draft,
    plateau_stress_pa=None,
    plateau_strain=None,
    compression_ratio=1.5,
    plateau_slope=0.02,
    notch_side=None,
    **tube,
):
    """A section of tension and compression plateaus; every plate its own table."""
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
    if tube:
        outlines = [notched_tube(tube["tube_outer_m"], tube["tube_inner_m"], tube["notch_depth_m"], cut)]
    else:
        outlines = [rectangle(fibre) for fibre in draft.fibre]
    draft.law = SECTION_LAW
    draft.law_table = np.array([[section_table(each, material, side) for side in (-1, 1)] for each in outlines])


SECTION_RECORDS = (
    Record(
        "superelastic_plate",  # no design that is drawn is of nitinol: its plates are strained by 0.3 % at most
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
        once=True,
        excludes=frozenset({"nonlinear_plate", "hysteretic_plate"}),
    ),
)
