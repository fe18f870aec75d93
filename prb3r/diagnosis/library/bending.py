"""Bending laws as suspects: plates that soften, stiffen or dissipate.

Each law has its places, its free parameters with bounds, its starting values, a sentence, and its transfer to another
design.
"""

from collections.abc import Iterator

import numpy as np

from prb3r.diagnosis.library.alike import same_parts
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope
from prb3r.diagnosis.library.suspect import Occurrence, effect_in_words
from prb3r.mechanics.plate_law import MOST_ELEMENTS
from prb3r.model.effects.base import Effect
from prb3r.model.effects.plates import HystereticPlate, NonlinearPlate
from prb3r.model.manipulator import Manipulator

SAME_SECTION = 1e-6
"""Relative difference in bending stiffness up to which plates have one section."""
NEEDS_FIBRE = "carries over as strain and needs outer_fibre_m in both manipulator files"
"""Why a law is left behind where outer fibres are not known, to follow "which"."""


def law_places(scope: Scope) -> Iterator[Place]:
    """Places of `nonlinear_plate`: every law for both sides alike, and the bilinear and smooth laws for one side alone
    where plates bend to both.

    Where bending stiffnesses differ and not every outer fibre is known, the bilinear and smooth laws treat all sections
    as of one shape (`sections` = similar).
    """
    yield {"law": "cubic"}
    stiffness = scope.manipulator.bending_stiffness
    unlike = not scope.in_strain and not np.allclose(stiffness, stiffness[0], rtol=SAME_SECTION, atol=0.0)
    sections: Place = {"sections": "similar"} if unlike else {}
    for law in ("bilinear", "smooth"):
        yield {"law": law, **sections}
        if len(scope.sides) == 2:
            yield from ({"law": law, "side": side, **sections} for side in scope.sides)


def law_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `nonlinear_plate`, bounded by the largest curvature K of the recording, as a law beyond it is
    not felt; knees by the largest strain instead, where every plate's outer fibre is known.

    At K the cubic term is at most 100 times the linear one.  A knee lies between K / 50, where the law is linear in all
    but name, and K.  Beyond the knee plates keep at least a fiftieth of their stiffness, or have at most ten times as
    much.  A law with a sharpness of 1 has no knee to speak of; beyond 20 the knee is a corner.
    """
    k = scope.curvature
    if place["law"] == "cubic":
        return (Free("cubic_m2", 0.0, 0.0, 100 / k**2, scale=1 / k**2),)
    name, most = ("knee_strain", scope.strain) if scope.in_strain else ("knee_per_m", k)
    bilinear = Free(name, most / 2, most / 50, most, log=True), Free("ratio", 1.0, 0.02, 10.0, log=True)
    return bilinear if place["law"] == "bilinear" else (*bilinear, Free("sharpness", 3.0, 1.0, 20.0, log=True))


def law_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Starting values: knees at 0.3, 0.55 and 0.8 of the largest curvature or strain, each with plates that soften and
    that stiffen beyond it.  Choice.  None for the cubic law, which vanishes continuously."""
    if place["law"] == "cubic":
        return ()
    most = scope.strain if scope.in_strain else scope.curvature
    rest = (3.0,) if place["law"] == "smooth" else ()
    return tuple((share * most, ratio, *rest) for share in (0.3, 0.55, 0.8) for ratio in (0.7, 1.4))


def said_of_law(fitted: Occurrence) -> str:
    """The sentence on a fitted `nonlinear_plate`."""
    if fitted.place["law"] == "cubic":
        return f"The plates stiffen as they bend: M = EI k (1 + c k²), k the curvature, with c = {fitted.size} m²."
    ratio, strain = fitted.estimates["ratio"], fitted.estimates.get("knee_strain")
    how = "soften (yield)" if ratio.value < 1 else "stiffen (touch)"
    knee = f"a curvature of {fitted.size} 1/m" if strain is None else f"a strain of {strain.times(100)} %"
    if fitted.place.get("sections") == "similar":
        knee += " at plate 1, at the others at the same strain (as sections of one shape)"
    smooth = fitted.estimates.get("sharpness")
    gently = "" if smooth is None else f", over a smooth knee (sharpness {smooth})"
    share = f"{ratio} of" if ratio.value < 1 else f"{ratio} times"
    outside = ratio.value > 1 and fitted.place.get("side")  # a law of the plates would seldom be of one side
    blocked = ", or something outside stands in the arm's way there" if outside else ""
    return f"The plates {how} beyond {knee}{toward(fitted)}, to {share} their stiffness{gently}{blocked}."


def toward(fitted: Occurrence) -> str:
    """A clause that names the side to which plates bend for an effect; empty where both sides are meant."""
    side = fitted.place.get("side")
    return f" where they bend toward {side} offsets" if side else ""


def as_strain(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """The bending law of `here` on the manipulator `there`, or the reason why it cannot be carried over.

    Between equal sections the law stays as it is.  Otherwise the strain of the outermost fibre (curvature times its
    distance) is what stays, with the mean distance over the plates; where no outer fibre is known on either
    manipulator, all sections count as of one shape, so that their sizes follow from their stiffness.
    """
    assert isinstance(effect, NonlinearPlate)
    of_plate_1 = effect.sections is not None  # which may be another section there
    if same_parts(_sections(here), _sections(there)) and not of_plate_1:
        return effect
    fibre, other = here.outer_fibre, there.outer_fibre
    if np.isnan(fibre).all() and np.isnan(other).all():
        return _of_one_shape(effect, here, there)
    known = np.isfinite(other).all() and (effect.knee_strain is not None or np.isfinite(fibre).all())
    if not known:
        return f"{effect_in_words(effect)}, which {NEEDS_FIBRE}"
    if effect.knee_strain is not None:
        return effect
    return _at_curvatures(effect, float(np.mean(other) / np.mean(fibre)))


def _of_one_shape(effect: NonlinearPlate, here: Manipulator, there: Manipulator) -> Effect:
    """The law on sections of one shape, which each reach the same strain at a curvature of their own."""
    if effect.law == "cubic":
        return _at_curvatures(effect, _mean_size(there) / _mean_size(here))
    first, other = (float(_sizes(rig)[0]) for rig in (here, there))
    told_of = first if effect.sections else _mean_size(here)  # the section whose curvature the law tells
    return _at_curvatures(effect.model_copy(update={"sections": "similar"}), other / told_of)


def _sizes(manipulator: Manipulator) -> np.ndarray:
    """(n,) sizes of the sections as if all had one shape, in its own unit: fourth roots of second moments of area."""
    return np.array((manipulator.bending_stiffness / manipulator.youngs_modulus_pa) ** 0.25)


def _mean_size(manipulator: Manipulator) -> float:
    """Mean over all plates of :func:`_sizes`."""
    return float(np.mean(_sizes(manipulator)))


def _at_curvatures(effect: NonlinearPlate, size: float) -> NonlinearPlate:
    """The law of sections `size` times as large, which reach the same strain at 1 / `size` times the curvature."""
    if effect.law == "cubic":
        return effect.model_copy(update={"cubic_m2": (effect.cubic_m2 or 0.0) * size**2})
    return effect.model_copy(update={"knee_per_m": (effect.knee_per_m or np.inf) / size})


def _sections(manipulator: Manipulator) -> list[tuple[float | None, ...]]:
    """The sections of all segments: width, thickness, bending stiffness and outer fibre as stated, SI."""
    names = "width_m", "thickness_m", "bending_stiffness_n_m2", "outer_fibre_m"
    return [tuple(getattr(segment, name) for name in names) for segment in manipulator.segment]


def loop_places(scope: Scope) -> list[Place]:
    """Places of `hysteretic_plate`: plates that begin to slip at one bend, or little by little in any number of stages
    that the effect has; none under loading alone, where they are the same as plates that soften."""
    in_stages: list[Place] = [{"elements": stages} for stages in range(2, MOST_ELEMENTS + 1)]
    return [{}, *in_stages] if scope.unloads else []


def loop_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `hysteretic_plate`: slip begins between a fiftieth of the largest curvature (or strain) and
    all of it, as knees do; the slipping share of the stiffness lies between 0.02, a thin loop, and 0.9, plates that
    hardly spring back."""
    name, most = ("yield_strain", scope.strain) if scope.in_strain else ("yield_per_m", scope.curvature)
    share = Free("slipping_share", 0.3, 0.02, 0.9, log=True)
    return Free(name, most / 2, most / 50, most, log=True), share


def loop_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Starting values: a slipping share of 0.3, with slip that begins at 0.15, 0.4 and 0.7 of the largest curvature or
    strain.  Choice."""
    most = scope.strain if scope.in_strain else scope.curvature
    return tuple((part * most, 0.3) for part in (0.15, 0.4, 0.7))


def said_of_loops(fitted: Occurrence) -> str:
    """The sentence on a fitted `hysteretic_plate`."""
    strain = fitted.estimates.get("yield_strain")
    bend = f"a curvature of {fitted.size} 1/m" if strain is None else f"a strain of {strain.times(100)} %"
    stages = fitted.place.get("elements", 1)
    begins = "beyond" if stages == 1 else f"little by little (in {stages} stages), on average beyond"
    return (
        f"The plates dissipate as they bend to and fro: {begins} {bend} a share of "
        f"{fitted.estimates['slipping_share']} of their stiffness slips, and unloading runs beside loading: look for "
        "superelastic, laminated or plastic plates."
    )


def loops_as_strain(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """The effect of `here` on the manipulator `there`, or the reason why it cannot be carried over: unchanged between
    equal sections, else at the same strain of the outermost fibre (mean distance over the plates); where no outer fibre
    is known on either manipulator, as if all sections had one shape."""
    assert isinstance(effect, HystereticPlate)
    if same_parts(_sections(here), _sections(there)):
        return effect
    fibre, other = here.outer_fibre, there.outer_fibre
    unknown = np.isnan(fibre).all() and np.isnan(other).all()
    if effect.yield_per_m is not None and (unknown or np.isfinite([*fibre, *other]).all()):
        wider = _mean_size(there) / _mean_size(here) if unknown else float(np.mean(other) / np.mean(fibre))
        return effect.model_copy(update={"yield_per_m": effect.yield_per_m / wider})
    if effect.yield_per_m is None and np.isfinite(other).all():
        return effect
    return f"{effect_in_words(effect)}, which {NEEDS_FIBRE}"
