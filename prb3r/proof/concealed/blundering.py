"""Makes blunders of the set-up in the tables and the manipulator file of a recording."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

Details = Mapping[str, Any]
"""Cables, disks or sequences that a blunder concerns, by name."""


class Tables(NamedTuple):
    """The contents of a recording's folder."""

    manipulator: Mapping[str, Any]
    """Contents of the manipulator file."""
    steps: pd.DataFrame
    markers: pd.DataFrame


def exchange_cables(tables: Tables, details: Details) -> Tables:
    """Tables with the tensions and slips of two cables exchanged, in the `sequence` that `details` names or in all."""
    steps, (a, b) = tables.steps.copy(), details["cables"]
    rows = steps["sequence"].eq(details["sequence"]) if "sequence" in details else steps["sequence"].notna()
    for form in ("cable_{}_n", "slip_{}"):
        first, second = form.format(a), form.format(b)
        steps.loc[rows, [first, second]] = steps.loc[rows, [second, first]].to_numpy(copy=True)
    return tables._replace(steps=steps)


def turn_offsets(tables: Tables, details: Details) -> Tables:
    """Tables with the wrong sign of the offset of the `cable` that `details` names, or of all cables."""
    cables = [
        {**cable, "offset_m": -cable["offset_m"]} if details.get("cable") in (None, cable["name"]) else cable
        for cable in tables.manipulator["cable"]
    ]
    return tables._replace(manipulator={**tables.manipulator, "cable": cables})


def note_end(tables: Tables, details: Details) -> Tables:
    """Tables whose manipulator file lets a `cable` end at the wrong segment, `noted`."""
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
    """Tables of pictures taken from behind: y, angles and bends change sign."""
    markers = tables.markers.copy()
    for name in markers.columns.intersection(["y_m", "angle_rad", "bend_rad"]):
        markers[name] *= -1
    return tables._replace(markers=markers)


def count_from_tip(tables: Tables, details: Details) -> Tables:
    """Tables in which the disks are counted from the tip: the last is 1."""
    markers = tables.markers.copy()
    markers["disk"] = details["disks"] + 1 - markers["disk"]
    return tables._replace(markers=markers)


def count_from_zero(tables: Tables, details: Details) -> Tables:
    """Tables in which the first disk after the base is counted as 0, and so on."""
    markers = tables.markers.copy()
    markers["disk"] -= 1
    return tables._replace(markers=markers)


def exchange_disks(tables: Tables, details: Details) -> Tables:
    """Tables in which the markers of two disks, `disks` in `details`, carry each other's number."""
    return _exchanged(tables, "disk", details["disks"])


def in_kilograms(tables: Tables, details: Details) -> Tables:
    """Tables with tensions noted in kilograms under headings in newtons, in the `sequence` that `details` names or in
    all."""
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
    """Tables in which every picture is noted at the step before its own; those of first steps are lost."""
    markers = tables.markers.copy()
    markers["step"] -= 1
    return tables._replace(markers=markers[markers["step"] > 0])


def exchange_sequences(tables: Tables, details: Details) -> Tables:
    """Tables in which the pictures of two sequences, `sequences` in `details`, are exchanged."""
    return _exchanged(tables, "sequence", details["sequences"])


def _exchanged(tables: Tables, column: str, pair: Any) -> Tables:
    """Tables whose markers have the two values of a pair exchanged in one column."""
    markers, (a, b) = tables.markers.copy(), pair
    markers[column] = markers[column].replace({a: b, b: a})
    return tables._replace(markers=markers)


def in_degrees(tables: Tables, details: Details) -> Tables:
    """Tables with absolute angles noted in degrees under a heading in radians."""
    markers = tables.markers.copy()
    markers["angle_rad"] = np.degrees(markers["angle_rad"])
    return tables._replace(markers=markers)
