"""Static friction as a suspect: where a recording can show it, how large it could be, what it means."""

import numpy as np

from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import Occurrence


def _broken_away(scope: Scope) -> np.ndarray:
    """(k,) by how much tensions had changed, at every step of every loaded cable, since it began to slip that way."""
    loads = scope.recording.loads
    return loads.travel[(loads.tension > 0) & (loads.slip != 0)]


def static_friction_shows(scope: Scope) -> list[Place]:
    """Where cables slipped a little and far since they began or turned, with declared slip and friction."""
    manipulator, travel = scope.manipulator, _broken_away(scope)
    differ = travel.size > 0 and travel.max() > scope.settings.travels_apart * travel.min()
    return whole_rig_if(differ and manipulator.friction.coefficient > 0 and not manipulator.follows_history)


def breakaway(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Static friction of 1.1 to 1.6 times the kinetic one mostly, as of metals on metals and on polymers (Rabinowicz
    1951; Bowden and Tabor 1950), up to threefold; lost between a third of the least slip and all of the farthest:
    sooner, no step shows it, later it is friction like any other."""
    least, most = _decays(scope)
    return Free("excess", 0.0, 0.0, 2.0, sd=0.3), Free("decay_n", (least * most) ** 0.5, least, most, log=True)


def breakaway_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """An excess of 40 %, within what is usual, that is lost soon, late and in between.  Choice."""
    least, most = _decays(scope)
    return tuple((0.4, least * (most / least) ** share) for share in (0.25, 0.5, 0.75))


def _decays(scope: Scope) -> tuple[float, float]:
    """Least and largest change of tension over which an excess could be seen to be lost, N."""
    travel = _broken_away(scope)
    slipped = travel[travel > 0]
    return float(slipped.min()) / 3, float(slipped.max())


def breakaway_sentence(fitted: Occurrence) -> str:
    return (
        "Static friction exceeds the kinetic one: where a cable begins to slip or turns back its coefficient is larger "
        f"by {fitted.size.times(100)} %, which falls to 1/e as its tension changes by {fitted.estimates['decay_n']} N; "
        "lubricate the holes, or overshoot and come back before a reading."
    )
