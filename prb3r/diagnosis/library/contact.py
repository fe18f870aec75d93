"""Contact between disks (`disk_contact`) and between the edges of notches (`notch_closing`) as suspects: their places,
free parameters with bounds, starting values, sentences, and how they are carried over."""

from collections.abc import Iterator

import numpy as np

from prb3r.diagnosis.library.alike import same_parts
from prb3r.diagnosis.library.bending import toward
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import Occurrence, effect_in_words
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import SIDE_COLUMN, SIDES, Effect
from prb3r.model.effects.plates import DiskContact, NotchClosing, closing_angles, closing_heights
from prb3r.model.manipulator import Manipulator


def _plate_stiffness(scope: Scope) -> float:
    """Median stiffness of the plates against the bend between their disks, N m/rad: 1.1 EI / l on the elastica."""
    stiffness = scope.chain.elastic_stiffness
    return float(np.median(stiffness.sum(1) / stiffness.shape[1] ** 2))


def contact_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `disk_contact`: disks touch between a fiftieth of the farthest bend and all of it, and the
    contact is from a thousandth as stiff as the plate, which is not felt, to ten thousand times as stiff, which is
    rigid."""
    bend, stiff = scope.farthest_bend, _plate_stiffness(scope)
    return (
        Free("angle_rad", bend / 2, bend / 50, bend, log=True),
        Free("stiffness_n_m_per_rad", stiff, stiff / 1e3, 1e4 * stiff, log=True),
    )


def contact_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Starting values: angles across the range of bends, each with disks that help a little and with disks that carry
    most.  Choice.  A fit begins from each, so that some begin on the right side of the angle at which disks touch."""
    bend, stiff = scope.farthest_bend, _plate_stiffness(scope)
    return tuple((share * bend, size * stiff) for share in (0.15, 0.4, 0.65, 0.85) for size in (0.3, 3.0))


def said_of_contact(fitted: Occurrence) -> str:
    degrees, stiffness = fitted.estimates["angle_rad"].times(180 / np.pi), fitted.estimates["stiffness_n_m_per_rad"]
    return (
        f"Beyond a bend of {degrees} degrees neighbouring disks touch, or another stop acts between them, and adds "
        f"{stiffness} N m/rad."
    )


def closing_places(scope: Scope) -> Iterator[Place]:
    """Places of `notch_closing`: each side to which plates bend so far that notches could close, and both together.

    Bends of the calibrated model and bends as read count alike, as plates that soften bend much further than calibrated
    constants let them.
    """
    angles = scope.settings.closing_range[0] * closing_angles(scope.chain.arc, scope.manipulator)
    bend = np.concatenate([scope.bend, scope.bend_read])
    most = np.nanmin(bend, axis=0, initial=0.0), np.nanmax(bend, axis=0, initial=0.0)
    sides = [side for side, bent, angle in zip(SIDES, most, angles.T, strict=True) if (np.abs(bent) > angle).any()]
    yield from ({"side": side} for side in sides)
    yield from whole_rig_if(len(sides) == 2)


def closing_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `notch_closing`: a factor on the closing angle that geometry gives, within
    `Settings.closing_range`, and a contact stiffness bounded as that of disks."""
    stiffness = contact_free(scope, place)[1]
    return (Free("factor", 1.0, *scope.settings.closing_range, log=True), stiffness)


def closing_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Starting values: near the closing angle that geometry gives, with edges that help a little and edges that carry
    most.  Choice."""
    stiff = _plate_stiffness(scope)
    return tuple((factor, size * stiff) for factor in (0.7, 1.0, 1.3) for size in (0.3, 3.0))


def said_of_closing(fitted: Occurrence) -> str:
    factor, stiffness = fitted.estimates["factor"], fitted.estimates["stiffness_n_m_per_rad"]
    return (
        f"The notches close{toward(fitted)} at {factor} times the bend that length, cable arm and outer fibre give, "
        f"and their edges then add {stiffness} N m/rad."
    )


def rim_of(contact: DiskContact, arc: np.ndarray) -> float:
    """Distance from the axis, m, of the rims of disks that touch first, between the shortest of plates of lengths `arc`
    (n,), m.

    On an arc of the length h the gap between two disks is h - r times the bend at the distance r from the axis.
    """
    return float(arc.min() / contact.angle_rad)


def is_impossible(contact: DiskContact, arc: np.ndarray, offset: np.ndarray, settings: Settings) -> bool:
    """Whether disks would have to reach farther than any disk does to touch so: something else acts then.

    `arc`, `offset`: of a `Chain`.
    """
    hole = float(np.abs(offset).max(initial=0.0))
    return contact.angle_rad > 0 and rim_of(contact, arc) > settings.impossible_rim * hole > 0


def contact_elsewhere(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """The transfer of `disk_contact`: disks as large as those of this rig touch at a bend in proportion to the gap
    between them, the length of a plate.  Where the plates of one arm alone differ in length, it is left behind, and
    where no disks can touch so."""
    assert isinstance(effect, DiskContact)
    chain = here.plain_chain()
    if is_impossible(effect, chain.arc, chain.offset, Settings()):
        named = effect_in_words(effect)
        return f"{named}, at a bend at which no disks touch: something else stiffens this rig, such as play in clamps"
    first, other = ([[segment.length_m] for segment in rig.segment] for rig in (here, there))
    if same_parts(first, other):
        return effect
    if not all(same_parts(lengths, lengths[:1]) for lengths in (first, other)):
        return f"{effect_in_words(effect)}, which belongs to the gaps between disks, and these differ"
    wider = other[0][0] / first[0][0]
    return effect.model_copy(update={"angle_rad": wider * effect.angle_rad})


def closing_elsewhere(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """The transfer of `notch_closing`: edges of the same material that touch are as stiff as the cube of the height at
    which they do, so that arms of one shape bend alike whatever their size.  Where one file alone states outer fibres,
    heights cannot be compared, and the arms of the cables stand for them."""
    assert isinstance(effect, NotchClosing)
    fibre = all(np.isfinite(rig.outer_fibre).all() for rig in (here, there))
    heights = [closing_heights(rig, fibre)[:, SIDE_COLUMN[effect.side]] for rig in (here, there)]
    if not all(np.any(known > 0) for known in heights):
        return effect  # without cables on its side no notch closes
    height, other = (np.mean(known[known > 0]) for known in heights)
    stiffness = effect.stiffness_n_m_per_rad * (other / height) ** 3
    return effect.model_copy(update={"stiffness_n_m_per_rad": float(stiffness)})
