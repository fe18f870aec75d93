"""Blunders with weights and loads: kilograms, grams or pounds in a column of newtons, newtons, grams or pounds in one
of kilograms, cables that were pulled by twice or half of what is noted, loads upside down."""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.checks.setup.cables import ALL_LEVERS
from prb3r.diagnosis.checks.setup.remedy import Remedy, with_scaled
from prb3r.markdown import listed
from prb3r.model.files.cells import numbers
from prb3r.model.step_checks import cable_columns
from prb3r.recording.recording import Recording

POUND_KG = 0.45359237
"""A pound (avoirdupois) in kilograms, exactly."""


OF_ALL_WEIGHTS = "unit"
"""Kind of the remedies that change the unit of all weights."""
DEAD_LOADS = "dead loads"
"""Kind of the remedies that change the unit or the sign of loads that no cable brings."""


class Mistaken(NamedTuple):
    """A unit that was taken for another one."""

    noted: str
    """Unit of the column."""
    other: str
    """What the numbers are in, in words that follow "are"."""
    factor: float
    """By which the numbers have to be multiplied."""
    of_a_cable: bool
    """Whether one cable alone is thought to have it; else that would look as if it was dead, or ran over a pulley that
    rubs."""
    imitated: bool = False
    """Whether an effect may look the same: that a part of a load arrives."""


def _mistaken(gravity: float) -> tuple[Mistaken, ...]:
    """The units that may have been taken for others, where gravity is as given, m/s^2."""
    for_kilograms = "pounds that were taken for kilograms"
    return (
        Mistaken("newtons", "kilograms", gravity, True),
        Mistaken("newtons", "grams", gravity / 1000, False),
        Mistaken("newtons", "pounds", gravity * POUND_KG, True),
        Mistaken("newtons", for_kilograms, POUND_KG, False, imitated=True),
        Mistaken("kilograms", "newtons", 1 / gravity, True),
        Mistaken("kilograms", "grams", 1 / 1000, False),
        Mistaken("kilograms", "pounds", POUND_KG, False, imitated=True),
    )


def unit_blunders(recording: Recording) -> Iterator[Remedy]:
    """The remedies of all blunders with the unit or the sign of loads that a recording could hold."""
    steps, units = recording.steps, _mistaken(recording.manipulator.gravity_m_s2)
    loaded = {name: numbers(steps[name]).to_numpy(float) != 0 for name in steps if name.endswith(("_n", "_kg"))}
    pulled = [name for name in cable_columns(recording.manipulator, steps) if loaded[name].any()]
    for unit in units:
        noted, other = unit.noted, unit.other
        columns = [name for name in pulled if name.endswith("_n" if noted == "newtons" else "_kg")]
        if columns:
            every = len(columns) == len(pulled)
            yield _scaled(OF_ALL_WEIGHTS, f"weights noted as {noted} are {other}", columns, unit)
            if unit.of_a_cable and (len(columns) > 1 or not every):
                for name in columns:
                    yield _scaled("unit of a cable", f"weights of {name} are {other}", [name], unit)
            for number, sequence in enumerate(recording.sequences if len(recording.sequences) > 1 else ()):
                rows = recording.of_sequence == number
                if any(loaded[name][rows].any() for name in columns):
                    blunder = f"weights of sequence {sequence} noted as {noted} are {other}"
                    yield _scaled("unit of a sequence", blunder, columns, unit, rows)
    yield from _halves(pulled)
    dead = [name for name in loaded if name not in cable_columns(recording.manipulator, steps) and loaded[name].any()]
    if dead:
        hold, have = ("holds", "has") if len(dead) == 1 else ("hold", "have")
        for unit in units:
            if unit.noted == "newtons" and unit.other != "grams":  # in grams, they would not be there
                yield _scaled(DEAD_LOADS, f"{listed(dead)} {hold} {unit.other}", dead, unit)
        change = partial(with_scaled, columns=dead, factor=-1.0)
        yield Remedy(DEAD_LOADS, f"{listed(dead)} {have} the wrong sign", "steps", change)


def _halves(pulled: list[str]) -> Iterator[Remedy]:
    """The remedies of tensions that are half or twice what pulled, in one of the columns `pulled` or in all: a scale
    on one end of a loop, or a weight on a movable pulley."""
    places = [("share of a tension", [name]) for name in pulled if len(pulled) > 1]
    places += [(ALL_LEVERS, pulled)] if pulled else []
    for kind, columns in places:
        noted = f"weights of {columns[0]} are" if len(columns) == 1 else "weights of all cables are"
        for factor, words, imitators in ((2.0, "half of", ()), (0.5, "twice", ("pulley_friction",))):
            change = partial(with_scaled, columns=columns, factor=factor)
            yield Remedy(kind, f"{noted} {words} what pulled", "steps", change, frozenset(imitators))


def _scaled(
    kind: str, blunder: str, columns: list[str], unit: Mistaken, rows: np.ndarray | slice = slice(None)
) -> Remedy:
    """The remedy that undoes a mistaken unit of some columns of the steps, in some rows (a mask; absent: all)."""
    change = partial(with_scaled, columns=columns, factor=unit.factor, rows=rows)
    pulled = kind != DEAD_LOADS
    imitators = frozenset({"pulley_friction"} if pulled else {"tip_load_friction", "weight_friction"})
    return Remedy(kind, blunder, "steps", change, imitators if unit.imitated else frozenset())
