"""Remedies: what turns a recording into the one that it would be without a certain blunder of its set-up."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd

from prb3r.model.files.cells import numbers
from prb3r.model.manipulator import Manipulator
from prb3r.model.steps import loads_of
from prb3r.recording.recording import Recording

File = Literal["manipulator", "steps", "markers"]


class Mended(NamedTuple):
    """A mended recording."""

    recording: Recording
    rows: np.ndarray
    """(r,) index that each of its readings has in the recording before."""


@dataclass(frozen=True)
class Remedy:
    """One blunder that could have been made, and its remedy."""

    kind: str
    """Kind of the blunder; remedies of one kind differ in the place alone: the sequence, the cable, the disk."""
    blunder: str
    """What was done, in words that follow "it looks as if"."""
    file: File
    """The file that has to be mended."""
    mend: Callable[[Recording], Mended]
    """Returns a recording without the blunder."""
    imitators: frozenset[str] = frozenset()
    """Kinds of effects of which one looks much the same at some size, so that the blunder is weighed against effects
    although constants alone explain the mended recording."""
    factor: "Multiple | None" = None
    """Of a blunder by a factor that is no known one: what is tried."""


class Multiple(NamedTuple):
    """A factor that a remedy tries."""

    value: float
    whose: str
    """What it concerns, in words."""
    remedy_by: Callable[[float], Remedy]
    """Returns the remedy with another factor."""


def parts_of(recording: Recording, concerned: np.ndarray) -> Iterator[tuple[np.ndarray, str]]:
    """Steps (s,) in which a blunder could have been made, as masks, each with the words for it: all steps first, then
    the steps of every sequence with steps that it would concern.

    Parameters
    ----------
    concerned : (s,) whether the blunder would change a step.
    """
    yield np.ones(len(concerned), bool), ""
    for number, name in enumerate(recording.sequences if len(recording.sequences) > 1 else ()):
        rows = recording.of_sequence == number
        if concerned[rows].any():
            yield rows, f" in sequence {name}"


def later_parts(recording: Recording, concerned: np.ndarray, within: bool = True) -> Iterator[tuple[np.ndarray, str]]:
    """Steps (s,) in which a blunder counts that was made in the midst of a recording, as masks, each with the words for
    it: from a step on, where the blunder would change a step before that and one after.

    Parameters
    ----------
    concerned : as of :func:`parts_of`.
    within : whether it could be made within a sequence, too, not only between two.
    """
    numbers, names = recording.steps["step"].to_numpy(), recording.sequences
    for row in range(1, len(concerned)):
        sequence = recording.of_sequence[row]
        begins = recording.of_sequence[row - 1] != sequence
        if begins and sequence == len(names) - 1:
            continue  # of one sequence: one of parts_of
        if (begins or within) and concerned[:row].any() and concerned[row:].any():
            since = f"sequence {names[sequence]}" if begins else f"step {numbers[row]} of sequence {names[sequence]}"
            yield np.arange(len(concerned)) >= row, f" from {since} on"


def rewritten(recording: Recording, manipulator: Manipulator, steps: pd.DataFrame) -> Mended:
    """A recording with another manipulator and table of steps, and the same readings."""
    loads = loads_of(manipulator, manipulator.chain(), steps)
    changed = replace(recording, manipulator=manipulator, steps=steps, loads=loads)
    return Mended(changed, np.arange(recording.readings.count))


def with_manipulator(recording: Recording, manipulator: Manipulator) -> Mended:
    """The recording as one of another nominal manipulator, its steps and readings as before."""
    return rewritten(recording, manipulator, recording.steps)


def with_steps(recording: Recording, steps: pd.DataFrame) -> Mended:
    """A recording with another table of steps, its rows as before."""
    return rewritten(recording, recording.manipulator, steps)


def with_labels(
    recording: Recording,
    *,
    step: np.ndarray | None = None,
    disk: np.ndarray | None = None,
    known: np.ndarray | None = None,
) -> Mended:
    """A recording whose readings belong to other steps or disks; some may be left out.

    Parameters
    ----------
    step, disk : (r,) new labels; absent: as they were.
    known : (r,) whether a reading still belongs somewhere, else it is left out; absent: all do.
    """
    readings = recording.readings
    rows = np.arange(readings.count) if known is None else np.flatnonzero(known)
    changed = readings._replace(
        step=readings.step if step is None else step, disk=readings.disk if disk is None else disk
    )
    return Mended(replace(recording, readings=changed.where(rows)), rows)


def with_values(recording: Recording, value: np.ndarray) -> Mended:
    """A recording with other values (r,) of its readings."""
    return Mended(recording.with_values(value), np.arange(recording.readings.count))


def with_scaled(
    recording: Recording, columns: Sequence[str], factor: float, rows: np.ndarray | slice = slice(None)
) -> Mended:
    """A recording with some columns of its steps multiplied by `factor`, in some rows (a mask; absent: all)."""
    steps = recording.steps
    out = steps.copy()
    for name in columns:
        column = numbers(steps[name]).to_numpy(float).copy()
        column[rows] *= factor
        out[name] = column
    return with_steps(recording, out)
