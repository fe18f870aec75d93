"""Suspects among the cables: errors of the recorded tensions, a dead cable, and holes that lie elsewhere or have
play."""

from collections.abc import Iterator

import numpy as np

from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, pulled_cables, together_and_alone, whole_rig_if
from prb3r.diagnosis.library.suspect import (
    OF_A_PART,
    OF_THE_COURSE,
    OF_THE_SETUP,
    Occurrence,
    Suspect,
    rare,
    with_the_same,
)
from prb3r.diagnosis.library.totals import drift_of_cables, play_of_cables, zero_of_cables
from prb3r.model.effects.base import Effect
from prb3r.model.effects.cables import HoleOffset
from prb3r.model.manipulator import Manipulator


def _zero(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `tension_offset`: up to half of the largest tension either way, prior sd a tenth of it; a force
    sensor farther off its zero is seen by eye."""
    span = 0.5 * scope.pull
    return (Free("offset_n", 0.0, -span, span, scale=scope.pull, sd=0.1),)


def _weight(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `hanger`: up to half of the largest tension, prior sd a tenth of it, as of a force sensor."""
    return (Free("weight_n", 0.0, 0.0, 0.5 * scope.pull, scale=scope.pull, sd=0.1),)


def _hung(scope: Scope) -> list[Place]:
    """The place of `hanger`, all cables, where some are idle while others are pulled: else it is much the same as
    `tension_offset`."""
    pulled = scope.recording.loads.tension > 0
    return whole_rig_if(bool((pulled.any(1) & ~pulled.all(1)).any()))


def _drift(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `tension_drift`: over the whole recording up to half of the largest tension either way, prior
    sd 5 % of it; more is seen by eye."""
    step = scope.pull / scope.elapsed
    return (Free("offset_n_per_step", 0.0, -0.5 * step, 0.5 * step, scale=step, sd=0.05),)


def _play(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `tension_play`: up to a quarter of the largest tension, prior sd 4 % of it; with more, one
    would see that nothing moves after a reversal."""
    return (Free("play_n", 0.0, 0.0, 0.25 * scope.pull, scale=scope.pull, sd=0.04),)


def _reversed(scope: Scope) -> Iterator[Place]:
    """Places of `tension_play`: all cables, if any tension falls within a sequence, in one step or in several, by more
    than `Settings.side_share` of the largest tension; then, on a rig of several cables, each alone whose tension
    does."""
    recording, let_go = scope.recording, np.zeros(len(scope.manipulator.cable_names), bool)
    for tension in np.split(recording.loads.tension, np.flatnonzero(recording.begins)[1:]):
        fallen = (np.maximum.accumulate(tension, axis=0) - tension).max(0)
        let_go |= fallen > scope.settings.side_share * scope.pull
    names = [name for name, falling in zip(scope.manipulator.cable_names, let_go, strict=True) if falling]
    yield from whole_rig_if(bool(names))
    if len(scope.manipulator.cable_names) > 1:
        yield from ({"cables": (name,)} for name in names)


def _drifting(scope: Scope) -> Iterator[Place]:
    """Places of `tension_drift`: those of `tension_offset`, where time can be told from the load."""
    if scope.tells_time:
        yield from together_and_alone(scope)


def _cells(scope: Scope) -> tuple[Place, ...]:
    """Places of `load_cell`, all cables.  A gain of all is Young's modulus, unless known dead loads act: then gain and
    quadratic term are sought, and each alone.  The gain of one cable is an offset of its holes."""
    return ({}, {"quadratic_per_n": 0.0}, {"gain": 1.0}) if scope.dead_loads_known else ({},)


def _cell(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `load_cell`: a gain within a third, and a quadratic term that changes the largest tension by
    up to half; prior sd of both 5 %, as more is seen when the cell is calibrated."""
    scale = 1 / scope.pull
    gain = Free("gain", 1.0, 0.7, 1.4, log=True, sd=0.05)
    bent = Free("quadratic_per_n", 0.0, -0.5 * scale, 0.5 * scale, scale=scale, sd=0.05)
    if not scope.dead_loads_known:
        return (bent,)
    return tuple(free for free in (gain, bent) if free.name not in place)


def _cell_sentence(fitted: Occurrence) -> str:
    gain, bent = (fitted.estimates.get(name) for name in ("gain", "quadratic_per_n"))
    if gain is None:
        return (
            "The force sensors do not read in proportion: what they read as T is really T (1 + q T) with "
            f"q = {bent} 1/N; calibrate them with weights."
        )
    curve = "" if bent is None else f" (1 + q T) with q = {bent} 1/N"
    return (
        f"Against the dead loads the force sensors of all cables are off: what they read as T is really {gain} "
        f"T{curve}; calibrate them with the same weights."
    )


def _offset(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `hole_offset`: up to half of the cable's lever arm either way, prior sd a tenth of it; a hole
    farther off its place is seen by eye."""
    arm = scope.arm_of(place["cable"])
    return (Free("offset_m", 0.0, -0.5 * arm, 0.5 * arm, scale=arm, sd=0.1),)


def _offset_or_load_cell(effect: Effect, here: Manipulator, there: Manipulator) -> str:
    """The transfer of `hole_offset` on the bench of the recording: it stays behind, but a load cell would not."""
    assert isinstance(effect, HoleOffset)
    arm = float(np.mean(here.chain().offset[:, here.cable_names.index(effect.cable)]))
    left = f"hole offset of cable {effect.cable}, which is a fault of one part of this rig"
    if not arm or effect.cable not in there.cable_names:
        return left
    gain = f'kind = "load_cell", gain = {1 + effect.offset_m / arm:.4g} and cables = ["{effect.cable}"]'
    return f"{left}; if its load cell reads wrong instead, write an [[effect]] with {gain} into this design's file"


def _clearance(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `hole_clearance`: up to half of the largest lever arm, prior sd a tenth, as of
    `hole_offset`."""
    return (Free("clearance_m", 0.0, 0.0, 0.5 * scope.arm, scale=scope.arm, sd=0.1),)


CABLE_SUSPECTS = (
    Suspect(
        "dead_cable",
        sentence=lambda fitted: f"Cable {fitted.place['cable']} transmits nothing: broken, slipped off or never tied.",
        transfer=OF_A_PART,
        places=pulled_cables,
        presence=rare,
    ),
    Suspect(
        "tension_offset",
        sentence=lambda fitted: (
            f"The tension of {fitted.of_cables} is off by {fitted.size} N at every step{fitted.with_others(' N')}: "
            "check the zero of the force sensor."
        ),
        transfer=OF_THE_SETUP,
        places=together_and_alone,
        free=_zero,
        quantity=zero_of_cables,
        kinked=True,  # idle cables feel only what is added
    ),
    Suspect(
        "hanger",
        sentence=lambda fitted: (
            f"Every loaded cable is pulled by {fitted.size} N more than noted, idle ones by nothing: a hanger or pan "
            "was not weighed with the weights."
        ),
        transfer=OF_THE_SETUP,
        places=_hung,
        free=_weight,
        presence=rare,
    ),
    Suspect(
        "load_cell",
        sentence=_cell_sentence,
        transfer=OF_THE_SETUP,
        places=_cells,
        free=_cell,
        presence=rare,
    ),
    Suspect(
        "tension_play",
        sentence=lambda fitted: (
            f"The tension of {fitted.of_cables} lags by {fitted.size} N behind what is recorded, either way"
            f"{fitted.with_others(' N')}: look for a guide or a sheath that drags before the base, or for play in the "
            "load cell."
        ),
        transfer=OF_THE_SETUP,
        places=_reversed,
        free=_play,
        quantity=play_of_cables,
        presence=rare,
    ),
    Suspect(
        "tension_drift",
        sentence=lambda fitted: (
            f"The tension of {fitted.of_cables} is off by {fitted.size} N more with every further step"
            f"{fitted.with_others(' N')}: "
            "the zero of the force sensor drifts; read it without load before and after."
        ),
        transfer=OF_THE_COURSE,
        places=_drifting,
        free=_drift,
        quantity=drift_of_cables,
        kinked=True,
        presence=rare,
    ),
    Suspect(
        "hole_offset",
        sentence=lambda fitted: (
            f"Cable {fitted.place['cable']} runs {fitted.size.times(1e3)} mm off its nominal offset "
            "(added to the signed offset), or its load cell is wrong by as large a share of the tension, "
            "which looks the same."
        ),
        transfer=OF_A_PART,
        bench=_offset_or_load_cell,
        places=pulled_cables,
        free=_offset,
    ),
    Suspect(
        "hole_clearance",
        sentence=lambda fitted: (
            f"The cables have play in their holes and lie {fitted.size.times(1e3)} mm "
            "toward the inner side of the bend."
        ),
        transfer=with_the_same("disks", lambda manipulator: manipulator.disk.thickness_m),
        places=lambda scope: whole_rig_if(scope.arm > 0),
        free=_clearance,
    ),
)
