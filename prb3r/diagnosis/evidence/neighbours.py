"""Pairs of neighbouring readings, along the disks of a photograph or along the steps of a sequence."""

from typing import Literal

import numpy as np

from prb3r.recording.recording import Recording

Line = Literal["disks", "steps"]
NEIGHBOURS_ALONG: tuple[Line, ...] = "disks", "steps"


def neighbours(recording: Recording, line: Line) -> tuple[np.ndarray, np.ndarray]:
    """(k,) numbers of the first and (k,) of the second reading of every pair of neighbours of one kind along a line.

    Neighbours follow one another among the readings that there are; disks or steps without any are skipped.
    """
    readings = recording.readings
    held, place = (readings.step, readings.disk) if line == "disks" else (readings.disk, readings.step)
    order = np.lexsort((place, held, recording.of_sequence[readings.step], readings.kind))
    keys = np.stack([readings.kind, recording.of_sequence[readings.step], held])[:, order]
    alike = (np.diff(keys, axis=1) == 0).all(0)
    return order[:-1][alike], order[1:][alike]


def correlation(recording: Recording, residual: np.ndarray, line: Line) -> float:
    """Correlation of the residuals (r,) of neighbours along a line, about zero; 0 where there are no neighbours."""
    first, second = neighbours(recording, line)
    size = np.sqrt((residual[first] ** 2).sum() * (residual[second] ** 2).sum())
    return float(residual[first] @ residual[second] / size) if size else 0.0
