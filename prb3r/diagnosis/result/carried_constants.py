"""Constants found on one rig as factors on the nominal ones of another, and where they do not carry over."""

from collections.abc import Iterable, Sequence

import numpy as np

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.result.same_rig import same_geometry, stiffness_ratio
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.model.effects.friction import EdgeWrap
from prb3r.model.effects.plates import SegmentStiffness, WeakenedPlate
from prb3r.model.manipulator import Manipulator


def scatter_effects(effects: Iterable[Effect], here: Manipulator, most_faults: int) -> tuple[Effect, ...]:
    """The effects that together tell how the plates of a rig are made, and not that single parts are faulty.

    They are the stiffnesses of single plates, if there are more than `most_faults`, and those of segments, if every
    segment has one.
    """
    effects = tuple(effects)
    plates = tuple(effect for effect in effects if isinstance(effect, WeakenedPlate))
    segments = tuple(effect for effect in effects if isinstance(effect, SegmentStiffness))
    every = {effect.segment for effect in segments} == set(range(1, len(here.segment) + 1))
    return (*(plates if len(plates) > most_faults else ()), *(segments if every else ()))


def plate_scatter(effects: Iterable[Effect], here: Manipulator, most_faults: int) -> np.ndarray | None:
    """(n,) factors on the stiffness of all plates by the :func:`scatter_effects`; None without any."""
    told = scatter_effects(effects, here, most_faults)
    if not told:
        return None
    chain = here.plain_chain()
    made = chain
    for effect in told:
        made = effect.change(made, here)
    return made.stiffness[:, 0] / chain.stiffness[:, 0]


def mean_stiffness(scatter: np.ndarray) -> float:
    """The one factor with which all plates together would give way as much as with the factors `scatter` (n,): their
    harmonic mean."""
    return float(1 / np.mean(1 / scatter))


def log_of_scatter(effects: Iterable[Effect], here: Manipulator, most_faults: int = Settings.most_faults) -> float:
    """ln of the mean stiffness by the :func:`scatter_effects`, which goes with Young's modulus where these stay behind;
    0 without any."""
    scatter = plate_scatter(effects, here, most_faults)
    return 0.0 if scatter is None else float(np.log(mean_stiffness(scatter)))


def carried_constants(
    constants: Constants,
    here: Manipulator,
    there: Manipulator,
    effects: Sequence[Effect] = (),
    most_faults: int = Settings.most_faults,
    *,
    another_copy: bool = False,
) -> Constants:
    """Constants found on the manipulator `here`, beside `effects`, as factors on the nominal ones of `there`; the frame
    is left at zero.

    Where so many plates have another stiffness that it is how the rig's plates are made, their mean goes with the
    factor on stiffness.  `most_faults` and `another_copy` as of :func:`carried_effects`.
    """
    stiffness, one_rig = constants.log_stiffness, not another_copy and same_geometry(here, there)
    if one_rig:
        stiffness += np.log(stiffness_ratio(here, there))  # it is as stiff as it was, whatever its file states
    elif any(segment.bending_stiffness_n_m2 is None for rig in (here, there) for segment in rig.segment):
        stiffness += np.log(here.youngs_modulus_pa / there.youngs_modulus_pa)  # stated stiffnesses go by themselves
    if not one_rig:
        stiffness += log_of_scatter(effects, here, most_faults)
    friction = 0.0
    if here.friction.coefficient > 0 and not constants_left_behind(here, there, effects):
        friction = constants.log_friction + np.log(here.friction.coefficient / there.friction.coefficient)
    return Constants(log_stiffness=float(stiffness), log_friction=float(friction))


def constants_left_behind(here: Manipulator, there: Manipulator, effects: Iterable[Effect]) -> tuple[str, ...]:
    """The reason why the friction coefficient found on the manipulator `here`, beside `effects`, is left behind; none
    where it carries over to `there`, or where `here` has no friction."""
    if here.friction.coefficient == 0:
        return ()
    if there.friction.coefficient == 0:
        return ("friction, of which the design states none",)
    if not turns_alike(here, there, effects):
        return (f'the friction coefficient found, which goes with wrap = "{wrap_of(here)}": the design keeps its own',)
    return ()


def turns_alike(here: Manipulator, there: Manipulator, effects: Iterable[Effect]) -> bool:
    """Whether friction counts the same turns of a cable on both manipulators, if `effects` are carried over from the
    first to the second: net or at both edges of a hole."""
    effects = tuple(effects)
    return wrap_of(here, effects) == wrap_of(there, effects)


def wrap_of(manipulator: Manipulator, more: Iterable[Effect] = ()) -> str:
    """How a manipulator with `more` effects beside its own counts the turns of a cable, as `friction.wrap` has it."""
    at_edges = any(isinstance(effect, EdgeWrap) for effect in (*manipulator.effect, *more))
    return "edges" if at_edges else manipulator.friction.wrap
