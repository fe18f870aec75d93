"""Suspects among the sections: plates of a superelastic material, with a stress plateau and flag-shaped loops.

A rectangular section bends alike to both sides, so that what tension and compression have each for themselves shows in
the shape of one knee alone.  The parameters of the material therefore have narrow priors; with wide ones the effect
could never be told from the bending law `smooth` of `nonlinear_plate`, which imitates every such section.
"""

import numpy as np

from prb3r.diagnosis.library.bending import NEEDS_FIBRE
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import OF_THE_MATERIAL, Occurrence, Suspect, as_it_is, effect_in_words, rare
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator

PLATEAU = Free("plateau_strain", 0.008, 0.004, 0.016, log=True, sd=0.22)
"""Strain at which the plateau begins, with the prior of nitinol.

The plateau begins at 400 to 500 MPa where Young's modulus is 40 to 75 GPa (body temperature; Pelton, DiCello and
Miyazaki, Min. Invasive Ther. Allied Technol. 9 (2000) 107): a strain of 0.53 to 1.25 %, two standard deviations to
either side of 0.8 %; the bounds are half and twice that.
"""
COMPRESSION = Free("compression_ratio", 1.4, 1.0, 2.0, log=True, sd=0.07)
"""Plateau stress in compression over that in tension: 1.2 to 1.6 (sources:
`prb3r.model.effects.sections.COMPRESSION_RATIO`), two standard deviations to either side."""
SLOPE = Free("plateau_slope", 0.045, 0.01, 0.2, log=True, sd=0.4)
"""Slope of the plateau over Young's modulus: 2 to 10 % in nitinol, the steeper in compression, two standard deviations
to either side."""

REVERSE = Free("reverse_ratio", 0.5, 0.1, 0.95, log=True, sd=0.4)
"""Lower over upper plateau stress: 0.3 to 0.7 of nitinol at room and body temperature (Pelton, DiCello and Miyazaki,
cited above; Duerig, Pelton and Stoeckel, Mater. Sci. Eng. A 273 (1999) 149), mostly within a standard deviation of
half.  Bounds: up to 0.95, a thin loop, and down to a tenth, where plates hardly come back."""


def _plateaus(scope: Scope) -> list[Place]:
    """The whole rig where plates may be superelastic and reach their plateau, else no place.

    That takes a stated thickness of every plate, a stated modulus of such a material, and strains beyond the lowest
    plateau.
    """
    known = all(segment.thickness_m is not None for segment in scope.manipulator.segment)
    return whole_rig_if(known and _may_be_superelastic(scope) and scope.strain > PLATEAU.low)


def _loops(scope: Scope) -> list[Place]:
    """The whole rig where the stated modulus is that of a superelastic material and some plate bends back, else no
    place."""
    return whole_rig_if(_may_be_superelastic(scope) and scope.unloads)


def _may_be_superelastic(scope: Scope) -> bool:
    """Whether the stated modulus is that of a superelastic material."""
    return scope.manipulator.youngs_modulus_pa < scope.settings.stiffest_superelastic_pa


def _said_of_flags(fitted: Occurrence) -> str:
    return (
        f"The plates give back less than they took, as superelastic ones do: let go, they yield back at {fitted.size} "
        "of the moment at which they yielded, and come back straight."
    )


def _material(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `superelastic_plate`: the same for every recording, as they belong to the material."""
    return PLATEAU, COMPRESSION, SLOPE


def _plateau_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Starting values: of the plateau strains to be tried those that some plate exceeds, or else the lowest that is
    allowed, each with usual values of compression and slope."""
    passed = [strain for strain in scope.settings.plateau_strains_tried if strain < scope.strain] or [PLATEAU.low]
    return tuple((strain, COMPRESSION.null, SLOPE.null) for strain in passed)


def _said_of_plateau(fitted: Occurrence) -> str:
    slope, ratio = fitted.estimates["plateau_slope"].times(100), fitted.estimates["compression_ratio"]
    return (
        f"The plates are superelastic, as nitinol is: beyond a strain of {fitted.size.times(100)} % in tension, and "
        f"{ratio} times that in compression, their stress reaches a plateau that rises by {slope} % of Young's modulus."
    )


def _as_material(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """The effect as it is, whatever the sections of `there` are, or the reason why it cannot be carried over: it needs
    all outer fibres."""
    if np.isfinite(there.outer_fibre).all():
        return effect
    return f"{effect_in_words(effect)}, which {NEEDS_FIBRE}"


SECTION_SUSPECTS = (
    Suspect(
        "superelastic_plate",
        _said_of_plateau,
        _as_material,
        places=_plateaus,
        free=_material,
        probes=_plateau_probes,
        shared=OF_THE_MATERIAL,
        presence=rare,
    ),
    Suspect(
        "flag_hysteresis",
        _said_of_flags,
        as_it_is,
        places=_loops,
        free=lambda scope, place: (REVERSE,),
        probes=lambda scope, place: ((0.4,), (0.7,)),
        shared=OF_THE_MATERIAL,
        presence=lambda settings: settings.flag_presence,
    ),
)
