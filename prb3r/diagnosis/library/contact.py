"""Contact between disks and between the edges of notches as suspects: from which bend on, how hard, what is said."""

from collections.abc import Iterator

import numpy as np

from prb3r.diagnosis.library.bending import toward
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import Occurrence
from prb3r.model.effects.base import SIDES
from prb3r.model.effects.plates import closing_angles
from prb3r.model.manipulator import Manipulator


def _plate_stiffness(scope: Scope) -> float:
    """Stiffness of a plate against the bend between its disks, N m/rad: 1.1 EI / l on the elastica."""
    return float(np.median(scope.chain.stiffness.sum(1) / scope.chain.stiffness.shape[1] ** 2))


def contact_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Disks touch between a fiftieth of the largest bend and all of it, and are from a thousandth as stiff as the
    plate, which is not felt, to ten thousand times, which is rigid beside it."""
    bend, stiff = scope.largest_bend, _plate_stiffness(scope)
    return (
        Free("angle_rad", bend / 2, bend / 50, bend, log=True),
        Free("stiffness_n_m_per_rad", stiff, stiff / 1e3, 1e4 * stiff, log=True),
    )


def contact_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Angles across the range of bends, of disks that help a little and of disks that carry most.  Choice: each is
    fitted from, so that some begin on the right side of where disks touch."""
    bend, stiff = scope.largest_bend, _plate_stiffness(scope)
    return tuple((share * bend, size * stiff) for share in (0.15, 0.4, 0.65, 0.85) for size in (0.3, 3.0))


def said_of_contact(fitted: Occurrence) -> str:
    angle, stiffness = fitted.estimates["angle_rad"], fitted.estimates["stiffness_n_m_per_rad"]
    return f"Neighbouring disks touch beyond a bend of {angle} rad and then add {stiffness} N m/rad."


def closing_places(scope: Scope) -> Iterator[Place]:
    """Every side, and both together, to which plates bend so far that notches could close.

    As constants have it or as it was read: plates that soften bend much further than constants can.
    """
    angles = scope.settings.closing_range[0] * closing_angles(scope.chain.arc, scope.manipulator)
    bend = np.concatenate([scope.bend, scope.bend_read])
    most = np.nanmin(bend, axis=0, initial=0.0), np.nanmax(bend, axis=0, initial=0.0)
    sides = [side for side, bent, angle in zip(SIDES, most, angles.T, strict=True) if (np.abs(bent) > angle).any()]
    yield from ({"side": side} for side in sides)
    yield from whole_rig_if(len(sides) == 2)


def closing_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Geometry is right within `Settings.closing_range`; stiffness as of disks."""
    stiffness = contact_free(scope, place)[1]
    return (Free("factor", 1.0, *scope.settings.closing_range, log=True), stiffness)


def closing_probes(scope: Scope, place: Place) -> tuple[tuple[float, ...], ...]:
    """Near the geometry, of edges that help a little and of edges that carry most.  Choice."""
    stiff = _plate_stiffness(scope)
    return tuple((factor, size * stiff) for factor in (0.7, 1.0, 1.3) for size in (0.3, 3.0))


def said_of_closing(fitted: Occurrence) -> str:
    factor, stiffness = fitted.estimates["factor"], fitted.estimates["stiffness_n_m_per_rad"]
    return (
        f"The notches close{toward(fitted)} at {factor} times the bend that length, cable arm and outer fibre give, "
        f"and their edges then add {stiffness} N m/rad."
    )


def gaps(manipulator: Manipulator) -> object:
    """What decides on the gaps between neighbouring disks, to be compared with another design: lengths and disks, m."""
    lengths = {(segment.length_m, segment.clamp_m) for segment in manipulator.segment}
    return lengths, manipulator.disk.thickness_m
