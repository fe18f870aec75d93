"""Twins: models that predict nearly the same as a fitted one by another effect.

Such are one segment softer than stated, and another stiffer with a lower Young's modulus; plates that soften beyond a
knee that is a corner, beyond a smooth one, and on a plateau of their material; plates that slip at one bend, at
another, and little by little; plates that dissipate, and that soften and give back less than they took (two effects);
disks that touch, and notches that close.  A search that adds and exchanges one effect at a time stays with the twin
that it found first, since all other constants and effects have settled beside it.  Which twin is right decides what
another design does.

A special form of an effect, such as gravity along one axis, needs fewer parameters where it is right.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.model.effects.base import SIDE_COLUMN, Side
from prb3r.model.effects.plates import DiskContact, HystereticPlate, NonlinearPlate, NotchClosing, closing_angles

OF_SEGMENTS, OF_PLATEAUS = "segment_stiffness", "superelastic_plate"
OF_LOOPS, OF_FLAGS = "hysteretic_plate", "flag_hysteresis"
OF_KNEES, OF_DISKS, OF_NOTCHES = "nonlinear_plate", "disk_contact", "notch_closing"
SMOOTH_KNEE = 10.0
"""Sharpness from which the fit of a smooth knee begins at a corner: half of that beyond which both are the same."""


def twins_of(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """All twins of a fitted model, each fitted from parameters at which it predicts nearly the same."""
    for twins in (of_other_segments, of_corners, of_plateaus, of_loops, of_flags, of_stops):
        yield from twins(fitted, library)


def of_other_segments(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """Twins with the stiffness of another segment in the place of one, Young's modulus making up for it."""
    model, shares = fitted.model, fitted.model.shares(fitted.p)
    if "log_stiffness" not in model.varied:
        return
    others = [suspected for suspected in library if suspected.kind == OF_SEGMENTS]
    for k, replaced in enumerate(model.hypotheses):
        for other in others if replaced.kind == OF_SEGMENTS else ():
            if other == replaced:
                continue
            constants = fitted.p[: len(model.varied)].copy()
            constants[model.varied.index("log_stiffness")] += shares[k][0]  # the logarithm of a factor, as the constant
            yield from _with_another(fitted, k, other, -shares[k], constants)


def of_corners(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """Twins with a knee that is a corner in the place of a smooth one, or the other way round, at the same bend and of
    the same ratio of stiffnesses."""
    for k, effect in enumerate(fitted.effects):
        if not isinstance(effect, NonlinearPlate) or effect.ratio is None:
            continue
        place = dict(fitted.model.hypotheses[k].place) | {"law": "bilinear" if effect.sharpness else "smooth"}
        known = effect.model_dump() | {"sharpness": SMOOTH_KNEE}
        for other in library:
            if other.kind == OF_KNEES and dict(other.place) == place:
                yield from _with_another(fitted, k, other, np.array([free.at(known[free.name]) for free in other.free]))


def of_plateaus(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """Twins with superelastic plates (a stress plateau) in the place of plates that soften beyond a knee in strain."""
    plateau = next((suspected for suspected in library if suspected.kind == OF_PLATEAUS), None)
    for k, effect in enumerate(fitted.effects):
        if plateau is None or not isinstance(effect, NonlinearPlate) or effect.knee_strain is None:
            continue
        if (effect.ratio or 1.0) < 1:
            begun = np.zeros(len(plateau.free))
            begun[0] = plateau.free[0].at(effect.knee_strain / fitted.model.settings.knee_of_plateau)
            yield from _with_another(fitted, k, plateau, begun)


def of_loops(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """Twins with hysteretic plates that slip in another number of stages, or from another bend on; of every number the
    best fit."""
    friction = fitted.model.friction(fitted.p)
    others = [suspected for suspected in library if suspected.kind == OF_LOOPS]
    for k, replaced in enumerate(fitted.model.hypotheses):
        for other in others if replaced.kind == OF_LOOPS else ():
            ends = [end for begun in other.starts(friction) for end in _with_another(fitted, k, other, begun)]
            if ends:
                yield min(ends, key=lambda ended: ended.chi2)


def of_stops(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """Twins with closing notches in the place of touching disks, or the other way round, that stop plates at the same
    bend and as stiffly."""
    closing = closing_angles(fitted.solved.chain.arc, fitted.recording.manipulator)
    for k, effect in enumerate(fitted.effects):
        if not isinstance(effect, DiskContact | NotchClosing):
            continue
        for other in library:
            if {effect.kind, other.kind} == {OF_DISKS, OF_NOTCHES}:
                stop = _stop_as(effect, dict(other.place).get("side"), closing)
                begun = np.array([free.at(stop[free.name]) for free in other.free])
                yield from _with_another(fitted, k, other, begun)


def of_flags(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """Twins with two effects in the place of hysteretic plates: a law that softens all plates alike and flag-shaped
    loops (`flag_hysteresis`); of every such law the best fit."""
    model, friction = fitted.model, fitted.model.friction(fitted.p)
    present, shares, constants = model.hypotheses, model.shares(fitted.p), fitted.p[: len(model.varied)]
    flag = next((suspected for suspected in library if suspected.kind == OF_FLAGS), None)
    for k, effect in enumerate(fitted.effects):
        if flag is None or not isinstance(effect, HystereticPlate):
            continue
        before, behind = (*present[:k], *present[k + 1 :]), np.concatenate([constants, *shares[:k], *shares[k + 1 :]])
        for law in library:
            begun = _softening_as(law, effect, model.settings.knee_of_plateau)
            if begun is None or any(law.excludes(other) for other in before):
                continue
            twin = replace(model, hypotheses=(*before, law, flag))
            starts = [np.concatenate([behind, begun, loop]) for loop in flag.starts(friction)]
            ends = [fit(twin, np.clip(start, *twin.bounds(start))) for start in starts]
            if any(ends):
                yield min((ended for ended in ends if ended is not None), key=lambda ended: ended.chi2)


def in_special_forms(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """Fits of a model with a special form in the place of an effect that generalises it, as gravity along one axis."""
    friction = fitted.model.friction(fitted.p)
    for k, (effect, general) in enumerate(zip(fitted.effects, fitted.model.hypotheses, strict=True)):
        for special in library:
            if general.generalises(special):
                begun = [free.at(getattr(effect, free.name), friction) for free in special.free]
                yield from _with_another(fitted, k, special, np.array(begun))


def _with_another(
    fitted: Fit, number: int, other: Hypothesis, begun: np.ndarray, constants: np.ndarray | None = None
) -> Iterator[Fit]:
    """The fit of a model with another hypothesis in the place of effect `number`, if it can stand beside all others
    and can be fitted.

    Parameters
    ----------
    begun : (k,) parameters of the other hypothesis that the fit begins from.
    constants : (c,) constants that it begins from; those of `fitted` if absent.
    """
    model, shares = fitted.model, fitted.model.shares(fitted.p)
    constants = fitted.p[: len(model.varied)] if constants is None else constants
    before, behind = model.hypotheses[:number], model.hypotheses[number + 1 :]
    if any(other.excludes(beside) for beside in (*before, *behind)):
        return
    twin = replace(model, hypotheses=(*before, other, *behind))
    start = np.concatenate([constants, *shares[:number], begun, *shares[number + 1 :]])
    if (ended := fit(twin, np.clip(start, *twin.bounds(start)))) is not None:
        yield ended


def _stop_as(stop: DiskContact | NotchClosing, side: Side | None, closing: np.ndarray) -> dict[str, float]:
    """Parameters of the other stop: of disks that touch where notches close, or of notches that close toward `side`
    where disks touch; in the median of the plates, as disks touch at one bend and notches at that of their geometry.

    `closing` (n, 2) are the bends at which geometry has the notches close.
    """
    stiffness = {"stiffness_n_m_per_rad": stop.stiffness_n_m_per_rad}
    if isinstance(stop, DiskContact):
        return {"factor": stop.angle_rad / _median_of(closing, side)} | stiffness
    return {"angle_rad": stop.factor * _median_of(closing, stop.side)} | stiffness


def _median_of(closing: np.ndarray, side: Side | None) -> float:
    """Median of the finite bends toward `side`, or to both."""
    bends = closing[:, SIDE_COLUMN[side]]
    return float(np.median(bends[np.isfinite(bends)]))


def _softening_as(law: Hypothesis, effect: HystereticPlate, knee_of_plateau: float) -> np.ndarray | None:
    """Start (k,) of a softening law: its knee or plateau is where hysteretic plates begin to slip, its stiffness beyond
    is their share that does not slip.  None for a law that does not soften all plates alike."""
    begins = effect.yield_per_m if effect.yield_strain is None else effect.yield_strain
    if begins is None or {name for name, _ in law.place} - {"law", "sections"}:
        return None
    if law.kind == OF_PLATEAUS:
        known = {"plateau_strain": begins / knee_of_plateau}
    elif law.kind == OF_KNEES and any(free.name == "ratio" for free in law.free):
        known = {"knee_strain": begins, "knee_per_m": begins, "ratio": 1 - effect.slipping_share}
    else:
        return None
    return np.array([free.at(known.get(free.name, free.null)) for free in law.free])
