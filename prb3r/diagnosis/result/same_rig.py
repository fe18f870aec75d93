"""Whether two manipulator files describe one rig: what its parts are counts, not how a file writes them."""

from collections.abc import Iterator

import numpy as np

from prb3r.diagnosis.library.alike import same_numbers
from prb3r.model.manipulator import Manipulator


def same_geometry(first: Manipulator, other: Manipulator) -> bool:
    """Whether two nominal manipulators have the same plates, cables and disks; constants and effects may differ.

    Segments are told apart by the plates that they end at, cables by their names.  Of sections, widths and thicknesses
    say the same as bending stiffnesses that follow from them, and an outer fibre or a mass that one file leaves out may
    be that of the other.
    """
    if first.segment_ends != other.segment_ends or set(first.cable_names) != set(other.cable_names):
        return False
    lengths = zip(_lengths(first), _lengths(other), strict=True)
    return all(same_numbers(*pair) for pair in lengths) and _same_mass(first, other) and _same_sections(first, other)


def stiffness_ratio(first: Manipulator, other: Manipulator) -> float:
    """How many times as stiff as those of `other` the plates of `first` are as stated, for two files of one rig."""
    return float(np.mean(first.bending_stiffness) / np.mean(other.bending_stiffness))


def _lengths(manipulator: Manipulator) -> Iterator[np.ndarray]:
    """Thickness of the disks, then of every plate (plates,) its length, its clamps, and the offset of each cable there
    by the names of the cables, m; NaN beyond a cable's end."""
    yield np.array(manipulator.disk.thickness_m)
    yield manipulator.per_plate(segment.length_m for segment in manipulator.segment)
    yield manipulator.per_plate(segment.clamp_m for segment in manipulator.segment)
    for cable in sorted(manipulator.cable, key=lambda cable: cable.name):
        offsets = [cable.offset(k) if k < cable.ends_at_segment else np.nan for k in range(len(manipulator.segment))]
        yield manipulator.per_plate(offsets)


def _same_mass(first: Manipulator, other: Manipulator) -> bool:
    """Whether every disk carries the same mass, as far as both files state any."""
    masses = first.disk_masses, other.disk_masses
    return not all(mass.any() for mass in masses) or same_numbers(*masses)


def _same_sections(first: Manipulator, other: Manipulator) -> bool:
    """Whether all plates have the same section, as far as both files tell it.

    Where both state width and thickness, their second moments of area have to be equal.  A stated bending stiffness is
    the same if it is as large, or as large for the modulus that stands beside it, which is that of the same plates
    with another constant.
    """
    fibres = np.stack([first.outer_fibre, other.outer_fibre])
    known = np.isfinite(fibres).all(0)
    if not same_numbers(*fibres[:, known]):
        return False
    stiffness = first.bending_stiffness, other.bending_stiffness
    moments = [rig.bending_stiffness / rig.youngs_modulus_pa for rig in (first, other)]
    stated = any(segment.bending_stiffness_n_m2 is not None for rig in (first, other) for segment in rig.segment)
    return same_numbers(*moments) or (stated and same_numbers(*stiffness))
