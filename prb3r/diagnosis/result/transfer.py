"""Transfer of what was learnt from one recording to another recording or design: constants and effects carried over,
with the frame of the camera fitted anew.

On the same manipulator everything carries over.  On another geometry, the factor on Young's modulus, the friction
coefficient, and the effects that the `transfer` of their `Suspect` carries over; the others are left behind, each with
its reason.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut, compared, noise_under
from prb3r.diagnosis.fit.constants import FRAME, Constants
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Model
from prb3r.diagnosis.fit.prediction import Predictor, predictor
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.posterior import Drawn, averaged
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.model.effects.plates import NonlinearPlate, WeakenedPlate
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording


@dataclass(frozen=True)
class Carried:
    """The prediction of another recording."""

    heldout: HeldOut
    """Errors of the calibrated and of the explained model on it."""
    same_geometry: bool
    """Whether it is of the same manipulator but for constants and names."""
    effects: tuple[Effect, ...]
    """Effects that were carried over, as they act there."""
    left_behind: tuple[str, ...]
    """Effects that could not be carried over, each with the reason."""


def same_geometry(first: Manipulator, other: Manipulator) -> bool:
    """Whether two nominal manipulators have equal segments, cables and disks; constants and names may differ."""
    return first.segment == other.segment and first.cable == other.cable and first.disk == other.disk


def on_other(diagnosis: Diagnosis, recording: Recording) -> Carried:
    """The prediction of another recording by `diagnosis`, with its errors, as on held-out sequences.

    The explained prediction is the mean over the surviving models, by their probabilities; the other one has the
    calibrated constants alone.
    """
    nominal, other, settings = diagnosis.nominal, recording.manipulator, Settings(**diagnosis.settings)
    most, named = settings.most_faults, diagnosis.explained
    carried, left = carried_effects(named.effects, nominal, other, most)
    predict = predictor(recording, settings)
    after = predict.solve(carried_constants(named.constants, nominal, other, named.effects, most), carried)
    noise = noise_under(predict, after, settings)
    calibrated = _in_frame(predict, noise, carried_constants(diagnosis.calibrated.constants, nominal, other), [])

    def seen(centre: Drawn) -> np.ndarray:
        constants = carried_constants(centre.constants, nominal, other, centre.effects, most)
        return _in_frame(predict, noise, constants, carried_effects(centre.effects, nominal, other, most)[0])

    explained = averaged([(share, seen(centre)) for share, centre in diagnosis.posterior.centres])
    return Carried(compared(predict, noise, calibrated, explained), same_geometry(nominal, other), carried, left)


def carried_effects(
    effects: Iterable[Effect], here: Manipulator, there: Manipulator, most_faults: int = Settings.most_faults
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """The effects of the manipulator `here` as they act on `there`, and the reasons for those that are left behind.

    `most_faults`: number of plates of another stiffness up to which they count as faults of single parts.
    """
    if same_geometry(here, there):
        return tuple(effects), ()
    return other_geometry(effects, here, there, most_faults)


def other_geometry(
    effects: Iterable[Effect], here: Manipulator, there: Manipulator, most_faults: int = Settings.most_faults
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """The effects as of :func:`carried_effects`, but always for two different rigs, even if their files are equal:
    faults of one part are left behind.

    If more than `most_faults` plates have another stiffness, these faults are left behind together, for one reason.
    """
    effects = tuple(effects)
    carried, left = list[Effect](), list[str]()
    scatter = plate_scatter(effects, here, most_faults)
    if scatter is not None:
        left.append(_SCATTERED.format(np.count_nonzero(scatter != 1), mean_stiffness(scatter)))
    for effect in effects:
        if scatter is not None and isinstance(effect, WeakenedPlate):
            continue
        moved = SUSPECTS[effect.kind].transfer(effect, here, there)
        problems = () if isinstance(moved, str) else tuple(moved.problems(there))
        if isinstance(moved, str) or problems:
            left.append(moved if isinstance(moved, str) else "; ".join(problems))
        else:
            carried.append(moved)
    return tuple(carried), tuple(left)


def supposed(effects: Iterable[Effect]) -> list[str]:
    """A sentence on what is supposed of sections, if `effects` treat all sections of a design as of one shape."""
    if not any(isinstance(effect, NonlinearPlate) and effect.sections for effect in effects):
        return []
    return ["the law of bending acts on each section as if all had one shape, as outer_fibre_m is not stated"]


_SCATTERED = (
    "which plates are softer or stiffer, as {} of them are too many for faults of single parts; "
    "that they are all in all {:.3g} times as stiff goes with Young's modulus"
)
"""Why scattered stiffnesses of plates are left behind, with their number and their mean."""


def plate_scatter(effects: Iterable[Effect], here: Manipulator, most_faults: int) -> np.ndarray | None:
    """(n,) factors on the stiffness of all plates, if more than `most_faults` of them are not nominal; else None."""
    factors = {effect.plate: effect.factor for effect in effects if isinstance(effect, WeakenedPlate)}
    if len(factors) <= most_faults:
        return None
    return np.array([factors.get(plate, 1.0) for plate in range(1, here.plates + 1)])


def mean_stiffness(scatter: np.ndarray) -> float:
    """The one factor with which all plates together would give way as much as with the factors `scatter` (n,): their
    harmonic mean."""
    return float(1 / np.mean(1 / scatter))


def carried_constants(
    constants: Constants,
    here: Manipulator,
    there: Manipulator,
    effects: Iterable[Effect] = (),
    most_faults: int = Settings.most_faults,
) -> Constants:
    """Constants found on the manipulator `here`, beside `effects`, as factors on the nominal ones of `there`; the frame
    is left at zero.

    Where so many plates have another stiffness that it is how the rig's plates are made, their mean goes with the
    factor on stiffness.  `most_faults` as of :func:`carried_effects`.
    """
    stiffness = constants.log_stiffness
    if any(segment.bending_stiffness_n_m2 is None for rig in (here, there) for segment in rig.segment):
        stiffness += np.log(here.youngs_modulus_pa / there.youngs_modulus_pa)  # stated stiffnesses go by themselves
    scatter = None if same_geometry(here, there) else plate_scatter(effects, here, most_faults)
    if scatter is not None:
        stiffness += np.log(mean_stiffness(scatter))
    friction = 0.0
    if here.friction.coefficient > 0 and there.friction.coefficient > 0:
        friction = constants.log_friction + np.log(here.friction.coefficient / there.friction.coefficient)
    return Constants(log_stiffness=float(stiffness), log_friction=float(friction))


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
