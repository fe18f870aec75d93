"""Suspects among the plates: their stiffness, bending law and rest curvature, contact of disks and notches, their
clamps, and the bending stiffness of cables."""

from collections.abc import Iterator

import numpy as np

from prb3r.diagnosis.library.alike import same_parts
from prb3r.diagnosis.library.bending import (
    as_strain,
    law_free,
    law_places,
    law_probes,
    loop_free,
    loop_places,
    loop_probes,
    loops_as_strain,
    said_of_law,
    said_of_loops,
)
from prb3r.diagnosis.library.contact import (
    closing_elsewhere,
    closing_free,
    closing_places,
    closing_probes,
    contact_elsewhere,
    contact_free,
    contact_probes,
    said_of_closing,
    said_of_contact,
)
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.relaxing import at_pace, relaxing_free, relaxing_places, relaxing_probes, said_of_relaxing
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import (
    OF_A_PART,
    OF_THE_COURSE,
    OF_THE_MATERIAL,
    OF_THE_SETUP,
    Occurrence,
    Shared,
    Suspect,
    as_it_is,
    effect_in_words,
    left_behind,
    rare,
)
from prb3r.diagnosis.library.totals import rest_of_plates, stiffness_of_plates
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator

OWN_SHAPE = "belongs to the plates of this rig, as they were made or bent"
"""Why rest curvature is left behind, to follow "which"."""


def _factor(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter `factor` on a stiffness: from a twentieth, a plate cracked nearly through, to twentyfold, one 2.7
    times as thick; prior sd 0.5 of its logarithm, so mostly within a factor of 1.7."""
    return (Free("factor", 1.0, 0.05, 20.0, log=True, sd=0.5),)


def _factor_of_one(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter `factor` on the stiffness of a single plate, between the bounds of `_factor`; prior sd 0.4 of the
    factor itself, not of its logarithm: plates crack and clamps come loose, nearly through and off, but nothing makes
    one plate of several, cut from one stock, twice as stiff except a wrong one in its place."""
    return (Free("factor", 1.0, 0.05, 20.0, sd=0.4),)


def _taper(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `stiffness_gradient`: from a fifth to fivefold, as of a strip whose thickness tapers by a
    factor of 1.7; prior sd 0.25 of its logarithm."""
    return (Free("tip_to_base", 1.0, 0.2, 5.0, log=True, sd=0.25),)


def _taper_sentence(fitted: Occurrence) -> str:
    less = "softer" if fitted.size.value < 1 else "stiffer"
    return (
        f"The plates become {less} and {less} from the base to the tip, as of an arm that tapers: the last one has "
        f"{fitted.size} times the stiffness that the first one suggests."
    )


def _bent_plates(scope: Scope) -> Iterator[Place]:
    """Places of `precurvature`: all plates, the plates of each segment, each plate alone."""
    yield {}
    yield from ({"plates": plates} for _, plates in scope.segments)
    if scope.chain.plates > 1:
        yield from ({"plates": (plate,)} for plate in scope.plates)


def _rest(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `precurvature`: up to the largest curvature under load either way, prior sd a fifth of it; what
    is bent more at rest is seen by eye."""
    k = scope.curvature
    return (Free("curvature_per_m", 0.0, -k, k, scale=k, sd=0.2),)


def _rest_sentence(fitted: Occurrence) -> str:
    plates = fitted.place.get("plates")
    which = "All plates are"
    if plates:
        which = f"Plate {plates[0]} is" if len(plates) == 1 else f"Plates {plates[0]} to {plates[-1]} are"
    return f"{which} bent before any load: stress-free curvature {fitted.size} 1/m{fitted.with_others(' 1/m')}."


def _steady_change(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `precurvature_gradient`: from end to end twice as much as `precurvature` may be, prior sd as
    there."""
    k = scope.curvature
    return (Free("change_per_m", 0.0, -2 * k, 2 * k, scale=k, sd=0.2),)


def _steady_sentence(fitted: Occurrence) -> str:
    return (
        "Before any load the plates are bent otherwise along the arm, as of one that was wound up or has taken a set: "
        f"from the first to the last their stress-free curvature changes steadily, by {fitted.size} 1/m in all."
    )


def _with_the_same_clamps(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """The effect, where clamps are as long on both manipulators and, as far as both files tell it, as wide; else the
    reason why it is left behind."""
    wide = all(segment.width_m is not None for rig in (here, there) for segment in rig.segment)
    known, other = (
        [(segment.clamp_m, segment.width_m if wide else None) for segment in rig.segment] for rig in (here, there)
    )
    if same_parts(known, other):
        return effect
    return f"{effect_in_words(effect)}, which belongs to the clamps, and these differ"


def _hinge(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `clamp_compliance`, in units of the compliance of a plate's mean node: prior sd 1, up to 10.  A
    millionth stands for a rigid clamp, as a compliance is above zero."""
    return (_compliance(scope, sd=1.0),)


def _base_hinge(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `base_compliance`, in the unit of `_hinge`: prior sd 3, up to 30, as the one clamp in the base
    may well give way as much as a whole plate, which makes four."""
    return (_compliance(scope, sd=3.0),)


def _compliance(scope: Scope, sd: float) -> Free:
    """A compliance with a prior of so many units, up to ten times as far."""
    soft = float(np.median(scope.chain.arc / scope.mean_node_rigidity))
    return Free("compliance_rad_per_n_m", 1e-6 * soft, 1e-6 * soft, 10 * sd * soft, scale=soft, sd=sd, pole=True)


def _share(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `plate_softening`: over the whole recording up to half of the stiffness, lost or gained, prior
    sd 5 %; more is seen between two sequences."""
    step = 1 / scope.elapsed
    return (Free("share_per_step", 0.0, -0.5 * step, 0.5 * step, scale=step, sd=0.05),)


def _softening_sentence(fitted: Occurrence) -> str:
    percent = fitted.size.times(100)
    if percent.value < 0:
        return f"The plates gain {percent.less(0.0)} % of their stiffness with every step: they cool down or harden."
    return f"The plates lose {percent} % of their stiffness with every step: they warm up, creep or wear."


def _cable_stiffness(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `cable_bending`, in units of the mean stiffness of a plate's nodes times its arc (4.4 EI on the
    elastica): prior sd 0.3, up to 10, beside which the plates hardly matter."""
    rigid = float(np.median(scope.mean_node_rigidity))
    return (Free("stiffness_n_m2", 0.0, 0.0, 10 * rigid, scale=rigid, sd=0.3),)


PLATE_SUSPECTS = (
    Suspect(
        "weakened_plate",
        sentence=lambda fitted: (
            f"Plate {fitted.place['plate']} bends as if its stiffness were {fitted.size} of nominal"
            f"{fitted.with_others()}: look for "
            + ("a crack, a loose clamp" if fitted.size.value < 1 else "a clamp that holds it shorter")
            + ", a wrong plate."
        ),
        transfer=OF_A_PART,
        places=lambda scope: ({"plate": plate} for plate in scope.plates),
        free=_factor_of_one,
        quantity=stiffness_of_plates,
    ),
    Suspect(
        "segment_stiffness",
        sentence=lambda fitted: (
            f"The plates of segment {fitted.place['segment']} are {fitted.size} times as stiff "
            f"as their sections and the fitted modulus give{fitted.with_others()}."
        ),
        transfer=OF_A_PART,
        places=lambda scope: ({"segment": number} for number, _ in scope.segments),
        free=_factor,
        quantity=stiffness_of_plates,
    ),
    Suspect(
        "stiffness_gradient",
        sentence=_taper_sentence,
        transfer=left_behind("belongs to this arm, as it was made"),
        places=lambda scope: whole_rig_if(scope.chain.plates > 2),  # with two plates, the same as one weakened plate
        free=_taper,
        quantity=stiffness_of_plates,
        presence=rare,
    ),
    Suspect(
        "nonlinear_plate",
        said_of_law,
        as_strain,
        places=law_places,
        free=law_free,
        probes=law_probes,
        shared=OF_THE_MATERIAL,
    ),
    Suspect(
        "hysteretic_plate",
        said_of_loops,
        loops_as_strain,
        places=loop_places,
        free=loop_free,
        probes=loop_probes,
        shared=OF_THE_MATERIAL,
        presence=lambda settings: settings.dissipating_presence,
    ),
    Suspect(
        "precurvature",
        _rest_sentence,
        left_behind(OWN_SHAPE),
        places=_bent_plates,
        free=_rest,
        quantity=rest_of_plates,
    ),
    Suspect(
        "precurvature_gradient",
        _steady_sentence,
        left_behind(OWN_SHAPE),
        places=lambda scope: whole_rig_if(scope.chain.plates > 2),  # with two plates, the same as one bent plate
        free=_steady_change,
        quantity=rest_of_plates,
        presence=rare,
    ),
    Suspect(
        "disk_contact",
        said_of_contact,
        contact_elsewhere,
        free=contact_free,
        probes=contact_probes,
    ),
    Suspect(
        "notch_closing",
        said_of_closing,
        closing_elsewhere,
        places=closing_places,
        free=closing_free,
        probes=closing_probes,
        shared=Shared("material", ("factor",)),  # how hard edges touch depends on their place
    ),
    Suspect(
        "clamp_compliance",
        sentence=lambda fitted: f"The clamps give way: a hinge of {fitted.size} rad/(N m) at each end of every plate.",
        transfer=_with_the_same_clamps,
        free=_hinge,
    ),
    Suspect(
        "base_compliance",
        sentence=lambda fitted: (
            f"The clamp in the base gives way: plate 1 turns in it by {fitted.size} rad/(N m); tighten it."
        ),
        transfer=OF_THE_SETUP,
        places=lambda scope: whole_rig_if(scope.chain.plates > 1),  # with one plate, the same as its clamps
        free=_base_hinge,
        presence=rare,
    ),
    Suspect(
        "plate_softening",
        sentence=_softening_sentence,
        transfer=OF_THE_COURSE,
        places=lambda scope: whole_rig_if(scope.tells_time),
        free=_share,
        presence=rare,
    ),
    Suspect(
        "plate_relaxation",
        sentence=said_of_relaxing,
        transfer=as_it_is,
        places=relaxing_places,
        free=relaxing_free,
        probes=relaxing_probes,
        shared=OF_THE_MATERIAL,
        referred=at_pace,
        presence=rare,
    ),
    Suspect(
        "cable_bending",
        sentence=lambda fitted: f"The cables themselves resist bending, each with {fitted.size} N m².",
        transfer=as_it_is,
        places=lambda scope: whole_rig_if(bool(scope.manipulator.cable_names)),
        free=_cable_stiffness,
    ),
)
