"""Suspects among the loads: unrecorded ones (gravity, the weight of the arm, a force or a mass at the tip, an
umbilical) and recorded ones of which friction takes a part."""

from collections.abc import Iterator

import numpy as np

from prb3r.diagnosis.library.alike import same_parts
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import (
    OF_THE_SETUP,
    Occurrence,
    Suspect,
    effect_in_words,
    left_behind,
    rare,
    unchanged,
)
from prb3r.diagnosis.library.totals import gravity_on_disks, load_of_disks
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.model.effects.loads import Gravity, SelfWeight, Umbilical
from prb3r.model.manipulator import Manipulator

STEEL_N_PER_M3 = 7.8e4
"""Weight of steel by volume: 7900 kg/m^3 times 9.81 m/s^2, rounded."""


def _of_the_mounting(effect: Effect, here: Manipulator, there: Manipulator) -> str:
    """The reason why weight stays behind, and what the file of the design `there` needs or has in its place."""
    falls = any(isinstance(own, Gravity) and (own.x_m_s2 or own.y_m_s2) for own in there.effect)
    instead = (
        "the gravity in the file of this design acts"
        if falls
        else "a design that is mounted alike needs gravity, and masses, in its file"
    )
    return f"{effect_in_words(effect)}, which goes with the way this rig was mounted; {instead}"


def _per_disk(effect: Effect, here: Manipulator, there: Manipulator) -> Effect:
    """The weight of an arm that is mounted alike, as heavy for each of its disks as that of the recording."""
    assert isinstance(effect, SelfWeight)
    share = there.plates / here.plates
    return effect.model_copy(update={"x_n": share * effect.x_n, "y_n": share * effect.y_n})


def _weighs_something(settings: Settings) -> float:
    """Prior probability that gravity acts in the plane: `Settings.weighing_presence`."""
    return settings.weighing_presence


def _in_any_direction(unit: str) -> tuple[Place, ...]:
    """Places of a load that points in any direction of the plane, or along one axis, as an arm mostly lies, hangs or
    stands: then its part along the other one is held at 0."""
    return {}, {f"y_{unit}": 0.0}, {f"x_{unit}": 0.0}


def _along(fitted: Occurrence, unit: str, in_words: str) -> str:
    """The fitted parts of a load along either axis in words, such as `9.8 m/s^2 along x`; none that is held at 0."""
    parts = ((axis, fitted.estimates.get(f"{axis}_{unit}")) for axis in "xy")
    return " and ".join(f"{size} {in_words} along {axis}" for axis, size in parts if size is not None)


def _gravity(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `gravity`: up to twice that of the earth along either axis, as the mass of disks is seldom
    known well; prior sd 7 m/s^2 for each, which makes the earth's of both.  Where the file has gravity, what is sought
    is beside it: up to as much again, prior sd 3 m/s^2, as masses are weighed within a third."""
    most, sd = (10.0, 0.3) if np.any(scope.manipulator.chain().gravity) else (20.0, 0.7)
    both = (Free(f"{axis}_m_s2", 0.0, -most, most, scale=10.0, sd=sd) for axis in "xy")
    return tuple(free for free in both if free.name not in place)


def _gravity_sentence(fitted: Occurrence) -> str:
    if fitted.total is None:
        return f"Gravity acts in the plane: {_along(fitted, 'm_s2', 'm/s^2')} on every disk's mass."
    return (
        f"Beside the gravity of the file {_along(fitted, 'm_s2', 'm/s^2')} act on every disk's mass, "
        f"{fitted.total:.3g} m/s^2 in all: the arm is heavier or lighter than the file says, or mounted at another "
        "angle."
    )


def _self_weight(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `self_weight`: along either axis up to the weight of a round bar of steel that reaches to the
    outermost cable; prior sd half of what the largest tension at the largest offset holds of an arm that lies, whose
    weight acts at half its length, since arms that cables hardly hold are not built; at most that bar."""
    bar = STEEL_N_PER_M3 * np.pi * scope.arm**2 * scope.chain.length
    size = min(scope.moment / scope.chain.length, bar)
    both = (Free(f"{axis}_n", 0.0, -bar, bar, scale=size, sd=1.0) for axis in "xy")
    return tuple(free for free in both if free.name not in place)


def _self_weight_sentence(fitted: Occurrence) -> str:
    return (
        f"The arm sags under its own weight, which the manipulator file leaves out: {_along(fitted, 'n', 'N')} in all, "
        "shared by the disks. Give disks and plates their masses (mass_kg), and gravity its direction."
    )


def _force(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `tip_force`: along either axis up to five times the force whose moment about the base is that
    of the largest tension at the largest offset; prior sd 0.3 times that force across the arm, and that force along
    it, as what hangs from an arm bends it little."""
    size = scope.moment / scope.chain.length
    prior = {"x": 1.0, "y": 0.3}
    both = (Free(f"{axis}_n", 0.0, -5 * size, 5 * size, scale=size, sd=sd) for axis, sd in prior.items())
    return tuple(free for free in both if free.name not in place)


def _force_sentence(fitted: Occurrence) -> str:
    return f"An unrecorded force of {_along(fitted, 'n', 'N')} acts at the tip."


def _tool(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `tip_mass`: from a last disk without its mass up to ten times the mass of the whole arm; prior
    sd that mass, as a gripper may well weigh as much."""
    masses = scope.manipulator.disk_masses
    arm = float(masses.sum())
    return (Free("mass_kg", 0.0, -0.999 * float(masses[-1]), 10 * arm, scale=arm, sd=1.0),)


def _tool_sentence(fitted: Occurrence) -> str:
    grams = fitted.size.times(1e3)
    if grams.value < 0:
        return f"The tip is lighter than noted, by {grams.less(0.0)} g."
    return f"The tip is heavier than noted, by {grams} g: a gripper, a camera, a hose or a wire hangs there."


def _angle(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `base_tilt`: half a radian at most; prior sd 0.05, three degrees, as more is seen by eye."""
    return (Free("angle_rad", 0.0, -0.5, 0.5, sd=0.05),)


def _tilt_sentence(fitted: Occurrence) -> str:
    degrees, way = fitted.size.times(180 / np.pi), "anticlockwise"
    if degrees.value < 0:
        degrees, way = degrees.less(0.0), "clockwise"
    return (
        f"The base stands tilted by {degrees} degrees, {way}, in the frame in which dead loads are noted: set it by a "
        "level, or note the loads in its own frame."
    )


def _tube_of_another_length(effect: Effect, here: Manipulator, there: Manipulator) -> Effect:
    """The transfer of `umbilical`: the same tube bent evenly has a couple in inverse proportion to its length."""
    assert isinstance(effect, Umbilical)
    length, other = here.chain().length, there.chain().length
    if same_parts([[length]], [[other]]):
        return effect
    stiffness = effect.stiffness_n_m_per_rad * length / other
    return effect.model_copy(update={"stiffness_n_m_per_rad": stiffness})


def _tube(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `umbilical`, in units of the stiffness in series of one mean node of every plate (4.4 times
    that of the plates in series on the elastica): prior sd 0.3, up to 10; a tube that is not felt is no umbilical."""
    stiff = 1 / float((scope.chain.arc / scope.mean_node_rigidity).sum())
    return (Free("stiffness_n_m_per_rad", 0.0, 0.0, 10 * stiff, scale=stiff, sd=0.3),)


def _share(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter `efficiency`: down to a twentieth, where the recorded load is hardly felt any more; prior sd 0.4
    of its logarithm, so mostly two thirds and more."""
    return (Free("efficiency", 1.0, 0.05, 1.0, log=True, sd=0.4),)


def _weights(scope: Scope) -> Iterator[Place]:
    """Places of `weight_friction`: all loaded disks together, if there are any, then, where there are several, each
    alone."""
    loaded = (np.flatnonzero(scope.recording.loads.force.any((0, 2))) + 1).tolist()
    yield from whole_rig_if(bool(loaded))
    if len(loaded) > 1:
        yield from ({"disk": disk} for disk in loaded)


def _payload(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `payload_scale`: up to ten times what is noted, a decimal point set wrongly; prior sd 0.5
    of its logarithm, so mostly less than three times.  What falls short of what is noted is `tip_load_friction` or
    `weight_friction`."""
    return (Free("scale", 1.0, 1.0, 10.0, log=True, sd=0.5),)


def _weight_sentence(fitted: Occurrence) -> str:
    where = f"disk {fitted.place['disk']}" if "disk" in fitted.place else "the disks"
    return (
        f"Of the recorded load on {where} only {fitted.size.times(100)} % arrives"
        f"{fitted.with_others(' %', lambda share: 100 * share)}: "
        "friction in the pulley over which the weight hangs."
    )


LOAD_SUSPECTS = (
    Suspect(
        "gravity",
        _gravity_sentence,
        _of_the_mounting,
        unchanged,
        quantity=gravity_on_disks,
        places=lambda scope: _in_any_direction("m_s2") if scope.manipulator.disk_masses.any() else (),
        free=_gravity,
        presence=_weighs_something,
    ),
    Suspect(
        "self_weight",
        _self_weight_sentence,
        _of_the_mounting,
        _per_disk,
        places=lambda scope: _in_any_direction("n") if scope.arm and not scope.manipulator.disk_masses.any() else (),
        free=_self_weight,
        presence=_weighs_something,
    ),
    Suspect(
        "tip_force",
        _force_sentence,
        OF_THE_SETUP,
        places=lambda scope: _in_any_direction("n"),
        free=_force,
        presence=rare,
    ),
    Suspect(
        "tip_mass",
        _tool_sentence,
        left_behind("hangs on the tip of this rig"),
        places=lambda scope: whole_rig_if(scope.weighs),
        free=_tool,
    ),
    Suspect(
        "base_tilt",
        _tilt_sentence,
        OF_THE_SETUP,
        places=lambda scope: whole_rig_if(scope.dead_loads_known),
        free=_angle,
        presence=rare,
    ),
    Suspect(
        "umbilical",
        sentence=lambda fitted: (
            f"A tube or bundle of wires through the middle turns the tip back with {fitted.size} N m/rad."
        ),
        transfer=_tube_of_another_length,
        free=_tube,
        presence=rare,
    ),
    Suspect(
        "tip_load_friction",
        sentence=lambda fitted: (
            f"Of the recorded tip load only {fitted.size.times(100)} % arrives: friction in its guide or pulley."
        ),
        transfer=OF_THE_SETUP,
        places=lambda scope: whole_rig_if(bool(scope.recording.loads.tip.any())),
        free=_share,
    ),
    Suspect("weight_friction", _weight_sentence, OF_THE_SETUP, places=_weights, free=_share, quantity=load_of_disks),
    Suspect(
        "payload_scale",
        sentence=lambda fitted: (
            f"The loads on tip and disks are {fitted.size} times as large as noted: weigh them again, "
            "with hanger and hook, or the force sensors of all cables read too much by as large a share, which looks "
            "alike."
        ),
        transfer=OF_THE_SETUP,
        places=lambda scope: whole_rig_if(scope.dead_loads_noted),
        free=_payload,
        presence=rare,
    ),
)
