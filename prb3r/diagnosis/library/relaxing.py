"""Plates that creep as a suspect: its places, parameters and sentence, and the same law at another pace."""

import numpy as np

from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope
from prb3r.diagnosis.library.suspect import Occurrence
from prb3r.model.effects.base import Effect
from prb3r.model.effects.plates import PlateRelaxation


def relaxing_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `plate_relaxation`: a share from a hundredth, which a steady pull would not show, to 0.8, as
    of a soft plastic, prior sd 0.7 of its logarithm about 0.2, as plastics mostly lose a tenth to a half in the minutes
    of a recording; a time constant from half a step, below which all has relaxed before it is read, to 200 steps, of
    which the recording shows no more than a steady drift, prior sd half a decade about five."""
    share = Free("share", 0.2, 0.01, 0.8, log=True, sd=0.7)
    return share, Free("steps", 5.0, 0.5, 200.0, log=True, sd=float(np.log(10)) / 2)


def relaxing_places(scope: Scope) -> list[Place]:
    """The place of `plate_relaxation`, the whole rig with what a usual step lasts where times are known, where plates
    are bent back; under loading alone creep is much the same as plates that soften."""
    if not scope.unloads:
        return []
    return [{"step_s": scope.usual_step_s} if scope.usual_step_s else {}]


def at_pace(effect: Effect, place: Place) -> tuple[Effect, float]:
    """The same relaxation in steps of another duration; as many steps where one of the two durations is not known."""
    assert isinstance(effect, PlateRelaxation)
    step = place.get("step_s")
    times = effect.step_s / step if effect.step_s and step else 1.0
    return effect.model_copy(update={"steps": times * effect.steps, "step_s": step}), 1.0


def relaxing_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Starting values: a share of 0.2 that relaxes within two, eight and thirty steps.  Choice."""
    return (0.2, 2.0), (0.2, 8.0), (0.2, 30.0)


def said_of_relaxing(fitted: Occurrence) -> str:
    share = fitted.estimates["share"]
    more = 100 * share.value / (1 - share.value)
    step = fitted.place.get("step_s")
    time = f"{fitted.estimates['steps']} steps" if step is None else f"{fitted.estimates['steps'].times(step)} s"
    note = "note when each step was read (time_s), " if step is None else ""
    return (
        f"The plates creep, as plastics do: a share of {share} of the moment that bends them relaxes with a time "
        f"constant of {time}, so that under a steady pull they bend by {more:.3g} % more in "
        f"the end, and come back slowly: {note}begin every sequence with a row without load, "
        "and hold every step as long, where these do not."
    )
