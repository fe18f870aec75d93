"""Loads as kernels see them: what acts at a step is one row of numbers."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.chain import Loads
from prb3r.mechanics.kernel import kernel

ORDER = ("tension", "force", "tip", "moment", "slip", "elapsed")
"""Of the fields in a row: first those that add up to what hangs on the chain."""


@bundle
class LoadRow(NamedTuple):
    """What acts in one state of a chain of `n` plates and `m` cables: a row, and the parts of it by their names."""

    row: np.ndarray
    """All numbers; the fields below are views of it."""
    tension: np.ndarray
    """(m,) as in :class:`Loads`, like all others."""
    force: np.ndarray
    """(n, 2)."""
    tip: np.ndarray
    """(2,)."""
    moment: np.ndarray
    """(n,)."""
    slip: np.ndarray
    """(m,)."""
    elapsed: np.ndarray
    """(1,)."""


def rows_of_loads(loads: Loads) -> np.ndarray:
    """(s, l) every step of `loads` as one row."""
    return np.concatenate([getattr(loads, name).reshape(loads.steps, -1) for name in ORDER], axis=1)


def load_row(loads: Loads) -> LoadRow:
    """Room for what acts in one state, with the shapes of `loads`."""
    cables, plates = loads.tension.shape[1], loads.moment.shape[1]
    ends = np.cumsum((cables, 2 * plates, 2, plates, cables, 1)).tolist()
    row = np.zeros(ends[-1])
    tension, force, tip, moment, slip, elapsed = (row[a:b] for a, b in pairwise((0, *ends)))
    return LoadRow(row, tension, force.reshape(plates, 2), tip, moment, slip, elapsed)


@kernel
def blend(start, target, share, now):
    """Write the loads `share` of the way between two rows to `now`.

    Where the way begins at rest, slips are those of its end from the beginning: `slip_from_the_start`.
    """
    for i in range(len(now.row)):
        now.row[i] = start[i] + share * (target[i] - start[i])


@kernel
def slip_from_the_start(target, now):
    """Give `now` the slips of the row `target`."""
    first = len(now.row) - len(now.slip) - 1
    for j in range(len(now.slip)):
        now.slip[j] = target[first + j]
