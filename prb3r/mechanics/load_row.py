"""Loads as kernels see them: all that acts at a step stands in one row of numbers, so that steps are easily blended."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.chain import Loads
from prb3r.mechanics.kernel import kernel

ORDER = ("tension", "force", "tip", "moment", "slip", "elapsed", "time")
"""Order of the fields of `Loads` in a row: first the mechanical loads, then slip, elapsed steps and time.  Rate and
travel are left out, as `acting` has multiplied what they do into the slip."""


@bundle
class LoadRow(NamedTuple):
    """Loads in one state of a chain of `n` plates and `m` cables: a row, and views of its parts by name."""

    row: np.ndarray
    """(l,) all numbers in the `ORDER` of fields; the fields below are views of it."""
    tension: np.ndarray
    """(m,) as in :class:`Loads`, like all fields below."""
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
    time: np.ndarray
    """(1,)."""


def rows_of_loads(loads: Loads) -> np.ndarray:
    """(s, l) the steps of `loads`, each as one row of numbers in the `ORDER` of fields."""
    return np.concatenate([getattr(loads, name).reshape(loads.steps, -1) for name in ORDER], axis=1)


def load_row(loads: Loads) -> LoadRow:
    """A `LoadRow`, all zero, for one state of a chain under such `loads`."""
    cables, plates = loads.tension.shape[1], loads.moment.shape[1]
    ends = np.cumsum((cables, 2 * plates, 2, plates, cables, 1, 1)).tolist()
    row = np.zeros(ends[-1])
    tension, force, tip, moment, slip, elapsed, time = (row[a:b] for a, b in pairwise((0, *ends)))
    return LoadRow(row, tension, force.reshape(plates, 2), tip, moment, slip, elapsed, time)


@kernel
def blend(start, target, share, now):
    """Write the loads at `share` (0 to 1) of the way from row `start` to row `target` to `now`.

    Slips are interpolated too.  From rest, where none is declared, they are to be those of the target from the
    beginning: then `slip_from_the_start` has to follow.
    """
    for i in range(len(now.row)):
        now.row[i] = start[i] + share * (target[i] - start[i])


@kernel
def slip_from_the_start(target, now):
    """Overwrite the slips of `now` with those of the row `target`."""
    first = len(now.row) - len(now.slip) - 2
    for j in range(len(now.slip)):
        now.slip[j] = target[first + j]
