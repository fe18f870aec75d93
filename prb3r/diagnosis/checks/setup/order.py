"""Blunders with the order of what was read: sequences or steps exchanged, sequences backwards, steps shifted by one."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from prb3r.diagnosis.checks.setup.remedy import Mended, Remedy, with_labels
from prb3r.recording.recording import Recording

EXCHANGED_STEPS = "steps exchanged"
"""Kind of the remedies that undo an exchange of two steps."""
OF_ORDER = frozenset({"backward", "shifted", "sequences exchanged"})
"""Kinds of the remedies that move the pictures of whole sequences to other steps."""


def order_blunders(recording: Recording) -> Iterator[Remedy]:
    """The remedies of all blunders with the order of steps and sequences that a recording could hold."""
    rows = [np.flatnonzero(recording.of_sequence == k) for k in range(len(recording.sequences))]
    names = recording.sequences
    whole = np.arange(len(recording.of_sequence))
    places = {f" of sequence {name}": steps for name, steps in zip(names, rows, strict=True) if len(steps) > 1}
    backward, shifted = {}, {-1: {}, 1: {}}  # type: ignore[var-annotated]
    for where, steps in places.items():
        backward[where] = _moved(whole, steps, steps[::-1])
        for shift in shifted:
            there = steps + shift
            shifted[shift][where] = _moved(whole, steps, np.where(np.isin(there, steps), there, -1))
    if len(places) > 1:
        together = " of every sequence"
        backward[together] = _together(backward.values(), whole)
        for moved in shifted.values():
            moved[together] = _together(moved.values(), whole)
    for where, to in backward.items():
        yield _reordered("backward", f"the pictures{where} are in backward order", to)
    for shift, words in ((1, "after"), (-1, "before")):
        for where, to in shifted[shift].items():
            blunder = f"the pictures{where} belong to the step {words} the one they are noted at"
            yield _reordered("shifted", blunder, to)
    for first, second in combinations(range(len(rows)), 2):
        if len(rows[first]) == len(rows[second]):
            to = _moved(_moved(whole, rows[first], rows[second]), rows[second], rows[first])
            blunder = f"the pictures of sequences {names[first]} and {names[second]} are exchanged"
            yield _reordered("sequences exchanged", blunder, to)


def step_blunders(recording: Recording, among: Sequence[int]) -> Iterator[Remedy]:
    """The remedies of an exchange of two steps of one sequence, for every two of the rows `among`.

    The pictures of the two steps have each other's labels.
    """
    whole, names = np.arange(len(recording.of_sequence)), recording.steps["step"]
    for first, second in combinations(sorted(among), 2):
        if recording.of_sequence[first] == recording.of_sequence[second]:
            sequence = recording.sequences[recording.of_sequence[first]]
            blunder = f"the pictures of steps {names[first]} and {names[second]} of sequence {sequence} are exchanged"
            both = np.array([first, second])
            yield _reordered(EXCHANGED_STEPS, blunder, _moved(whole, both, both[::-1]))


def _moved(to: np.ndarray, steps: np.ndarray, there: np.ndarray) -> np.ndarray:
    """(s,) rows of steps that the pictures of all steps belong to: as in `to`, but `there` for those of `steps`."""
    out = to.copy()
    out[steps] = there
    return out


def _together(parts, whole: np.ndarray) -> np.ndarray:
    """The rows `whole` (s,) with the changes of all `parts` (s,); where several change a row the last one counts."""
    out = whole.copy()
    for part in parts:
        out = np.where(part != whole, part, out)
    return out


def _reordered(kind: str, blunder: str, to: np.ndarray) -> Remedy:
    """The remedy that moves the pictures of every step to row `to` (s,) of the steps; with -1 they are left out."""

    def mend(recording: Recording) -> Mended:
        step = to[recording.readings.step]
        return with_labels(recording, step=step, known=step >= 0)

    return Remedy(kind, blunder, "markers", mend)
