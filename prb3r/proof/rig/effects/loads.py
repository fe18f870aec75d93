"""Effects of loads: those that nobody applied, and applied ones of which only a part arrives.

`gravity` pulls at the centres of disks 1..n, and there on a `tip_mass`; `self_weight` pulls at them all alike;
`tip_load_friction` does not act on the constant `tip_force`.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.candidate import Candidate, Conditions
from prb3r.proof.rig.effects.record import ANY, FRACTION, FROM_ZERO, Record, Scale, one_of, size

GRAVITY = 12.0
"""Largest gravity that is concealed, m/s^2.  A choice: all of the earth's in the plane, and a fifth more for disks that
are heavier than noted."""


def _weigh(draft: Draft, x_m_s2=0.0, y_m_s2=0.0):
    if np.isnan(draft.mass).all():
        raise ValueError("needs mass_kg in [disk]")
    draft.gravity += [x_m_s2, y_m_s2]
    draft.disk_force += np.outer(draft.mass, [x_m_s2, y_m_s2])


def _weighing(given: Conditions) -> Iterator[Candidate]:
    return (_gravity(angle) for angle in (0.0, np.pi / 2))


def _gravity(angle: float) -> Candidate:
    return _directed("x_m_s2", "y_m_s2", GRAVITY, angle)


def _gravity_anew(given: Conditions, form: Candidate, rng: np.random.Generator) -> Candidate:
    return _gravity(rng.uniform(0, 2 * np.pi))


def _hang(draft: Draft, mass_kg):
    draft.disk_force[-1] += mass_kg * draft.gravity


def _bear(draft: Draft, x_n=0.0, y_n=0.0):
    draft.disk_force += np.array([x_n, y_n]) / len(draft.disk_force)


def _push(draft: Draft, x_n=0.0, y_n=0.0):
    draft.tip_force += [x_n, y_n]


def _pushing(given: Conditions) -> Iterator[Candidate]:
    return (_tip_force(given, angle) for angle in (0.0, np.pi / 2))


def _tip_force(given: Conditions, angle: float) -> Candidate:
    return _directed("x_n", "y_n", given.tip, angle)


def _tip_force_anew(given: Conditions, form: Candidate, rng: np.random.Generator) -> Candidate:
    return _tip_force(given, rng.uniform(0, 2 * np.pi))


def _directed(x: str, y: str, largest: float, angle: float) -> Candidate:
    """A vector in one direction (rad), of the two parameters `x` and `y`; its size is in units of the largest."""
    cos, sin = float(np.cos(angle)), float(np.sin(angle))
    return Candidate((), lambda u: {x: u * largest * cos, y: u * largest * sin}, 0, 1.0, (angle,))


def _hold_back(draft: Draft, efficiency):
    draft.tip_efficiency *= efficiency


def _held_back(given: Conditions) -> Iterator[Candidate]:
    if given.tip_loaded:
        # a third arrives: a weight hung over a seized pulley
        yield Candidate((), lambda u: {"efficiency": float(np.exp(-u))}, 0, 1.2)


def _hold_weights(draft: Draft, efficiency, disk=None):
    draft.disk_efficiency[slice(None) if disk is None else disk - 1] *= efficiency


def _weigh_again(draft: Draft, scale):
    draft.tip_efficiency *= scale
    draft.disk_efficiency *= scale


def _weighed_wrongly(given: Conditions) -> Iterator[Candidate]:
    if given.tip_loaded:
        # up to three times as much: one weight noted of three
        yield Candidate((), lambda u: {"scale": float(np.exp(u))}, 0, 1.1)


def _tether(draft: Draft, stiffness_n_m_per_rad):
    draft.umbilical += stiffness_n_m_per_rad


def _tethered(given: Conditions) -> Iterator[Candidate]:
    # a hose as stiff as the plates, from end to end
    yield Candidate((), lambda u: {"stiffness_n_m_per_rad": u * given.rigidity / given.length}, 0, 1.0)


def _lean(draft: Draft, angle_rad):
    draft.tilt += angle_rad


def _leaning(given: Conditions) -> Iterator[Candidate]:
    if given.tip_loaded:  # nine degrees: any eye sees that
        yield Candidate((), lambda u: {"angle_rad": u}, -0.15, 0.15)


LOAD_RECORDS = (
    Record(
        "gravity",
        _weigh,
        (size("x_m_s2", ANY, optional=True), size("y_m_s2", ANY, optional=True)),
        _weighing,
        turn=12,
        vector=True,
        reshaped=_gravity_anew,
    ),
    # never concealed: every nominal design has masses
    Record("self_weight", _bear, (size("x_n", ANY, optional=True), size("y_n", ANY, optional=True)), vector=True),
    Record(
        "tip_force",
        _push,
        (size("x_n", ANY, optional=True), size("y_n", ANY, optional=True)),
        _pushing,
        turn=13,
        vector=True,
        reshaped=_tip_force_anew,
    ),
    Record("tip_mass", _hang, (size("mass_kg"),)),  # never concealed: no nominal design has gravity
    Record("base_tilt", _lean, (size("angle_rad"),), _leaning, rare=True),
    Record("umbilical", _tether, (size("stiffness_n_m_per_rad", FROM_ZERO),), _tethered, rare=True),
    Record(
        "tip_load_friction",
        _hold_back,
        (size("efficiency", FRACTION, Scale.LOGARITHM),),
        _held_back,
        turn=14,
    ),
    Record(
        "weight_friction",
        _hold_weights,
        (size("efficiency", FRACTION, Scale.LOGARITHM), replace(one_of("disk", "plates"), optional=True)),
    ),
    Record(
        "payload_scale",
        _weigh_again,
        (size("scale", FROM_ZERO, Scale.LOGARITHM),),
        _weighed_wrongly,
        rare=True,
    ),
)
