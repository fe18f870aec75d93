"""Effects of cables: their tensions, where they run, and their own bending stiffness.

`hole_clearance` shifts both ends of a span toward the concave side, +y of the plate's frame where the bend is
positive; angles and lengths are those of the shifted spans; the change of offset inside a disk is free of friction.
`cable_bending` lays an elastic wire beside a plate for each live cable that crosses it.  `load_cell` turns noted into
true tensions and `hanger` adds to them where any is noted, before `tension_play` lets these lag and `tension_offset`
and `tension_drift` add to them.
"""

from collections.abc import Iterator

import numpy as np

from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.candidate import Candidate, Conditions
from prb3r.proof.rig.effects.record import ANY, FROM_ZERO, POSITIVE, Record, Scale, one_of, several, size


def _kill(draft: Draft, cable):
    draft.reach[draft.cables.index(cable)] = 0


def _dead(given: Conditions) -> Iterator[Candidate]:
    return (Candidate((("cable", name),)) for name in given.reach)


def _preload(draft: Draft, offset_n, cables=None):
    draft.tension_offset[draft.columns(cables)] += offset_n


def _preloaded(given: Conditions) -> Iterator[Candidate]:
    for place in given.of_cables():
        for low, high in ((0.0, 0.3), (-0.3, 0.0)):  # two ranges: from an idle cable nothing can be taken away
            yield Candidate(place, lambda u: {"offset_n": u * given.pull}, low, high)  # a hanger not weighed


def _misread(draft: Draft, gain=1.0, quadratic_per_n=0.0, cables=None):
    draft.gain[draft.columns(cables)] *= gain
    draft.gain_per_n[draft.columns(cables)] += quadratic_per_n


def _misreading(given: Conditions) -> Iterator[Candidate]:
    for name in given.reach:  # a gain of all cables alike would be the same as another Young's modulus
        yield Candidate((("cables", (name,)),), lambda u: {"gain": float(np.exp(u))}, -0.2, 0.2, variant="gain")
    yield Candidate((), lambda u: {"quadratic_per_n": u / given.pull}, -0.2, 0.2, variant="bent")


def _lag(draft: Draft, play_n, cables=None):
    draft.tension_play[draft.columns(cables)] += play_n


def _lagging(given: Conditions) -> Iterator[Candidate]:
    for place in given.of_cables():  # a pulley or a sheath that sticks
        yield Candidate(place, lambda u: {"play_n": u * given.pull}, 0, 0.1)


def _drift(draft: Draft, offset_n_per_step, cables=None):
    draft.tension_drift[draft.columns(cables)] += offset_n_per_step


def _drifting(given: Conditions) -> Iterator[Candidate]:
    # at the last step as much as the largest `tension_offset`
    yield Candidate((), lambda u: {"offset_n_per_step": u * given.pull / given.steps}, -0.3, 0.3)


def _hang(draft: Draft, weight_n, cables=None):
    draft.hanger[draft.columns(cables)] += weight_n


def _hanging(given: Conditions) -> Iterator[Candidate]:
    yield Candidate((), lambda u: {"weight_n": u * given.pull}, 0, 0.3)  # as much as `tension_offset`


def _shift(draft: Draft, cable, offset_m):
    draft.offset[:, draft.cables.index(cable)] += offset_m


def _shifted(given: Conditions) -> Iterator[Candidate]:
    for name in given.reach:
        # 8 mm on the prototype, whose rows of holes are 4.5 mm apart
        yield Candidate((("cable", name),), lambda u: {"offset_m": u * given.arm}, -0.3, 0.3)


def _loosen(draft: Draft, clearance_m):
    draft.clearance += clearance_m


def _loose(given: Conditions) -> Iterator[Candidate]:
    yield Candidate((), lambda u: {"clearance_m": u * given.arm}, 0, 0.25)  # 6 mm of play on the prototype


def _add_stiffness(draft: Draft, stiffness_n_m2):
    draft.wires += stiffness_n_m2 * (np.arange(len(draft.rigidity))[:, None] < draft.reach).sum(1)


def _stiff(given: Conditions) -> Iterator[Candidate]:
    # of one cable: two in a segment more than double its plates
    yield Candidate((), lambda u: {"stiffness_n_m2": u * given.rigidity}, 0, 0.6)


CABLE_RECORDS = (
    Record("dead_cable", _kill, (one_of("cable", "cables"),), _dead, turn=20),
    Record("tension_offset", _preload, (size("offset_n"), several("cables", "cables")), _preloaded, turn=4),
    Record("hanger", _hang, (size("weight_n", FROM_ZERO), several("cables", "cables")), _hanging, rare=True),
    Record(
        "load_cell",
        _misread,
        (
            size("gain", POSITIVE, Scale.LOGARITHM, optional=True),
            size("quadratic_per_n", ANY, optional=True),
            several("cables", "cables"),
        ),
        _misreading,
        rare=True,
    ),
    Record("tension_play", _lag, (size("play_n", FROM_ZERO), several("cables", "cables")), _lagging, rare=True),
    Record("tension_drift", _drift, (size("offset_n_per_step"), several("cables", "cables")), _drifting, rare=True),
    Record("hole_offset", _shift, (one_of("cable", "cables"), size("offset_m")), _shifted, turn=5),
    Record("hole_clearance", _loosen, (size("clearance_m", FROM_ZERO),), _loose, turn=11, of_the_kind=True),
    Record("cable_bending", _add_stiffness, (size("stiffness_n_m2", FROM_ZERO),), _stiff, turn=10, of_the_kind=True),
)
