"""Suspects among friction: its coefficient for all cables, one cable or one hole, its dependence on load, rate, time
and wrap angle, a drag that does not depend on the load, slip along the load path, and pulleys before the base."""

from collections.abc import Iterator

from prb3r.diagnosis.library.breakaway import (
    breakaway,
    breakaway_probes,
    breakaway_sentence,
    static_friction_shows,
)
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.references import (
    at_rate,
    at_tension,
    exponent_free,
    load_shows,
    rate_free,
    rate_shows,
    said_of_load,
    said_of_rate,
)
from prb3r.diagnosis.library.scope import Place, Scope, together_and_alone, whole_rig_if
from prb3r.diagnosis.library.suspect import (
    OF_A_PART,
    OF_THE_COURSE,
    OF_THE_SURFACES,
    Estimate,
    Occurrence,
    Suspect,
    as_it_is,
    rare,
    unchanged,
)
from prb3r.diagnosis.library.totals import pulley_of_cables
from prb3r.model.effects.friction import CableFriction


def _rubbing(scope: Scope) -> Iterator[Place]:
    """Places of `cable_friction`: all cables where the nominal model has no friction, and each pulled cable alone;
    cables of which the manipulator file states `cable_friction` already are left out."""
    known = [effect for effect in scope.manipulator.effect if isinstance(effect, CableFriction)]
    settled = {cable for effect in known for cable in effect.cables or scope.manipulator.cable_names}
    for place in together_and_alone(scope):
        cables = place.get("cables") or scope.manipulator.cable_names
        if settled.isdisjoint(cables) and (place or scope.manipulator.friction.coefficient == 0):
            yield place


def _coefficient(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `cable_friction`: up to 2, prior sd 0.3.  Dry metal on metal mostly stays below 0.6, a cable
    that cuts into its hole may exceed 1."""
    return (Free("coefficient", 0.0, 0.0, 2.0, above=scope.manipulator.friction.coefficient > 0, sd=0.3),)


def _or_none(coefficient: Estimate) -> Estimate:
    """A friction coefficient; what is less than half a ten-thousandth counts as none."""
    value, low, high = (0.0 if end is not None and abs(end) < 5e-5 else end for end in coefficient.numbers)
    return Estimate(value or 0.0, low, high, coefficient.open)


def _rubbing_sentence(fitted: Occurrence) -> str:
    cables = ", ".join(fitted.place.get("cables", ()))
    if cables and fitted.friction:
        size = _or_none(fitted.size)
        return f"Cable {cables} rubs {fitted.more} in its holes than the others: friction coefficient {size}."
    who = f"Cable {cables} rubs in its holes" if cables else "The cables rub in their holes"
    return f"{who} with a coefficient of {_or_none(fitted.size)}, where the nominal model has no friction."


def _pulley(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `pulley_friction`: down to 0.2, what belt friction with a coefficient of 0.5 leaves of a
    tension over half a turn; prior sd 0.2 of its logarithm, so mostly 0.8 and more."""
    return (Free("efficiency", 1.0, 0.2, 1.0, log=True, sd=0.2),)


def _pulley_sentence(fitted: Occurrence) -> str:
    loss = fitted.size.less(1.0).times(100)
    total = fitted.with_others(" %", lambda efficiency: 100 * (1 - efficiency))
    return (
        f"The pulley (or sheath) of {fitted.of_cables} takes {loss:.3g} % of the tension before it reaches the base"
        f"{total}."
    )


def _presliding(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `slip_history`: a presliding travel between a micrometre, below which friction turns at once on
    any rig, and a centimetre; its null is the nominal travel where the nominal slip follows the load path already, else
    the first that is tried."""
    friction = scope.manipulator.friction
    usual = friction.presliding_m if friction.direction == "history" else scope.settings.presliding_tried_m[0]
    return (Free("presliding_m", usual, min(1e-6, usual), max(1e-2, usual), log=True, limit=True),)


def _presliding_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Starting values: usual travels where the nominal slip is declared.

    Where the nominal slip follows the load path already, travels of other orders of magnitude than the nominal one:
    derivatives around a travel that is short against what cables travel say next to nothing of a long one.
    """
    friction, (free,) = scope.manipulator.friction, _presliding(scope, place)
    if friction.direction == "declared":
        return tuple((travel,) for travel in scope.settings.presliding_tried_m)
    others = (friction.presliding_m * factor for factor in (0.1, 10.0, 100.0))
    return tuple((travel,) for travel in others if free.low <= travel <= free.high)


def _saturation(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `wrap_saturation`, in units in which a value of 1 makes a turn as large as the largest bend
    count half: prior sd 0.5, up to 20, where a twentieth of such a turn counts."""
    per_turn = 1 / scope.largest_bend
    return (Free("saturation_per_rad", 0.0, 0.0, 20 * per_turn, scale=per_turn, sd=0.5),)


def _drag(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `hole_drag`: up to what all holes of a cable together take of half the largest tension, prior
    sd a tenth of that tension."""
    all_holes = scope.pull / max(scope.reach(cable) for cable in scope.pulled)
    return (Free("drag_n", 0.0, 0.0, 0.5 * all_holes, scale=all_holes, sd=0.1),)


def _drags(scope: Scope) -> list[Place]:
    """The place of `hole_drag`, the whole rig, where a cable is pulled; else none."""
    return whole_rig_if(bool(scope.pulled))


def _rubs(scope: Scope) -> list[Place]:
    """The whole rig where the nominal model has friction, else no place."""
    return whole_rig_if(scope.manipulator.friction.coefficient > 0)


def _wears(scope: Scope) -> list[Place]:
    """The place of `friction_drift`, the whole rig, where a cable is pulled, slip is declared and time can be told from
    the load; else none.  Cables may be found to rub that the manipulator file has without friction."""
    return whole_rig_if(bool(scope.pulled) and scope.tells_time and not scope.manipulator.follows_history)


def _growth(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `friction_drift`: over the whole recording up to twice the friction more, or nearly all of it
    less, prior sd 40 %: dry pairs run in or wear by some tens of per cent (Blau, Friction Science and Technology, CRC
    2009)."""
    step = 1 / scope.elapsed
    return (Free("share_per_step", 0.0, -0.9 * step, 2.0 * step, scale=step, sd=0.4),)


def _drift_sentence(fitted: Occurrence) -> str:
    percent = fitted.size.times(100)
    if percent.value < 0:
        return f"Friction falls by {percent.less(0.0)} % of the first step's with every step: cables and holes run in."
    return (
        f"Friction grows by {percent} % of the first step's with every step: cables and holes wear, or grease is lost."
    )


def _remembered(scope: Scope) -> list[Place]:
    """The whole rig where `slip_history` could show, else no place: where the nominal model has friction, or where slip
    is declared and some tension falls within a sequence.

    Without friction in the nominal model cables may still be found to rub.  Unless they are let go, friction that
    builds up differs from none by its size alone.
    """
    friction = scope.manipulator.friction
    unknown = friction.direction == "declared" and scope.recording.lets_go
    return whole_rig_if(friction.coefficient > 0 or unknown)


def _slip_sentence(fitted: Occurrence) -> str:
    travel = fitted.size.times(1e6)
    return (
        "The cables stick and slip with the load history: friction builds up over "
        f"{travel:.3g} micrometres of travel, other than the manipulator file says."
    )


def _holes(scope: Scope) -> Iterator[Place]:
    """Places of `worn_hole`: for each disk from 0 (the base) on, the holes of all cables together, then the hole of
    each pulled cable that reaches the disk."""
    for disk in range(scope.chain.plates):
        for place in together_and_alone(scope):
            if all(disk < scope.reach(cable) for cable in place.get("cables", ())):
                yield {"disk": disk, **place}


def _excess(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `worn_hole`, as the difference from the coefficient of the other holes: prior sd 0.5, down to
    no friction and up to a coefficient of 5, where half a turn already holds any tension."""
    return (Free("coefficient", 0.0, 0.0, 5.0, above=True, sd=0.5),)


def _worn_sentence(fitted: Occurrence) -> str:
    disk = fitted.place["disk"]
    where = f"disk {disk}" if disk else "the base disk"
    whose = f" for {fitted.of_cables}" if fitted.place.get("cables") else ""
    size = _or_none(fitted.size)
    return f"The holes of {where} rub {fitted.more} than the others{whose}: friction coefficient {size}."


def _net_turns(scope: Scope) -> list[Place]:
    """The whole rig where the nominal model has friction by the net turn of a cable at a hole, else no place."""
    friction = scope.manipulator.friction
    return whole_rig_if(friction.coefficient > 0 and friction.wrap == "net")


FRICTION_SUSPECTS = (
    Suspect(
        "cable_friction",
        _rubbing_sentence,
        as_it_is,
        places=_rubbing,
        free=_coefficient,
        shared=OF_THE_SURFACES,
        presence=lambda settings: settings.rubbing_presence,
    ),
    Suspect(
        "load_dependent_friction",
        sentence=said_of_load,
        transfer=as_it_is,
        places=load_shows,
        free=exponent_free,
        referred=at_tension,
        presence=rare,
    ),
    Suspect(
        "rate_dependent_friction",
        sentence=said_of_rate,
        transfer=as_it_is,
        places=rate_shows,
        free=rate_free,
        referred=at_rate,
        presence=rare,
    ),
    Suspect(
        "breakaway_friction",
        sentence=breakaway_sentence,
        transfer=as_it_is,
        places=static_friction_shows,
        free=breakaway,
        probes=breakaway_probes,
        presence=rare,
    ),
    Suspect("friction_drift", _drift_sentence, OF_THE_COURSE, places=_wears, free=_growth, presence=rare),
    Suspect(
        "wrap_saturation",
        sentence=lambda fitted: (
            "Friction saturates with the wrap angle, as of stiff cables that lie against their holes over a part of "
            f"each turn: of a turn t counts t / (1 + t x {fitted.size} per rad)."
        ),
        transfer=as_it_is,
        places=_rubs,
        free=_saturation,
        presence=rare,
    ),
    Suspect(
        "hole_drag",
        sentence=lambda fitted: (
            f"Every hole drags on its cable with {fitted.size} N, whatever the tension, as a seal, a lining or a cable "
            "that resists being bent to and fro does."
        ),
        transfer=as_it_is,
        places=_drags,
        free=_drag,
        shared=OF_THE_SURFACES,
        presence=rare,
    ),
    Suspect(
        "pulley_friction",
        _pulley_sentence,
        as_it_is,
        places=together_and_alone,
        free=_pulley,
        quantity=pulley_of_cables,
    ),
    Suspect(
        "slip_history",
        _slip_sentence,
        as_it_is,
        places=_remembered,
        free=_presliding,
        probes=_presliding_probes,
        shared=OF_THE_SURFACES,
    ),
    Suspect("worn_hole", _worn_sentence, OF_A_PART, places=_holes, free=_excess),
    Suspect(
        "edge_wrap",
        sentence=lambda fitted: (
            "The cables rub at both edges of every hole, by the turn at each, not by the net turn of the cable."
        ),
        transfer=as_it_is,
        bench=unchanged,
        places=_net_turns,
        shared=OF_THE_SURFACES,
    ),
)
