"""`breakaway_friction`, static friction above the kinetic one, as a suspect: which recordings can show it, its free
parameters with bounds and starting values, and its sentence."""

import numpy as np

from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import Occurrence


def _broken_away(scope: Scope) -> np.ndarray:
    """(k,) change of tension since the cable began to slip the way it does, N, for every step and every loaded cable
    that slips there."""
    loads = scope.recording.loads
    return loads.travel[(loads.tension > 0) & (loads.slip != 0)]


def static_friction_shows(scope: Scope) -> list[Place]:
    """The whole rig where a recording can show static friction, else no place.

    That takes friction and declared slip in the nominal model, and some cable that has slipped `Settings.travels_apart`
    times as far one way as another one, or as at another step.
    """
    manipulator, travel = scope.manipulator, _broken_away(scope)
    differ = travel.size > 0 and travel.max() > scope.settings.travels_apart * travel.min()
    return whole_rig_if(differ and manipulator.friction.coefficient > 0 and not manipulator.follows_history)


def breakaway(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `breakaway_friction`.

    `excess` of static over kinetic friction: mostly 0.1 to 0.6 (prior sd 0.3), as of metals on metals and on polymers
    (Rabinowicz 1951; Bowden and Tabor 1950), at most 2.  `decay_n`, the change of tension over which it falls to 1/e:
    between a third of the least slip and all of the farthest, as no step shows a shorter one, and a longer one is
    friction like any other.
    """
    least, most = _decays(scope)
    return Free("excess", 0.0, 0.0, 2.0, sd=0.3), Free("decay_n", (least * most) ** 0.5, least, most, log=True)


def breakaway_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Starting values: an excess of 40 %, within what is usual, with a short, a middle and a long decay. Choice."""
    least, most = _decays(scope)
    return tuple((0.4, least * (most / least) ** share) for share in (0.25, 0.5, 0.75))


def _decays(scope: Scope) -> tuple[float, float]:
    """Least and largest change of tension, N, over which a recording can show the excess to decay."""
    travel = _broken_away(scope)
    slipped = travel[travel > 0]
    return float(slipped.min()) / 3, float(slipped.max())


def breakaway_sentence(fitted: Occurrence) -> str:
    return (
        "Static friction exceeds the kinetic one: where a cable begins to slip or turns back its coefficient is larger "
        f"by {fitted.size.times(100)} %, which falls to 1/e as its tension changes by {fitted.estimates['decay_n']} N; "
        "lubricate the holes, or overshoot and come back before a reading."
    )
