"""Blunders with what was read: mirrored pictures, another scale, disks counted wrongly, angles in degrees."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations, pairwise

import numpy as np

from prb3r.diagnosis.checks.setup.remedy import Mended, Remedy, later_parts, parts_of, with_labels, with_values
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import listed
from prb3r.recording.recording import Kind, Recording

SCALES = (
    (10.0, "a tenth of"),
    (0.1, "ten times"),
    (2.54, "0.394 times (inches for centimetres)"),
    (1 / 2.54, "2.54 times (centimetres for inches)"),
    (2.0, "half of"),
    (0.5, "twice"),
)
"""Factors that mend positions in a wrong unit or by a wrong scale bar, and what the positions then are, in words before
"what they should be".  Choice: factors of 100 and more are refused when a recording is read."""


def picture_blunders(recording: Recording, settings: Settings) -> Iterator[Remedy]:
    """The remedies of all blunders with readings that a recording could hold."""
    yield from _views(recording, settings)
    yield from _counts(recording)
    yield from _exchanges(recording)


def _views(recording: Recording, settings: Settings) -> Iterator[Remedy]:
    """Remedies of pictures that are mirrored, whose axes point the wrong way, or whose angles are in degrees."""
    kinds = [kind for kind in Kind if (recording.readings.kind == kind).any()]
    across = [kind for kind in kinds if kind != Kind.X]
    if across:
        read = np.bincount(recording.readings.step, minlength=len(recording.of_sequence)) > 0
        for when, parts in (("once", parts_of), ("from a sequence on", partial(later_parts, within=False))):
            for rows, where in parts(recording, read):
                words = f"the pictures{where} are mirrored: the rig was seen from behind"
                yield _factor(f"mirrored {when}" if where else "mirrored", words, across, steps=rows)
    if set(kinds) >= {Kind.X, Kind.Y}:
        yield _factor("axes", "x_m and y_m point the wrong way", [Kind.X, Kind.Y])
        yield _factor("axes", "x_m points toward the base", [Kind.X])
        yield Remedy("axes", "x_m and y_m are exchanged", "markers", _axes_exchanged)
    if len(across) > 1:
        for kind in across:
            yield _factor("axes", f"{kind.column} has the wrong sign", [kind])
    places = [kind for kind in kinds if kind.is_position]
    for factor, words in SCALES if places else ():
        names = listed([kind.column for kind in places])
        yield _factor("scale", f"positions ({names}) are {words} what they should be", places, factor)
    for turned, most in ((Kind.ANGLE, settings.most_angle_rad), (Kind.BEND, settings.most_bend_rad)):
        if turned in kinds and np.abs(recording.readings.value[recording.readings.kind == turned]).max() > most:
            yield _factor("degrees", f"{turned.column} is in degrees", [turned], np.pi / 180)


def _axes_exchanged(recording: Recording) -> Mended:
    """A recording whose coordinates along x are those noted along y, and the other way round."""
    kind = recording.readings.kind
    other = np.where(kind == Kind.X, Kind.Y, np.where(kind == Kind.Y, Kind.X, kind))
    return Mended(replace(recording, readings=recording.readings._replace(kind=other)), np.arange(len(kind)))


def _factor(
    kind: str, blunder: str, kinds: Sequence[Kind], factor: float = -1.0, steps: np.ndarray | slice = slice(None)
) -> Remedy:
    """The remedy that multiplies all readings of some kinds by a factor; the default changes their signs.

    `steps` (s,): a mask of the steps whose readings are concerned; absent: all.
    """

    def mend(recording: Recording) -> Mended:
        readings, wrong = recording.readings, np.zeros(len(recording.of_sequence), bool)
        wrong[steps] = True
        factors = np.where(np.isin(readings.kind, kinds) & wrong[readings.step], factor, 1.0)
        return with_values(recording, factors * readings.value)

    return Remedy(kind, blunder, "markers", mend)


def _counts(recording: Recording) -> Iterator[Remedy]:
    """Remedies of disks counted from the tip, or one off where every reading then still has a disk."""
    last = recording.manipulator.plates
    yield Remedy(
        "disks counted",
        "the disks are counted from the tip",
        "markers",
        lambda known: _relabelled(known, last + 1 - known.readings.disk),
    )
    yield Remedy(
        "disks counted",
        "the disks are counted from the tip, which is 0",
        "markers",
        lambda known: _relabelled(known, last - known.readings.disk),
    )
    for shift, miscount in (
        (1, "the first disk after the base is counted as 0"),
        (-1, "the base disk is counted as 1"),
    ):
        if len(_shifted(recording, shift).rows) == recording.readings.count:
            blunder = f"the disks are counted one off: {miscount}"
            yield Remedy("disks counted", blunder, "markers", partial(_shifted, by=shift))


def _shifted(recording: Recording, by: int) -> Mended:
    """A recording with all numbers of disks changed by `by`."""
    return _relabelled(recording, recording.readings.disk + by)


def _relabelled(recording: Recording, disk: np.ndarray) -> Mended:
    """A recording with other numbers of disks (r,), without readings of disks that do not exist.

    A bend is that of the plate ending at a disk, so that disk 0, the base, has none.
    """
    first = np.where(recording.readings.kind == Kind.BEND, 1, 0)
    return with_labels(recording, disk=disk, known=(disk >= first) & (disk <= recording.manipulator.plates))


def _exchanges(recording: Recording) -> Iterator[Remedy]:
    """Remedies of two disks exchanged: any two in all sequences, or neighbours in one sequence."""
    readings = recording.readings
    of_reading = recording.of_sequence[readings.step]
    disks = np.unique(readings.disk).tolist()
    for pair in combinations(disks, 2):
        yield _disks_exchanged(pair, np.ones(readings.count, bool), "")
    for number, name in enumerate(recording.sequences if len(recording.sequences) > 1 else ()):
        for pair in pairwise(disks):
            yield _disks_exchanged(pair, of_reading == number, f" in sequence {name}")


def _disks_exchanged(pair: tuple[int, ...], rows: np.ndarray, where: str) -> Remedy:
    """The remedy that exchanges two disks in the readings `rows` (r,), a mask; `where` in words, empty: everywhere."""
    first, second = pair

    def mend(recording: Recording) -> Mended:
        disk = recording.readings.disk
        other = np.where(disk == first, second, np.where(disk == second, first, disk))
        return with_labels(recording, disk=np.where(rows, other, disk))

    kind = "disks exchanged once" if where else "disks exchanged"
    return Remedy(kind, f"disks {first} and {second} are exchanged{where}", "markers", mend)
