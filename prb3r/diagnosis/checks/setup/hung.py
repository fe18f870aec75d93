"""Blunders with the disks that loads hang on: noted at a disk beside theirs, or counted from the tip or one off."""

import re
from collections.abc import Iterator, Mapping
from functools import partial

from prb3r.diagnosis.checks.setup.remedy import Mended, Remedy, with_steps
from prb3r.model.files.cells import numbers
from prb3r.recording.recording import Recording

DISK_LOAD = re.compile(r"disk(\d+)_([xy])_n")
"""Name of a column of loads on a disk."""

OF_DISK_LOADS = frozenset({"weight_friction", "payload_scale"})
"""Kinds of effects by which other shares of a load act than are noted, as those of another lever would."""


def hung_blunders(recording: Recording) -> Iterator[Remedy]:
    """The remedies of all blunders with the disks that loads hang on that a recording could hold; none where no disk
    has a load of its own."""
    loaded, last = sorted({disk for disk, _ in _disk_loads(recording).values()}), recording.manipulator.plates
    for disk in loaded:
        for other in {disk - 1, disk + 1} & set(range(1, last + 1)):
            blunder = f"what hung at disk {other} is noted as loads on disk {disk}"
            yield _moved("loads of another disk", blunder, {disk: other})
    for words, to in (
        ("from the tip", {disk: last + 1 - disk for disk in loaded}),
        ("from the tip, which is 0", {disk: last - disk for disk in loaded}),
        ("one off: the base disk is counted as 1", {disk: disk - 1 for disk in loaded if len(loaded) > 1}),
        (
            "one off: the first disk after the base is counted as 0",
            {disk: disk + 1 for disk in loaded if len(loaded) > 1},
        ),
    ):
        if any(disk != there for disk, there in to.items()) and all(0 < there <= last for there in to.values()):
            yield _moved("loads counted", f"the disks that loads hang on are counted {words}", to)


def _disk_loads(recording: Recording) -> dict[str, tuple[int, str]]:
    """Columns of the steps that hold loads on disks, with the disk and the axis of each; none that are 0 throughout."""
    named = {name: DISK_LOAD.fullmatch(str(name)) for name in recording.steps}
    loaded = {name: match for name, match in named.items() if match and numbers(recording.steps[name]).any()}
    return {name: (int(match[1]), match[2]) for name, match in loaded.items()}


def _moved(kind: str, blunder: str, to: Mapping[int, int]) -> Remedy:
    """The remedy that moves the loads on each disk to another one."""
    return Remedy(kind, blunder, "steps", partial(_hung_elsewhere, to=to), OF_DISK_LOADS)


def _hung_elsewhere(recording: Recording, to: Mapping[int, int]) -> Mended:
    """A recording in which the loads on each disk of `to` act at the disk that it leads to, beside what hangs there."""
    moved = {name: (to[disk], axis) for name, (disk, axis) in _disk_loads(recording).items() if disk in to}
    steps = recording.steps.drop(columns=list(moved))
    for name, (disk, axis) in moved.items():
        there = f"disk{disk}_{axis}_n"
        beside = numbers(steps[there]) if there in steps else 0.0
        steps[there] = numbers(recording.steps[name]) + beside
    return with_steps(recording, steps)
