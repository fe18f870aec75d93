"""Blunders with weights and loads: kilograms or grams in a column of newtons, newtons or grams in one of kilograms,
loads upside down."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from prb3r.diagnosis.checks.setup.remedy import Remedy, with_scaled
from prb3r.markdown import listed
from prb3r.model.files.cells import numbers
from prb3r.model.step_checks import cable_columns
from prb3r.recording.recording import Recording


def unit_blunders(recording: Recording) -> Iterator[Remedy]:
    """The remedies of all blunders with the unit or the sign of loads that a recording could hold."""
    steps, gravity = recording.steps, recording.manipulator.gravity_m_s2
    loaded = {name: numbers(steps[name]).to_numpy(float) != 0 for name in steps if name.endswith(("_n", "_kg"))}
    pulled = [name for name in cable_columns(recording.manipulator, steps) if loaded[name].any()]
    worth = {"newtons": 1.0, "kilograms": gravity, "grams": gravity / 1000}  # N
    for unit, noted, other in (
        ("_n", "newtons", "kilograms"),
        ("_n", "newtons", "grams"),
        ("_kg", "kilograms", "newtons"),
        ("_kg", "kilograms", "grams"),
    ):
        columns, factor = [name for name in pulled if name.endswith(unit)], worth[other] / worth[noted]
        if columns:
            every = len(columns) == len(pulled)
            yield _scaled("unit", f"weights noted as {noted} are {other}", columns, factor)
            if other != "grams" and (len(columns) > 1 or not every):  # a cable in grams would look as if it was dead
                for name in columns:
                    yield _scaled("unit of a cable", f"weights of {name} are {other}", [name], factor)
            for number, sequence in enumerate(recording.sequences if len(recording.sequences) > 1 else ()):
                rows = recording.of_sequence == number
                if any(loaded[name][rows].any() for name in columns):
                    blunder = f"weights of sequence {sequence} noted as {noted} are {other}"
                    yield _scaled("unit of a sequence", blunder, columns, factor, rows)
    dead = [name for name in loaded if name not in cable_columns(recording.manipulator, steps) and loaded[name].any()]
    if dead:
        hold, have = ("holds", "has") if len(dead) == 1 else ("hold", "have")
        yield _scaled("dead loads", f"{listed(dead)} {hold} kilograms", dead, gravity)
        yield _scaled("dead loads", f"{listed(dead)} {have} the wrong sign", dead, -1.0)


def _scaled(
    kind: str, blunder: str, columns: list[str], factor: float, rows: np.ndarray | slice = slice(None)
) -> Remedy:
    """The remedy that multiplies some columns of the steps by a factor, in some rows (a mask; absent: all)."""
    return Remedy(kind, blunder, "steps", partial(with_scaled, columns=columns, factor=factor, rows=rows))
