"""Checks of a recording for units other than SI, by the scale of its numbers."""

import math
from collections.abc import Iterator

import numpy as np
import pandas as pd

from prb3r.errors import Problem
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import FRAME_REACH, Kind, Measurement, Tolerance

FARTHEST_POSITION, NEAREST_POSITION = 3.0, 0.01
"""Positions are taken to be in another unit if they are more than the first number of manipulator lengths away, or less
than the second number times each disk's distance from the base along the axis.  Choice: far from one either way, and
less than the factor of 100 or 1000 that centimetres and millimetres make."""
IN_MILLIMETRES = 300.0
"""Ratio of positions to the disk's distance along the axis above which they are taken for millimetres, and up to which
for centimetres: between a hundred and a thousand."""
JUDGING_SHARE = 0.9
"""Quantile of the positions, over the disk's distance along the axis, by which their unit is judged: the tenth beyond
may be gross outliers.  Choice."""
MOST_TURNS, MEAN_BEND = 1.5, 0.6
"""An angle is taken for degrees if it exceeds the first number of turns and the second, in rad, times the number of its
disk; a bend if it exceeds half a turn.  Choice: no rig coils up so far."""
DOUBTED_TOLERANCE = 0.3
"""Standard deviation of a place or a length, over the longest plate, above which its unit is doubted.  Choice."""
DOUBTED_POSITION, DOUBTED_ANGLE, DOUBTED_TENSION = 0.1, 0.3, 0.2
"""Standard deviations above which their unit is doubted: of positions over the length of the manipulator, of angles in
rad, and of tensions, relative.  Choice: nobody would read or pull so badly."""


def position_problems(
    readings: pd.DataFrame, manipulator: Manipulator, measurement: Measurement | None, where: str
) -> Iterator[Problem]:
    """Problems of positions that no disk of a manipulator of this length can have.

    `readings` has the columns of readings and `disk`.
    """
    positions = readings[[kind.column for kind in Kind if kind.is_position and kind.column in readings]]
    slack = FRAME_REACH * measurement.frame_position_sd_m if measurement else 0.0
    chain = manipulator.chain()
    along = np.concatenate([[np.nan], np.cumsum(chain.arc + 2 * chain.clamp + chain.disk)])
    relative = positions.abs().div(along[readings["disk"].to_numpy(int)], axis=0).max(axis=1).quantile(JUDGING_SHARE)
    length, guess = f"the manipulator is {chain.length:.4g} m long", ""
    if relative > FARTHEST_POSITION:
        guess = "; millimetres? write metres" if relative > IN_MILLIMETRES else "; centimetres? write metres"
    for name, column in positions.items():
        if (far := column.abs() > FARTHEST_POSITION * chain.length + slack).any():
            row, share = column.abs().idxmax(), f"{far.sum()} of {column.count()} readings are too far away"
            what = f"row {row + 1} is {column[row]:g}, but {length}{guess} ({share})"
            yield Problem(f"{where} column {name}", what)
    if len(positions.columns) == 2 and relative < NEAREST_POSITION:
        what = f"x_m and y_m reach only {positions.abs().max().max():.2g}, but {length}; all lengths are in metres"
        yield Problem(where, what)


def angle_problems(readings: pd.DataFrame, where: str) -> Iterator[Problem]:
    """Problems of angles and bends that are too large for radians; `readings` has these columns and `disk`."""
    limits = {Kind.ANGLE: np.maximum(2 * np.pi * MOST_TURNS, MEAN_BEND * readings["disk"]), Kind.BEND: np.pi}
    for kind, limit in limits.items():
        column = readings.get(kind.column)
        if column is not None and (column.abs() > limit).any():
            row = column.abs().idxmax()
            what = f"row {row + 1} is {column[row]:g}; degrees? write radians"
            yield Problem(f"{where} column {kind.column}", what)


def doubts(manipulator: Manipulator, measurement: Measurement, tolerance: Tolerance) -> Iterator[str]:
    """Sentences on standard deviations so large that they look like another unit."""
    length, position, angle = manipulator.chain().length, measurement.position_sd_m, measurement.angle_sd_rad
    if position and position > DOUBTED_POSITION * length:
        yield f"position_sd_m = {position:g} is much for a length of {length:.4g} m; in metres?"
    if angle and angle > DOUBTED_ANGLE:
        yield f"angle_sd_rad = {angle:g} is {math.degrees(angle):.3g} degrees; in radians?"
    if (share := measurement.tension_sd_relative) > DOUBTED_TENSION:
        yield f"tension_sd_relative = {share:g} is {share:.0%}; not in percent?"
    if (share := tolerance.thickness_relative) > DOUBTED_TENSION:
        yield f"thickness_relative = {share:g} is {share:.0%}; not in percent?"
    longest = max(segment.length_m for segment in manipulator.segment)
    for name in ("offset_m", "length_m", "marker_m"):
        if (sd := getattr(tolerance, name)) and sd > DOUBTED_TOLERANCE * longest:
            yield f"{name} = {sd:g} under [tolerance] is much for a plate of {longest:.4g} m; in metres?"
