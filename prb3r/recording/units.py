"""Foreign units betray themselves by their scale."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from prb3r.errors import Problem
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Kind, Measurement

FAR, NEAR = 3.0, 0.01
"""Positions are of another unit beyond so many lengths of the manipulator, or within so small a part of each disk's
distance from the base along the axis."""
TURNS, BEND = 1.5, 0.6
"""Angles beyond so many turns are taken for degrees, unless the plates up to there bend by less than this, rad."""


def scale_problems(
    readings: pd.DataFrame, manipulator: Manipulator, measurement: Measurement | None, where: str
) -> Iterator[Problem]:
    """Readings (`disk` and columns of :class:`Kind`, as numbers) that no manipulator of this length can give."""
    positions = readings[[kind.column for kind in Kind if kind.is_position and kind.column in readings]]
    slack = 3 * measurement.frame_position_sd_m if measurement else 0.0
    chain = manipulator.chain()
    along = np.concatenate([[np.nan], np.cumsum(chain.arc + 2 * chain.clamp + chain.disk)])
    relative = positions.abs().div(along[readings["disk"].to_numpy(int)], axis=0).max(axis=1).quantile(0.9)
    for name, column in positions.items():
        if (far := column.abs() > FAR * chain.length + slack).any():
            row, guess = column.abs().idxmax(), ""
            if relative > FAR:
                guess = "; millimetres? write metres" if relative > 300 else "; centimetres? write metres"
            what = f"row {row + 1} is {column[row]:g}, but the manipulator is {chain.length:.4g} m long{guess}"
            yield Problem(f"{where} column {name}", f"{what} ({far.sum()} of {column.count()} are too far away)")
    if len(positions.columns) == 2 and relative < NEAR:
        what = f"x_m and y_m reach {positions.abs().max().max():.2g} only, but the manipulator is {chain.length:.4g} m"
        yield Problem(where, f"{what} long; all lengths, those of the manipulator too, are in metres")
    for kind in (Kind.ANGLE, Kind.BEND):
        if kind.column in readings:
            column, disk = readings[kind.column], readings["disk"]
            limit = np.pi if kind is Kind.BEND else np.maximum(2 * np.pi * TURNS, BEND * disk)
            if (column.abs() > limit).any():
                row = column.abs().idxmax()
                yield Problem(
                    f"{where} column {kind.column}", f"row {row + 1} is {column[row]:g}; degrees? write radians"
                )


def doubts(manipulator: Manipulator, measurement: Measurement) -> Iterator[str]:
    """Standard deviations that look like another unit."""
    length, position, angle = manipulator.chain().length, measurement.position_sd_m, measurement.angle_sd_rad
    if position and position > length / 10:
        yield f"position_sd_m = {position:g} is much for a length of {length:.4g} m; in metres?"
    if angle and angle > 0.3:
        yield f"angle_sd_rad = {angle:g} is {np.degrees(angle):.0f} degrees; in radians?"
    if (share := measurement.tension_sd_relative) > 0.2:
        yield f"tension_sd_relative = {share:g} is {share:.0%}; not in percent?"
