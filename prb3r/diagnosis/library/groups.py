"""Which parameters several rigs share: those that their recordings declare as shared, unless their manipulator files
contradict it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, get_args

import numpy as np

from prb3r.diagnosis.library.suspect import Group
from prb3r.markdown import listed, quoted
from prb3r.recording.recording import Recording

GIGA = 1e9
"""Pascals per gigapascal, the unit in which moduli are shown."""


class Groups(NamedTuple):
    """Which of several rigs share their material and their friction."""

    of: Mapping[Group, tuple[int, ...]]
    """Numbers of the rigs, from 0, that share material, and of those that share friction; a group that nobody or one
    rig alone would be in is left out."""
    same_sections: bool
    """Whether all plates of the rigs with the same material have the same section, so that bending laws in curvature
    mean the same on each."""
    one_design: bool
    """Whether the manipulator files of all rigs are the same but for their names."""
    remarks: tuple[str, ...]
    """What is not shared and why, and the suppositions that sharing rests on, a sentence each."""

    @property
    def of_one_make(self) -> tuple[int, ...]:
        """Numbers of the rigs that share material or friction with another one."""
        return tuple(sorted({rig for rigs in self.of.values() for rig in rigs}))


def groups_of(recordings: Sequence[Recording]) -> Groups:
    """The groups of rigs, one rig for each of the `recordings`, that share material or friction.

    Young's modulus is shared as the factor on the stated one, which must be the same; where files state bending
    stiffnesses, these are taken for that modulus times a second moment of area.
    """
    material = tuple(k for k, recording in enumerate(recordings) if recording.sharing.material)
    friction = tuple(k for k, recording in enumerate(recordings) if recording.sharing.friction)
    remarks = [*_withheld(recordings)]
    stated = [recordings[k].manipulator for k in material]
    if len({manipulator.youngs_modulus_pa for manipulator in stated}) > 1:
        values = " and ".join(
            f"{modulus:.4g}" for modulus in sorted({other.youngs_modulus_pa / GIGA for other in stated})
        )
        remarks.append(f"material is not shared: the files state {values} GPa; state one modulus for one material")
        material = ()
    rubbing = [recordings[k].manipulator.friction for k in friction]
    if len({(law.coefficient, law.wrap) for law in rubbing}) > 1:
        remarks.append("friction is not shared: the files state different coefficients or different turns (wrap)")
        friction = ()
    sections = {
        (segment.width_m, segment.thickness_m, segment.bending_stiffness_n_m2, segment.outer_fibre_m)
        for manipulator in stated
        for segment in manipulator.segment
    }
    if len(material) > 1:
        segments = [segment for manipulator in stated for segment in manipulator.segment]
        if any(segment.bending_stiffness_n_m2 is not None for segment in segments):
            remarks.append(
                "stated bending stiffnesses are taken for the stated modulus times a second moment of area: "
                "where they were measured, set material = false under [sharing]"
            )
        if not all(np.isfinite(manipulator.outer_fibre).all() for manipulator in stated):
            remarks.append("bending laws are shared as strain only where all files state outer_fibre_m")
        elif len(sections) > 1:
            remarks.append("of bending laws those in strain are shared, and none in curvature, as sections differ")
    groups: dict[Group, tuple[int, ...]] = {"material": material, "friction": friction}
    designs = {recording.manipulator.model_copy(update={"name": ""}).model_dump_json() for recording in recordings}
    shared = {name: rigs for name, rigs in groups.items() if len(rigs) > 1}
    return Groups(shared, len(sections) == 1, len(designs) == 1, tuple(remarks))


def _withheld(recordings: Sequence[Recording]) -> Iterator[str]:
    """A sentence for each group on the recordings that declare under `[sharing]` not to be in it."""
    for group in get_args(Group):
        names = quoted([recording.name for recording in recordings if not getattr(recording.sharing, group)])
        if names:
            yield f"{group} is not shared by {listed(names)}: under [sharing] stands {group} = false"
