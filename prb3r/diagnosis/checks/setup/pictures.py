"""Blunders with what was read: mirrored pictures, disks counted wrongly, angles in degrees."""

from collections.abc import Callable, Iterator
from itertools import combinations, pairwise

import numpy as np

from prb3r.diagnosis.checks.setup.alternative import Alternative, Mended, with_labels, with_values
from prb3r.recording.recording import Kind, Recording

Turn = Callable[[Recording], np.ndarray]
"""What should have been written instead of the values of all readings, (r,)."""

MOST_RADIANS = {Kind.ANGLE: np.pi, Kind.BEND: 1.0}
"""Readings that stay below are radians: in degrees, the whole arm would turn by three, its plates by one."""


def picture_blunders(recording: Recording) -> Iterator[Alternative]:
    """Every blunder with readings that a recording could hold."""
    yield from _views(recording)
    yield from _counts(recording)
    yield from _exchanges(recording)


def _views(recording: Recording) -> Iterator[Alternative]:
    """Mirrored, turned or in degrees."""
    kinds = [kind for kind in Kind if (recording.readings.kind == kind).any()]
    across = [kind for kind in kinds if kind != Kind.X]
    if across:
        yield _seen("the pictures are mirrored: the rig was seen from behind", lambda known: _signed(known, across))
    if set(kinds) >= {Kind.X, Kind.Y}:
        both = [Kind.X, Kind.Y]
        yield _seen("x_m and y_m point the wrong way", lambda known: _signed(known, both))
        if len(kinds) > 2:
            yield _seen("x_m points toward the base", lambda known: _signed(known, [Kind.X]))
    if len(across) > 1:
        for kind in across:
            yield _seen(f"{kind.column} has the wrong sign", lambda known, kind=kind: _signed(known, [kind]))
    for kind, most in MOST_RADIANS.items():
        if kind in kinds and np.abs(recording.readings.value[recording.readings.kind == kind]).max() > most:
            yield _seen(f"{kind.column} is in degrees", lambda known, kind=kind: _in_degrees(known, kind))


def _seen(blunder: str, turn: Turn) -> Alternative:
    return Alternative(blunder, "markers", lambda known: with_values(known, turn(known)))


def _signed(recording: Recording, kinds: list[Kind]) -> np.ndarray:
    readings = recording.readings
    return np.where(np.isin(readings.kind, kinds), -readings.value, readings.value)


def _in_degrees(recording: Recording, kind: Kind) -> np.ndarray:
    readings = recording.readings
    return np.where(readings.kind == kind, np.radians(readings.value), readings.value)


def _counts(recording: Recording) -> Iterator[Alternative]:
    """Disks counted from the tip or shifted by one."""
    last = recording.manipulator.plates
    yield Alternative(
        "the disks are counted from the tip",
        "markers",
        lambda known: _relabelled(known, last + 1 - known.readings.disk),
    )
    yield Alternative(
        "the disks are counted from the tip, which is 0",
        "markers",
        lambda known: _relabelled(known, last - known.readings.disk),
    )
    for shift, what in ((1, "the first disk after the base is counted as 0"), (-1, "the base disk is counted as 1")):
        yield Alternative(
            f"the disks are counted one off: {what}",
            "markers",
            lambda known, shift=shift: _relabelled(known, known.readings.disk + shift),  # type: ignore[misc]
        )


def _relabelled(recording: Recording, disk: np.ndarray) -> Mended:
    """With other numbers of disks (r,); bends are of the plate that ends at a disk, so that there is none at the base."""
    first = np.where(recording.readings.kind == Kind.BEND, 1, 0)
    return with_labels(recording, disk=disk, known=(disk >= first) & (disk <= recording.manipulator.plates))


def _exchanges(recording: Recording) -> Iterator[Alternative]:
    """Two disks in each other's place, in all sequences, or neighbours in one."""
    readings = recording.readings
    of_reading = recording.of_sequence[readings.step]
    disks = np.unique(readings.disk).tolist()
    for pair in combinations(disks, 2):
        yield _disks_exchanged(pair, np.ones(readings.count, bool), "")
    for number, name in enumerate(recording.sequences if len(recording.sequences) > 1 else ()):
        for pair in pairwise(disks):
            yield _disks_exchanged(pair, of_reading == number, f" in sequence {name}")


def _disks_exchanged(pair: tuple[int, ...], rows: np.ndarray, where: str) -> Alternative:
    first, second = pair

    def mend(recording: Recording) -> Mended:
        disk = recording.readings.disk
        other = np.where(disk == first, second, np.where(disk == second, first, disk))
        return with_labels(recording, disk=np.where(rows, other, disk))

    return Alternative(f"disks {first} and {second} are exchanged{where}", "markers", mend)
