"""Effects of plates: their stiffness, their stress-free shape, and the compliance of their clamps.

Bending stiffness of a plate: nominal, times every `weakened_plate`, `segment_stiffness` and `stiffness_gradient`, plus
`cable_bending`.  A hinge turns by its compliance times the moment that the plate carries there.
"""

from collections.abc import Iterator

import numpy as np

from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.bending import BENDING_RECORDS
from prb3r.proof.rig.effects.candidate import Candidate, Conditions, RigPlace
from prb3r.proof.rig.effects.record import FROM_ZERO, POSITIVE, Record, Scale, number_in, one_of, several, size


def _factor(u: float) -> dict[str, float]:
    """The parameter `factor` of a size, its logarithm."""
    return {"factor": float(np.exp(u))}


def _weaken(draft: Draft, plate, factor):
    draft.rigidity[plate - 1] *= factor


def _weakened(given: Conditions) -> Iterator[Candidate]:
    for plate in range(1, given.plates + 1):
        yield Candidate((("plate", plate),), _factor, -1.4, 1.1)  # cracked to a quarter; three for one


def _stiffen(draft: Draft, segment, factor):
    draft.rigidity[draft.segment_of == segment] *= factor


def _stiffened(given: Conditions) -> Iterator[Candidate]:
    if len(given.segments) > 1:
        for number in range(1, len(given.segments) + 1):
            yield Candidate((("segment", number),), _factor, -1.0, 1.0)  # e = 1.4^3: a thickness wrong by 40 %


def _steadily(draft: Draft) -> np.ndarray:
    """(n,) from -1/2 at plate 1 to 1/2 at the last one; a single plate has no other to differ from."""
    return np.linspace(-0.5, 0.5, len(draft.rest)) if len(draft.rest) > 1 else np.zeros(1)


def _taper(draft: Draft, tip_to_base):
    draft.rigidity *= np.exp(np.log(tip_to_base) * _steadily(draft))


def _tapered(given: Conditions) -> Iterator[Candidate]:
    if given.plates > 1:  # a tip half as stiff as the base, or twice
        yield Candidate((), lambda u: {"tip_to_base": float(np.exp(u))}, -0.7, 0.7)


def _curve(draft: Draft, curvature_per_m, plates=None):
    draft.rest[slice(None) if plates is None else np.unique(plates) - 1] += curvature_per_m


def _curved(given: Conditions) -> Iterator[Candidate]:
    """Rest curvature of each plate alone, of all together, and of each segment where there are several."""
    ends = np.cumsum(given.segments).tolist()
    places: list[RigPlace] = [(("plates", (plate,)),) for plate in range(1, given.plates + 1)]
    places.append(())
    if len(ends) > 1:
        for count, end in zip(given.segments, ends, strict=True):
            places.append((("plates", tuple(range(end - count + 1, end + 1))),))
    for place in places:
        # with more, the unloaded arm would visibly not be straight
        yield Candidate(place, lambda u: {"curvature_per_m": u * given.curvature}, -0.6, 0.6)


def _bow(draft: Draft, change_per_m):
    draft.rest += change_per_m * _steadily(draft)


def _bowed(given: Conditions) -> Iterator[Candidate]:
    if given.plates > 1:  # half of it at either end, so that ends are bent as much as one plate may be
        yield Candidate((), lambda u: {"change_per_m": u * given.curvature}, -1.2, 1.2)


def _give(draft: Draft, compliance_rad_per_n_m):
    draft.compliance += compliance_rad_per_n_m


def _giving(given: Conditions) -> Iterator[Candidate]:
    # hinges as soft as the plate between them
    yield Candidate((), lambda u: {"compliance_rad_per_n_m": u * given.arc / given.rigidity}, 0, 1.0)


def _give_way_at_base(draft: Draft, compliance_rad_per_n_m):
    draft.base_compliance += compliance_rad_per_n_m


def _giving_at_base(given: Conditions) -> Iterator[Candidate]:
    # at most a screw that turns twice as far as the first plate bends
    yield Candidate((), lambda u: {"compliance_rad_per_n_m": u * given.arc / given.rigidity}, 0, 2.0)


def _soften(draft: Draft, share_per_step):
    draft.softening += share_per_step


def _softening(given: Conditions) -> Iterator[Candidate]:
    # polymer plates creep: a third softer at the last step
    yield Candidate((), lambda u: {"share_per_step": u / given.steps}, 0, 0.3)


def _relax(draft: Draft, share, steps, step_s=None):
    draft.relaxation, draft.relaxation_time, draft.relaxation_step = share, steps, step_s or 0.0


def _relaxing(given: Conditions) -> Iterator[Candidate]:
    """Plates that relax over four steps: the form that represents all."""
    yield _within(4.0)


def _within(steps: float) -> Candidate:
    """Plates that relax with a time constant in steps; the size is the share that they lose: half at most."""
    return Candidate((), lambda u: {"share": u, "steps": steps}, 0, 0.5, (steps,))


def _relaxing_anew(given: Conditions, form: Candidate, rng: np.random.Generator) -> Candidate:
    """Plates that relax over two to twelve steps: of faster ones all is lost before a step is read."""
    return _within(float(np.exp(rng.uniform(np.log(2), np.log(12)))))


PLATE_RECORDS = (
    Record(
        "base_compliance",
        _give_way_at_base,
        (size("compliance_rad_per_n_m", FROM_ZERO),),
        _giving_at_base,
        rare=True,
    ),
    Record(
        "plate_relaxation",
        _relax,
        (size("share", number_in(0, 0.95)), size("steps", POSITIVE, Scale.LOGARITHM), size("step_s", optional=True)),
        _relaxing,
        rare=True,
        once=True,
        of_the_kind=True,
        excludes=frozenset({"hysteretic_plate", "flag_hysteresis"}),
        reshaped=_relaxing_anew,
    ),
    Record("plate_softening", _soften, (size("share_per_step", number_in(-1, 1)),), _softening, rare=True),
    Record(
        "weakened_plate",
        _weaken,
        (one_of("plate", "plates"), size("factor", POSITIVE, Scale.LOGARITHM)),
        _weakened,
        turn=0,
    ),
    Record(
        "segment_stiffness",
        _stiffen,
        (one_of("segment", "segments"), size("factor", POSITIVE, Scale.LOGARITHM)),
        _stiffened,
        turn=6,
    ),
    Record(
        "stiffness_gradient",
        _taper,
        (size("tip_to_base", POSITIVE, Scale.LOGARITHM),),
        _tapered,
        rare=True,
    ),
    Record("precurvature", _curve, (size("curvature_per_m"), several("plates", "plates")), _curved, turn=3),
    Record("precurvature_gradient", _bow, (size("change_per_m"),), _bowed, rare=True),
    *BENDING_RECORDS,
    Record("clamp_compliance", _give, (size("compliance_rad_per_n_m", FROM_ZERO),), _giving, turn=9, of_the_kind=True),
)
