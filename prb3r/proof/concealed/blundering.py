"""What blunders of the set-up do to the tables and the file of a recording."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

Details = Mapping[str, Any]
"""Which cables, disks or sequences a blunder concerns."""


class Tables(NamedTuple):
    """What stands in a recording's folder."""

    manipulator: Mapping[str, Any]
    steps: pd.DataFrame
    markers: pd.DataFrame


def exchange_cables(tables: Tables, details: Details) -> Tables:
    """Weights and slips of two cables in each other's columns."""
    steps, (a, b) = tables.steps.copy(), details["cables"]
    rows = steps["sequence"].eq(details["sequence"]) if "sequence" in details else steps["sequence"].notna()
    for form in ("cable_{}_n", "slip_{}"):
        first, second = form.format(a), form.format(b)
        steps.loc[rows, [first, second]] = steps.loc[rows, [second, first]].to_numpy(copy=True)
    return tables._replace(steps=steps)


def turn_offsets(tables: Tables, details: Details) -> Tables:
    """Offsets with the wrong sign, of one cable or of all."""
    cables = [
        {**cable, "offset_m": -cable["offset_m"]} if details.get("cable") in (None, cable["name"]) else cable
        for cable in tables.manipulator["cable"]
    ]
    return tables._replace(manipulator={**tables.manipulator, "cable": cables})


def note_end(tables: Tables, details: Details) -> Tables:
    """A cable that the file lets end elsewhere."""
    cables = [
        {**cable, "ends_at_segment": details["noted"]} if cable["name"] == details["cable"] else cable
        for cable in tables.manipulator["cable"]
    ]
    return tables._replace(manipulator={**tables.manipulator, "cable": cables})


def turn_slips(tables: Tables, details: Details) -> Tables:
    """Tables with declared slips of the other sign, in the `sequence` that `details` names or in all."""
    steps = tables.steps.copy()
    rows = steps["sequence"].eq(details["sequence"]) if "sequence" in details else steps["sequence"].notna()
    steps.loc[rows, [name for name in steps if name.startswith("slip_")]] *= -1
    return tables._replace(steps=steps)


def mirror(tables: Tables, details: Details) -> Tables:
    """Pictures taken from behind: y, angles and bends change sign."""
    markers = tables.markers.copy()
    for name in markers.columns.intersection(["y_m", "angle_rad", "bend_rad"]):
        markers[name] *= -1
    return tables._replace(markers=markers)


def count_from_tip(tables: Tables, details: Details) -> Tables:
    """Disks counted from the tip: the last is 1."""
    markers = tables.markers.copy()
    markers["disk"] = details["disks"] + 1 - markers["disk"]
    return tables._replace(markers=markers)


def count_from_zero(tables: Tables, details: Details) -> Tables:
    """The first disk after the base counted as 0."""
    markers = tables.markers.copy()
    markers["disk"] -= 1
    return tables._replace(markers=markers)


def exchange_disks(tables: Tables, details: Details) -> Tables:
    """Tables in which the markers of two disks, `disks` in `details`, carry each other's number."""
    return _exchanged(tables, "disk", details["disks"])


def in_kilograms(tables: Tables, details: Details) -> Tables:
    """Weights noted in kilograms under headings in newtons, in one sequence or all."""
    steps = tables.steps.copy()
    rows = steps["sequence"].eq(details["sequence"]) if "sequence" in details else steps["sequence"].notna()
    columns = [name for name in steps if name.startswith("cable_")]
    steps.loc[rows, columns] = (steps.loc[rows, columns] / tables.manipulator["gravity_m_s2"]).round(4)
    return tables._replace(steps=steps)


def play_backwards(tables: Tables, details: Details) -> Tables:
    """Tables in which the pictures of one `sequence` are numbered backwards: the last one stands at step 1."""
    markers = tables.markers.copy()
    rows = markers["sequence"].eq(details["sequence"])
    last = tables.steps.loc[tables.steps["sequence"].eq(details["sequence"]), "step"].max()
    markers.loc[rows, "step"] = last + 1 - markers.loc[rows, "step"]
    return tables._replace(markers=markers)


def note_late(tables: Tables, details: Details) -> Tables:
    """Tables in which every picture stands at the step before its own; those of first steps are lost."""
    markers = tables.markers.copy()
    markers["step"] -= 1
    return tables._replace(markers=markers[markers["step"] > 0])


def exchange_sequences(tables: Tables, details: Details) -> Tables:
    """Pictures of two sequences in each other's place."""
    return _exchanged(tables, "sequence", details["sequences"])


def _exchanged(tables: Tables, column: str, pair: Any) -> Tables:
    """Markers of both values of a pair in each other's place."""
    markers, (a, b) = tables.markers.copy(), pair
    markers[column] = markers[column].replace({a: b, b: a})
    return tables._replace(markers=markers)


def in_degrees(tables: Tables, details: Details) -> Tables:
    """Angles noted in degrees under a heading in radians."""
    markers = tables.markers.copy()
    markers["angle_rad"] = np.degrees(markers["angle_rad"])
    return tables._replace(markers=markers)
