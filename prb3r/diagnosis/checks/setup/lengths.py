"""Blunders with the dimensions of plates: the pitch of the disks taken for their lengths, or a disk taken off once too
often; thicknesses that are doubled or halved."""

from collections.abc import Iterator
from functools import partial

from prb3r.diagnosis.checks.setup.remedy import Remedy, with_manipulator
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording

THICKNESS = "thickness"
"""Kind of the remedies that double or halve the thickness of all plates."""


def length_blunders(recording: Recording) -> Iterator[Remedy]:
    """The remedies of all blunders with lengths that a recording could hold; none where disks have no thickness, or
    clamps would leave nothing of a plate to bend."""
    manipulator = recording.manipulator
    disk = manipulator.disk.thickness_m
    for change, words in (
        (-disk, "length_m of every segment is the pitch, with a disk in it"),
        (disk, "the thickness of a disk was taken off length_m of every segment, which is without it anyway"),
    ):
        other = _lengthened(manipulator, change)
        if change and all(segment.length_m > 2 * segment.clamp_m for segment in other.segment):
            mend = partial(with_manipulator, manipulator=other)
            yield Remedy("lengths", words, "manipulator", mend, frozenset({"camera_scale"}))
    yield from _thicknesses(recording)


def _thicknesses(recording: Recording) -> Iterator[Remedy]:
    """The remedies of thicknesses of all plates that are twice or half of what they should be; none where the modulus
    is not stated, which could then be eight times as large or small."""
    manipulator = recording.manipulator
    given = [segment for segment in manipulator.segment if segment.thickness_m is not None]
    if not given or recording.prior.youngs_modulus is None:
        return
    for factor, words in ((0.5, "twice"), (2.0, "half of")):
        thicker = [
            segment.model_copy(update={"thickness_m": factor * segment.thickness_m}) if segment.thickness_m else segment
            for segment in manipulator.segment
        ]
        mend = partial(with_manipulator, manipulator=manipulator.model_copy(update={"segment": thicker}))
        yield Remedy(THICKNESS, f"thickness_m of every segment is {words} what it should be", "manipulator", mend)


def _lengthened(manipulator: Manipulator, change: float) -> Manipulator:
    """A manipulator with plates that are longer by `change`, m."""
    segments = [s.model_copy(update={"length_m": round(s.length_m + change, 12)}) for s in manipulator.segment]
    return manipulator.model_copy(update={"segment": segments})
