"""Transfer of what was learnt from one recording to another recording or design: constants and effects carried over,
with the frame of the camera fitted anew.

On the same manipulator everything carries over.  On another geometry, the factor on Young's modulus, the friction
coefficient, and the effects that the `transfer` of their `Suspect` carries over; the others are left behind, each with
its reason.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut, compared, is_shown, noise_under
from prb3r.diagnosis.checks.odd_part import OddPart, odd_part
from prb3r.diagnosis.fit.constants import FRAME, Constants
from prb3r.diagnosis.fit.covariance import Noise, NoiseLevel
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Model
from prb3r.diagnosis.fit.prediction import Predictor, predictor
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.alike import same_numbers
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.suspect import effect_in_words
from prb3r.diagnosis.result.carried_constants import (
    carried_constants,
    constants_left_behind,
    mean_stiffness,
    plate_scatter,
    scatter_effects,
    turns_alike,
    wrap_of,
)
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.effects import NamedEffect
from prb3r.diagnosis.result.numbers import FittedModel
from prb3r.diagnosis.result.posterior import Drawn, averaged
from prb3r.diagnosis.result.same_rig import same_geometry
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.model.effects.friction import CableFriction, WornHole
from prb3r.model.effects.plates import (
    NonlinearPlate,
    Precurvature,
    PrecurvatureGradient,
    SegmentStiffness,
    WeakenedPlate,
)
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording


@dataclass(frozen=True)
class Carried:
    """The prediction of another recording."""

    heldout: HeldOut
    """Errors of the calibrated and of the explained model on it."""
    without: tuple[HeldOut | None, ...]
    """For each named effect the errors of the model without it, in the place of the calibrated one, and of the chosen
    model; None where the effect is left behind, or where there is no fit without it."""
    same_geometry: bool
    """Whether it is of the same manipulator but for constants and names."""
    effects: tuple[Effect, ...]
    """Effects that were carried over, as they act there."""
    left_behind: tuple[str, ...]
    """Effects and constants that could not be carried over, each with the reason."""
    of_the_bench: tuple[str, ...]
    """In words those of the effects that were carried over because it stands on the bench of the diagnosed rig."""
    odd: OddPart | None
    """The part of its rig that is not as drawn, if one is not."""


def on_other(diagnosis: Diagnosis, recording: Recording) -> Carried:
    """The prediction of another recording by `diagnosis`, with its errors, as on held-out sequences; on the bench of
    the diagnosed recording, unless its file says otherwise (`Sharing.bench`).

    The explained prediction is the mean over the surviving models, by their probabilities; the other one has the
    calibrated constants alone.
    """
    nominal, other, settings = diagnosis.nominal, recording.manipulator, Settings(**diagnosis.settings)
    same_bench = recording.sharing.bench
    rests = diagnosis.posterior.resting(same_geometry(nominal, other), same_bench)
    most, named = settings.most_faults, rests.named

    def moved(effects: Iterable[Effect]) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
        return carried_effects(effects, nominal, other, most, same_bench)

    carried, left = moved(named.effects)
    elsewhere, _ = carried_effects(named.effects, nominal, other, most)
    predict = predictor(recording, settings)
    after = predict.solve(carried_constants(named.constants, nominal, other, named.effects, most), carried)
    noise = noise_under(predict, after, settings)
    calibrated = _in_frame(predict, noise, carried_constants(diagnosis.calibrated.constants, nominal, other), [])

    def seen(model: Drawn | FittedModel) -> np.ndarray:
        constants = carried_constants(model.constants, nominal, other, model.effects, most)
        return _in_frame(predict, noise, constants, moved(model.effects)[0])

    explained = averaged([(share, seen(centre)) for share, centre in rests.centres])
    chosen = seen(named)

    def errors_without(effect: NamedEffect) -> HeldOut | None:
        rest = effect.without
        if rest is None or len(moved(rest.effects)[0]) == len(carried):
            return None
        return compared(predict, noise, seen(rest), chosen)

    without_effects = predict(after.constants, ())
    return Carried(
        heldout=replace(
            compared(predict, noise, calibrated, explained),
            felt=is_shown(after.readings - without_effects, noise, settings),
        ),
        without=tuple(map(errors_without, diagnosis.effects)),
        same_geometry=same_geometry(nominal, other),
        effects=carried,
        left_behind=(
            *left,
            *nominal_left_behind(nominal, other),
            *constants_left_behind(nominal, other, named.effects),
        ),
        of_the_bench=tuple(dict.fromkeys(effect_in_words(effect) for effect in carried if effect not in elsewhere)),
        odd=odd_part(predict, after, tuple(map(given, carried)), _at_least_as_stated(diagnosis)),
    )


def _at_least_as_stated(diagnosis: Diagnosis) -> NoiseLevel:
    """The level of the noise that the diagnosed recording shows, or the stated one where that is larger."""
    found = diagnosis.noise
    return NoiseLevel(
        max(found.scale, 1.0),
        found.common,
        found.reach,
        max(found.tension_scale, 1.0),
        found.lasting,
        found.serial,
        found.span,
    )


def carried_effects(
    effects: Iterable[Effect],
    here: Manipulator,
    there: Manipulator,
    most_faults: int = Settings.most_faults,
    same_bench: bool = False,
    another_copy: bool = False,
    made_alike: bool = False,
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """The effects of the manipulator `here` as they act on `there`, and the reasons for those that are left behind.

    Parameters
    ----------
    most_faults : number of plates of another stiffness up to which they count as faults of single parts.
    same_bench : whether `there` stands on the bench of `here`, mounted alike.
    another_copy : whether `there`, even if its file is that of `here`, is another rig.
    made_alike : whether another rig has the rest curvature that all plates of `here` have.
    """
    effects = tuple(effects)
    if another_copy or not same_geometry(here, there):
        return other_geometry(effects, here, there, most_faults, same_bench, made_alike)
    return _possible(zip(effects, effects, strict=True), here, there)


def other_geometry(
    effects: Iterable[Effect],
    here: Manipulator,
    there: Manipulator,
    most_faults: int = Settings.most_faults,
    same_bench: bool = False,
    made_alike: bool = False,
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """The effects as of :func:`carried_effects`, but always for two different rigs, even if their files are equal:
    faults of one part are left behind.

    If more than `most_faults` plates have another stiffness, these faults are left behind together, for one reason.
    """
    effects, together = tuple(effects), tuple[str, ...]()
    scatter = plate_scatter(effects, here, most_faults)
    if scatter is not None:
        told = scatter_effects(effects, here, most_faults)
        effects = tuple(effect for effect in effects if effect not in told)
        together = (_SCATTERED.format(_which_scatter(told), mean_stiffness(scatter)),)

    def moved(effect: Effect) -> Effect | str:
        if made_alike and _of_the_making(effect):
            return effect
        return SUSPECTS[effect.kind].carries(same_bench)(effect, here, there)

    carried, left = _possible(((effect, moved(effect)) for effect in effects), here, there)
    return carried, (*together, *left)


def _of_the_making(effect: Effect) -> bool:
    """Whether an effect may come from how rigs of one make are made: rest curvature of all plates, as of one coil."""
    return isinstance(effect, PrecurvatureGradient) or (isinstance(effect, Precurvature) and effect.plates is None)


def _possible(
    moved: Iterable[tuple[Effect, Effect | str]], here: Manipulator, there: Manipulator
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """The effects that the manipulator `there` can have beside its own, and the reasons for those left behind.

    `moved`: effects found on the manipulator `here`, each as it acts there, or with the reason why it stays behind.
    """
    moved, carried, left = tuple(moved), list[Effect](), list[str]()
    stated = [effect for effect in there.effect if effect not in here.effect]
    alike = turns_alike(here, there, (found for found, _ in moved))
    for found, moves in moved:
        if isinstance(moves, str):
            left.append(moves)
        elif isinstance(found, CableFriction | WornHole) and not alike:
            left.append(f'{effect_in_words(found)}, which goes with wrap = "{wrap_of(here)}"')
        elif any(_in_place_of_one(moves, effect) for effect in stated):
            left.append(f"{effect_in_words(found)}, of which this design's file states its own")
        elif problems := tuple(moves.problems(there)):
            left.append("; ".join(problems))
        else:
            carried.append(moves)
    return tuple(carried), tuple(left)


def _in_place_of_one(effect: Effect, other: Effect) -> bool:
    """Whether two effects are of one kind and sit at one place, so that each says of the same thing what it is."""
    return effect.kind == other.kind and (type(effect).once or _place(effect) == _place(other))


def _place(effect: Effect) -> dict[str, Any]:
    """Where an effect sits: its fields that are no sizes."""
    return {name: value for name, value in effect.model_dump(exclude_none=True).items() if not isinstance(value, float)}


def nominal_left_behind(here: Manipulator, there: Manipulator) -> tuple[str, ...]:
    """Reasons for the effects that the file of the manipulator `here` states, and that `there` would have too but for
    its file."""
    stated = [effect for effect in here.effect if not any(_in_place_of_one(effect, other) for other in there.effect)]
    if not same_geometry(here, there):
        stated = [effect for effect in stated if effect.kind in SUSPECTS]  # an empirical law is one of its rig alone
    carried, _ = carried_effects(stated, here, there)
    reason = "{}, which the file of the recorded rig states and this design's does not"
    return tuple(reason.format(effect_in_words(effect)) for effect in carried)


def without_found(found: Iterable[Effect], design: Manipulator) -> Manipulator:
    """The design without those of its effects that are `found` ones with the same sizes: a file that was written from
    the diagnosis itself has them already."""
    found = list(found)
    own = [effect for effect in design.effect if not any(_equal(effect, other) for other in found)]
    return design if len(own) == len(design.effect) else design.model_copy(update={"effect": own})


def _equal(first: Effect, other: Effect) -> bool:
    """Whether two effects are the same but for rounding."""
    one, two = (effect.model_dump(exclude_none=True) for effect in (first, other))
    return one.keys() == two.keys() and all(
        same_numbers(value, two[name]) if isinstance(value, float) else value == two[name]
        for name, value in one.items()
    )


def supposed(effects: Iterable[Effect]) -> list[str]:
    """A sentence on what is supposed of sections, if `effects` treat all sections of a design as of one shape."""
    if not any(isinstance(effect, NonlinearPlate) and effect.sections for effect in effects):
        return []
    return ["the law of bending acts on each section as if all had one shape, as outer_fibre_m is not stated"]


_SCATTERED = "which {}; that they are all in all {:.3g} times as stiff goes with Young's modulus"
"""Why scattered stiffnesses are left behind, with what scatters (:func:`_which_scatter`) and their mean."""


def _which_scatter(told: Iterable[Effect]) -> str:
    """The :func:`scatter_effects`, in words that follow "which"."""
    plates = sum(isinstance(effect, WeakenedPlate) for effect in told)
    segments = ["segments are softer or stiffer, as every one is"] * any(
        isinstance(effect, SegmentStiffness) for effect in told
    )
    many = f"plates are softer or stiffer, as {plates} of them are too many for faults of single parts"
    return " and which ".join([many] * bool(plates) + segments)


def _in_frame(predict: Predictor, noise: Noise, constants: Constants, effects: Sequence[Effect]) -> np.ndarray:
    """(r,) predicted readings with these constants and effects, in the frame of the camera that fits the recording best
    under its prior."""
    model = Model(predict, noise, tuple(given(effect) for effect in effects), predict.settings)
    start = np.array([getattr(constants, name) for name in model.varied])
    known = [k for k, name in enumerate(model.varied) if name not in FRAME]
    fitted = fit(model, start, fixed=known)
    return predict(constants, effects) if fitted is None else fitted.solved.readings


def given(effect: Effect) -> Hypothesis:
    """An effect with known numbers as a hypothesis without free parameters."""
    plain = effect.model_dump(exclude={"kind"}, exclude_none=True)
    place = {name: tuple(value) if isinstance(value, list) else value for name, value in plain.items()}
    return Hypothesis(effect.kind, tuple(place.items()))
