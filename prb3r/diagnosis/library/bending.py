"""Laws of bending as suspects: plates that soften, stiffen or dissipate; where, how much, and what carries over."""

from collections.abc import Iterator

import numpy as np

from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope
from prb3r.diagnosis.library.suspect import Occurrence, effect_in_words
from prb3r.model.effects.base import Effect
from prb3r.model.effects.plates import HystereticPlate, NonlinearPlate, relative_size
from prb3r.model.manipulator import Manipulator

SAME_SECTION = 1e-6
"""Relative difference in bending stiffness up to which plates have one section."""
NEEDS_FIBRE = "carries over as strain and needs outer_fibre_m in both manipulator files"


def law_places(scope: Scope) -> Iterator[Place]:
    """Both sides alike, and where plates bend to both, one side alone; as if all sections had one shape where they
    differ and their fibres are not known."""
    yield {"law": "cubic"}
    stiffness = scope.manipulator.bending_stiffness
    unlike = not scope.in_strain and not np.allclose(stiffness, stiffness[0], rtol=SAME_SECTION, atol=0.0)
    sections: Place = {"sections": "similar"} if unlike else {}
    for law in ("bilinear", "smooth"):
        yield {"law": law, **sections}
        if len(scope.sides) == 2:
            yield from ({"law": law, "side": side, **sections} for side in scope.sides)


def law_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """In units of the largest curvature K, or of the largest strain where every plate's outer fibre is known: a law is
    felt within it.

    The cubic term reaches 100 times the linear one at K; a knee lies between K / 50, where the law is linear in all but
    name, and K.  Beyond the knee plates keep at least a fiftieth of their stiffness, or have tenfold.  A sharpness of 1
    has no knee to speak of; beyond 20 it is one with corners.
    """
    k = scope.curvature
    if place["law"] == "cubic":
        return (Free("cubic_m2", 0.0, 0.0, 100 / k**2, scale=1 / k**2),)
    name, most = ("knee_strain", scope.strain) if scope.in_strain else ("knee_per_m", k)
    bilinear = Free(name, most / 2, most / 50, most, log=True), Free("ratio", 1.0, 0.02, 10.0, log=True)
    return bilinear if place["law"] == "bilinear" else (*bilinear, Free("sharpness", 3.0, 1.0, 20.0, log=True))


def law_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Knees low, in the middle and high in the range of curvatures, of plates that soften or stiffen there.  Choice."""
    if place["law"] == "cubic":
        return ()
    most = scope.strain if scope.in_strain else scope.curvature
    rest = (3.0,) if place["law"] == "smooth" else ()
    return tuple((share * most, ratio, *rest) for share in (0.3, 0.55, 0.8) for ratio in (0.7, 1.4))


def said_of_law(fitted: Occurrence) -> str:
    """What a law means to who reads the diagnosis."""
    if fitted.place["law"] == "cubic":
        return f"The plates stiffen as they bend: M = EI k (1 + c k²), k the curvature, with c = {fitted.size} m²."
    ratio, strain = fitted.estimates["ratio"], fitted.estimates.get("knee_strain")
    how = "soften (yield)" if ratio.value < 1 else "stiffen (touch)"
    knee = f"a curvature of {fitted.size} 1/m" if strain is None else f"a strain of {strain.times(100)} %"
    if fitted.place.get("sections") == "similar":
        knee += " of plate 1 (of others at that strain, as of sections of one shape)"
    smooth = fitted.estimates.get("sharpness")
    gently = "" if smooth is None else f", over a smooth knee (sharpness {smooth})"
    share = f"{ratio} of" if ratio.value < 1 else f"{ratio} times"
    return f"The plates {how} beyond {knee}{toward(fitted)}, to {share} their stiffness{gently}."


def toward(fitted: Occurrence) -> str:
    """The side to which plates bend for an effect, as part of a sentence; empty where it is of both."""
    side = fitted.place.get("side")
    return f" where they bend toward {side} offsets" if side else ""


def as_strain(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """A bending law carries over as strain: curvature times the outermost fibre; on equal sections, as it is; on
    sections that are all known by their stiffness alone, as if they had one shape."""
    assert isinstance(effect, NonlinearPlate)
    of_plate_1 = effect.sections is not None  # which may be another section there
    if _sections(here) == _sections(there) and not of_plate_1:
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
    """The law on plates whose sections are as many times larger as the fourth root of their second moment of area."""
    second_moments = [rig.bending_stiffness[0] / rig.youngs_modulus_pa for rig in (here, there)]
    first = float(relative_size(np.array(second_moments))[1])  # plate 1 there over plate 1 here
    mean, mean_there = (float(np.mean(relative_size(rig.bending_stiffness))) for rig in (here, there))
    told_of = 1.0 if effect.sections else mean  # the plate whose curvature the law tells, over plate 1 here
    if effect.law == "cubic":
        return _at_curvatures(effect, first * mean_there / told_of)
    return _at_curvatures(effect.model_copy(update={"sections": "similar"}), first / told_of)


def _at_curvatures(effect: NonlinearPlate, size: float) -> NonlinearPlate:
    """The law of sections so many times larger, which reach a strain at a curvature so many times smaller."""
    if effect.law == "cubic":
        return effect.model_copy(update={"cubic_m2": (effect.cubic_m2 or 0.0) * size**2})
    return effect.model_copy(update={"knee_per_m": (effect.knee_per_m or np.inf) / size})


def _sections(manipulator: Manipulator) -> set[tuple[float | None, ...]]:
    """What bends in each segment: dimensions, or stiffness and outer fibre."""
    names = "width_m", "thickness_m", "bending_stiffness_n_m2", "outer_fibre_m"
    return {tuple(getattr(segment, name) for name in names) for segment in manipulator.segment}


def loop_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Slip begins as knees do, between a fiftieth of the largest curvature (or strain) and all of it; a share from a
    fiftieth, a loop as thin, to nine tenths, where plates hardly spring back."""
    name, most = ("yield_strain", scope.strain) if scope.in_strain else ("yield_per_m", scope.curvature)
    share = Free("slipping_share", 0.3, 0.02, 0.9, log=True)
    return Free(name, most / 2, most / 50, most, log=True), share


def loop_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Slip of a third of the stiffness, nearly, that begins low, in the middle and high in the range of curvatures.
    Choice."""
    most = scope.strain if scope.in_strain else scope.curvature
    return tuple((part * most, 0.3) for part in (0.15, 0.4, 0.7))


def said_of_loops(fitted: Occurrence) -> str:
    """What loops mean to who reads the diagnosis."""
    strain = fitted.estimates.get("yield_strain")
    bend = f"a curvature of {fitted.size} 1/m" if strain is None else f"a strain of {strain.times(100)} %"
    return (
        f"The plates dissipate as they bend to and fro: beyond {bend} a share of {fitted.estimates['slipping_share']} "
        "of their stiffness slips, and unloading runs beside loading: look for superelastic, laminated or plastic "
        "plates."
    )


def loops_as_strain(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """The effect on another design, its curvature by equal strain of the outermost fibre, or why it does not carry
    over."""
    assert isinstance(effect, HystereticPlate)
    if _sections(here) == _sections(there):
        return effect
    fibre, other = here.outer_fibre, there.outer_fibre
    if not np.isfinite(other).all() or (effect.yield_strain is None and not np.isfinite(fibre).all()):
        return f"{effect_in_words(effect)}, which {NEEDS_FIBRE}"
    if effect.yield_per_m is None:
        return effect
    return effect.model_copy(update={"yield_per_m": effect.yield_per_m * float(np.mean(fibre) / np.mean(other))})
