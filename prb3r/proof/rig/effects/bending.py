"""Effects on how plates bend: laws other than Hooke's, and contact that limits the bend.

`nonlinear_plate` and `hysteretic_plate` change the relation of moment to k, curvature less stress-free curvature; EI
in it is the stiffness that the effects of `plates.py` leave.  `disk_contact` looks at the bend between two disks,
hinges of `clamp_compliance` included; its moment acts from disk to disk, past plate and hinges.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from prb3r.proof.rig.arrays import BILINEAR_LAW, CUBIC_LAW, SMOOTH_LAW
from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.candidate import Candidate, Conditions
from prb3r.proof.rig.effects.record import ANY, FRACTION, FROM_ZERO, POSITIVE, Record, Scale, number_in, one_of, size

BENT_TOWARD = "negative", "positive"
"""Sides toward which a plate bends: that of negative and that of positive offsets, the order of all (n, 2) arrays."""
THRESHOLDS = 0.2, 0.35, 0.5, 0.65, 0.8
"""Knees and contact angles of the candidates that represent all of their kind, in parts of the nominal manipulator's
largest curvature or bend.  A choice."""
THRESHOLD_RANGE = 0.25, 0.7
"""Least and largest knee or contact angle that is drawn, in the same parts.  A choice: several steps pass it, but not
all."""
SHARPNESS_RANGE = 1.5, 5.0
"""Least and largest exponent of a smooth knee that is drawn (R of Menegotto and Pinto, IABSE Symposium, Lisbon 1973).
A choice: from a knee that is spread over all curvatures to one that is nearly a corner."""


def _touch(draft: Draft, angle_rad, stiffness_n_m_per_rad):
    draft.contact_angle[:], draft.contact_stiffness[:] = angle_rad, stiffness_n_m_per_rad


def _close(draft: Draft, factor, stiffness_n_m_per_rad, side=None):
    """Notches close: a plate turns about its neutral axis until its edges meet where the cable runs."""
    for column, name in enumerate(BENT_TOWARD):
        if side in (None, name):
            arm = draft.arm[:, column]
            apart = arm + np.where(np.isnan(draft.fibre), 0.0, draft.fibre)
            closes = factor * draft.arc / np.where(arm > 0, apart, 1.0)
            draft.contact_angle[:, column] = np.where(arm > 0, closes, np.inf)
            draft.contact_stiffness[:, column] = stiffness_n_m_per_rad


def _touching(given: Conditions) -> Iterator[Candidate]:
    """Disks that touch, at each of the angles `THRESHOLDS`."""
    return (_contact(given, share * given.bend) for share in THRESHOLDS)


def _contact(given: Conditions, angle: float) -> Candidate:
    """Disks that touch at an angle (rad); the size is the contact stiffness over that of the first plate."""
    law = lambda u: {"angle_rad": angle, "stiffness_n_m_per_rad": u * given.stiffness}  # noqa: E731
    return Candidate((), law, 0, 30.0, (angle,))  # beyond thirty times a plate, a stop is hard


def _contact_anew(given: Conditions, form: Candidate, rng: np.random.Generator) -> Candidate:
    """Disks that touch at a random angle within `THRESHOLD_RANGE`."""
    return _contact(given, rng.uniform(*THRESHOLD_RANGE) * given.bend)


def _knee_there(given: Conditions, form: Candidate, size: float) -> Iterator[Candidate]:
    """Plates with a knee at the bend at which the disks of `form` touch: nearly the same law."""
    yield replace(_knee(given, form.shape[0] / given.arc), kind="nonlinear_plate")


def _follow_law(draft: Draft, law, side=None, sections=None, **numbers):
    """Give all plates a cubic, bilinear or smooth law; raises ValueError for parameters that do not go together."""
    knees = [name for name in ("knee_per_m", "knee_strain") if name in numbers]
    if sections is not None and knees != ["knee_per_m"]:
        raise ValueError("sections goes with knee_per_m")
    if law == "cubic" and set(numbers) == {"cubic_m2"} and side is None:
        draft.law, draft.law_first = CUBIC_LAW, numbers["cubic_m2"]
        return
    takes = {*knees, "ratio", "sharpness"} if law == "smooth" else {*knees, "ratio"}
    if law == "cubic" or len(knees) != 1 or set(numbers) != takes:
        raise ValueError(
            "law 'cubic' takes cubic_m2, law 'bilinear' takes knee_per_m or knee_strain and ratio, "
            "law 'smooth' takes sharpness too"
        )
    if knees == ["knee_strain"] and np.isnan(draft.fibre).any():
        raise ValueError("knee_strain needs the outer fibre of every plate")
    knee = numbers[knees[0]] / (draft.fibre if knees == ["knee_strain"] else np.ones(len(draft.arc)))
    if sections == "similar":
        knee = knee * np.sqrt(np.sqrt(draft.drawn_rigidity[0] / draft.drawn_rigidity))
    passed = np.array([side in (None, name) for name in BENT_TOWARD])
    draft.law = SMOOTH_LAW if law == "smooth" else BILINEAR_LAW
    draft.law_first = np.where(passed, knee[:, None], np.inf)
    draft.law_second, draft.law_third = numbers["ratio"], numbers.get("sharpness", np.inf)


def _few(value: object, _: Draft) -> str:
    """Check of a number of springs: 1, 2 or 3."""
    return "" if value in (1, 2, 3) else f"must be 1, 2 or 3, not {value!r}"


def _dissipate(draft: Draft, slipping_share, yield_per_m=None, yield_strain=None, elements=1):
    """Let springs that slip carry a share of the stiffness; each begins to slip at a curvature of its own."""
    if (yield_per_m is None) == (yield_strain is None):
        raise ValueError("hysteresis takes either yield_per_m or yield_strain")
    if yield_strain is not None and np.isnan(draft.fibre).any():
        raise ValueError("yield_strain needs the outer fibre of every plate")
    if slipping_share > 0:
        draft.loop_share, draft.loop_springs = slipping_share, elements
        draft.loop_yield = yield_per_m if yield_strain is None else yield_strain / draft.fibre


def _give_back_less(draft: Draft, reverse_ratio):
    draft.flag_reverse = reverse_ratio


def _dissipating(given: Conditions) -> Iterator[Candidate]:
    """One spring that slips at the least of `THRESHOLDS`: the form that represents all."""
    yield _loops(THRESHOLDS[0] * given.curvature * given.fibre, 1)


def _loops(strain: float, elements: int) -> Candidate:
    """Plates of one material whose springs slip at a strain of the outer fibre, in the mean; the size is the share of
    the stiffness that they carry."""
    given = {"yield_strain": strain, "elements": elements}
    return Candidate((), lambda u: given | {"slipping_share": u}, 0, 0.6, (strain, float(elements)))


def _loops_anew(given: Conditions, form: Candidate, rng: np.random.Generator) -> Candidate:
    """One to three springs that slip at a random strain."""
    return _loops(given.curvature * given.fibre * rng.uniform(*THRESHOLD_RANGE), int(rng.integers(1, 4)))


def _nonlinear(given: Conditions) -> Iterator[Candidate]:
    """A cubic law, and sharp and smooth knees at each of `THRESHOLDS`."""
    cubic = lambda u: {"cubic_m2": u / given.curvature**2}  # noqa: E731
    yield Candidate((("law", "cubic"),), cubic, 0, 3.0, variant="cubic")  # four times the moment at the largest bend
    for sharpness in (np.inf, 2.0):
        yield from (_knee(given, share * given.curvature, sharpness) for share in THRESHOLDS)


def _knee(given: Conditions, curvature: float, sharpness: float = np.inf) -> Candidate:
    """Plates of one material with a knee, at the first plate at a curvature (1/m); the size is ln(ratio)."""
    knee: dict[str, float] = {"knee_strain": curvature * given.fibre}
    variant = "bilinear" if np.isinf(sharpness) else "smooth"
    if variant == "smooth":
        knee["sharpness"] = sharpness
    law = lambda u: knee | {"ratio": float(np.exp(u))}  # noqa: E731
    # below a third of EI few designs keep their equilibria; beyond four times it the knee is a stop
    return Candidate((("law", variant),), law, -1.2, 1.5, (curvature, sharpness), variant)


def _knee_anew(given: Conditions, form: Candidate, rng: np.random.Generator) -> Candidate:
    """The law of `form` with a random knee, and a random sharpness if it is smooth; a cubic law as it is."""
    if form.variant == "cubic":
        return form
    curvature = given.curvature * rng.uniform(*THRESHOLD_RANGE)
    return _knee(given, curvature, np.inf if form.variant == "bilinear" else rng.uniform(*SHARPNESS_RANGE))


def _contact_there(given: Conditions, form: Candidate, size: float) -> Iterator[Candidate]:
    """Disks that touch at the bend of the knee of `form`: nearly the same law if the knee stiffens (`size` > 0)."""
    if form.variant == "bilinear" and size > 0:
        yield replace(_contact(given, form.shape[0] * given.arc), kind="disk_contact")


BENDING_RECORDS = (
    Record(
        "disk_contact",
        _touch,
        (size("angle_rad", FROM_ZERO), size("stiffness_n_m_per_rad", FROM_ZERO)),
        _touching,
        turn=8,
        once=True,
        reshaped=_contact_anew,
        twins=_knee_there,
        of_the_kind=True,
    ),
    Record(
        "notch_closing",  # never concealed: designs have no notches, and at a factor near one their plates never close
        _close,
        (
            size("factor", POSITIVE, Scale.LOGARITHM),
            size("stiffness_n_m_per_rad", FROM_ZERO),
            replace(one_of("side", BENT_TOWARD), optional=True),
        ),
        once=True,
    ),
    Record(
        "nonlinear_plate",
        _follow_law,
        (
            one_of("law", ("cubic", "bilinear", "smooth")),
            size("cubic_m2", ANY, optional=True),
            size("knee_per_m", POSITIVE, optional=True),
            size("ratio", POSITIVE, Scale.LOGARITHM, optional=True),
            size("knee_strain", POSITIVE, optional=True),
            size("sharpness", number_in(1, 100), optional=True),
            replace(one_of("side", BENT_TOWARD), optional=True),
            replace(one_of("sections", ("similar",)), optional=True),
        ),
        _nonlinear,
        turn=7,
        once=True,
        reshaped=_knee_anew,
        twins=_contact_there,
        of_the_kind=True,
    ),
    Record(
        "hysteretic_plate",
        _dissipate,
        (
            size("slipping_share", number_in(0, 0.95)),
            size("yield_per_m", POSITIVE, Scale.LOGARITHM, optional=True),
            size("yield_strain", POSITIVE, Scale.LOGARITHM, optional=True),
            size("elements", _few, optional=True),
        ),
        _dissipating,
        rare=True,
        once=True,
        excludes=frozenset({"nonlinear_plate"}),
        reshaped=_loops_anew,
        of_the_kind=True,
    ),
    Record(
        "flag_hysteresis",  # concealed beside a law that softens alone, without which it does nothing
        _give_back_less,
        (size("reverse_ratio", FRACTION, Scale.LOGARITHM),),
        once=True,
        excludes=frozenset({"hysteretic_plate"}),
    ),
)
