"""Effects of friction at holes and pulleys.

`pulley_friction` is one more factor at the base hole and shares its slip state.  `cable_friction` replaces the nominal
coefficient at every hole of its cables; `worn_hole` replaces what then holds at one disk.  All coefficients depend on
the tension by `load_dependent_friction`, on its rate of change by `rate_dependent_friction`, on its change since the
cable began to slide its present way by `breakaway_friction`, and on the number of steps by `friction_drift`; the last
three act on pulleys too.  `wrap_saturation` changes the wrap angle that counts.
`hole_drag` is a force of every hole on its own.
"""

from collections.abc import Iterator

import numpy as np

from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.candidate import Candidate, Conditions
from prb3r.proof.rig.effects.record import (
    FRACTION,
    FROM_ZERO,
    POSITIVE,
    Record,
    Scale,
    number_in,
    one_of,
    several,
    size,
)

PRESLIDINGS = 4e-5, 2e-4
"""Presliding lengths at which `slip_history` is tried, m: in the lower and upper part of `SLIP_RANGE`."""
SLIP_RANGE = -4.5, -3.7
"""Least and largest decimal logarithm of the presliding lengths (m) that are drawn: 30 to 200 micrometres.  A choice:
from what manipulator files have unless they say more to a cable six times as soft in its holes."""


def _rub(draft: Draft, coefficient, cables=None):
    draft.friction[:, draft.columns(cables)] = coefficient


def _rubbing(given: Conditions) -> Iterator[Candidate]:
    mu = given.friction
    for place in given.of_cables():
        if place or mu == 0:
            # from a cable without friction to 0.6 more than nominal, the coefficient of dry steel on steel
            yield Candidate(place, lambda u: {"coefficient": mu + u}, -mu, 0.6)


def _follow(draft: Draft, presliding_m):
    draft.presliding = presliding_m


def _following(given: Conditions) -> Iterator[Candidate]:
    if given.friction > 0 and given.declared:
        yield from map(_slipping, PRESLIDINGS)


def _slipping(presliding: float) -> Candidate:
    return Candidate((), lambda u: {"presliding_m": presliding}, shape=(presliding,))


def _slipping_anew(given: Conditions, form: Candidate, rng: np.random.Generator) -> Candidate:
    return _slipping(10 ** rng.uniform(*SLIP_RANGE))


def _count_edges(draft: Draft):
    draft.edges = True


def _counting_edges(given: Conditions) -> Iterator[Candidate]:
    if given.friction > 0 and given.declared:
        yield Candidate()


def _wear(draft: Draft, disk, coefficient, cables=None):
    draft.friction[disk, draft.columns(cables)] = coefficient


def _worn(given: Conditions) -> Iterator[Candidate]:
    mu = given.friction
    for disk in range(given.plates):
        for place in given.of_cables():
            if disk < min((given.reach[name] for _, names in place for name in names), default=given.plates):
                # from a hole that does not rub at all to one that is cut by its cable
                yield Candidate((("disk", disk), *place), lambda u: {"coefficient": mu + u}, -mu, 2.0)


def _weaken_with_load(draft: Draft, exponent, tension_n):
    draft.friction_exponent, draft.friction_tension = exponent, tension_n


def _weakening(given: Conditions) -> Iterator[Candidate]:
    if given.friction > 0:  # Hertzian contact has a third at most
        yield Candidate((), lambda u: {"exponent": u, "tension_n": given.pull / 2}, 0, 0.4)


def _rub_faster(draft: Draft, rate, reference_n_per_s=1.0):
    if np.isfinite(draft.presliding):
        raise ValueError("friction that goes by rates needs declared slip")
    draft.friction_rate, draft.friction_reference = rate, reference_n_per_s


def _stick(draft: Draft, excess, decay_n):
    if np.isfinite(draft.presliding):
        raise ValueError("static friction that slip takes away needs declared slip")
    draft.friction_excess, draft.friction_decay = excess, decay_n


def _sticking(given: Conditions) -> Iterator[Candidate]:
    if given.friction > 0 and given.declared:  # at most twice the kinetic friction
        yield Candidate((), lambda u: {"excess": u, "decay_n": given.pull / 5}, 0, 1.0)


def _wear_on(draft: Draft, share_per_step):
    if np.isfinite(draft.presliding):
        raise ValueError("friction that grows with every step needs declared slip")
    draft.friction_growth += share_per_step


def _wearing_on(given: Conditions) -> Iterator[Candidate]:
    if given.friction > 0 and given.declared and given.steps > 1:  # at most twice as much in the end
        yield Candidate((), lambda u: {"share_per_step": u / given.steps}, -0.6, 1.0)


def _saturate(draft: Draft, saturation_per_rad):
    draft.wrap_saturation = saturation_per_rad


def _saturating(given: Conditions) -> Iterator[Candidate]:
    if given.friction > 0:  # at most: the largest turns count a third
        yield Candidate((), lambda u: {"saturation_per_rad": u / given.bend}, 0, 2.0)


def _drag(draft: Draft, drag_n):
    draft.hole_drag += drag_n


def _dragging(given: Conditions) -> Iterator[Candidate]:
    # at most four tenths of the largest tension is lost on the way to the last of all holes
    yield Candidate((), lambda u: {"drag_n": u * given.pull / given.plates}, 0, 0.4)


def _lose(draft: Draft, efficiency, cables=None):
    draft.pulley[draft.columns(cables)] -= np.log(efficiency)


def _losing(given: Conditions) -> Iterator[Candidate]:
    for place in given.of_cables():
        # at most nearly half is lost, as of a rope around a post for a third of a turn at mu 0.3
        yield Candidate(place, lambda u: {"efficiency": float(np.exp(-u))}, 0, 0.6)


FRICTION_RECORDS = (
    Record(
        "cable_friction",
        _rub,
        (size("coefficient", FROM_ZERO, Scale.EXCESS), several("cables", "cables")),
        _rubbing,
        turn=17,
        of_the_kind=True,
    ),
    Record(
        "slip_history",
        _follow,
        (size("presliding_m", POSITIVE, Scale.LOGARITHM),),
        _following,
        turn=18,
        once=True,
        reshaped=_slipping_anew,
        of_the_kind=True,
    ),
    Record("edge_wrap", _count_edges, (), _counting_edges, turn=19, once=True, of_the_kind=True),
    Record(
        "worn_hole",
        _wear,
        (one_of("disk", "disks"), size("coefficient", FROM_ZERO, Scale.EXCESS), several("cables", "cables")),
        _worn,
        turn=2,
    ),
    Record(
        "load_dependent_friction",
        _weaken_with_load,
        (size("exponent", number_in(-1, 1)), size("tension_n", POSITIVE)),
        _weakening,
        rare=True,
        once=True,
        of_the_kind=True,
    ),
    Record(
        "rate_dependent_friction",
        _rub_faster,  # never concealed: drawn programs have no times
        (size("rate", number_in(-0.5, 0.5)), size("reference_n_per_s", POSITIVE, optional=True)),
        rare=True,
        once=True,
        excludes=frozenset({"slip_history"}),
    ),
    Record(
        "breakaway_friction",
        _stick,
        (size("excess", FROM_ZERO), size("decay_n", POSITIVE)),
        _sticking,
        rare=True,
        once=True,
        excludes=frozenset({"slip_history"}),
        of_the_kind=True,
    ),
    Record(
        "friction_drift",
        _wear_on,
        (size("share_per_step", number_in(-1, 1)),),
        _wearing_on,
        rare=True,
        excludes=frozenset({"slip_history"}),
    ),
    Record(
        "wrap_saturation",
        _saturate,
        (size("saturation_per_rad", FROM_ZERO),),
        _saturating,
        rare=True,
        once=True,
        of_the_kind=True,
    ),
    Record("hole_drag", _drag, (size("drag_n", FROM_ZERO),), _dragging, rare=True, of_the_kind=True),
    Record(
        "pulley_friction",
        _lose,
        (size("efficiency", FRACTION, Scale.LOGARITHM), several("cables", "cables")),
        _losing,
        turn=1,
        of_the_kind=True,
    ),
)
