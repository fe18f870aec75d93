"""Steps whose loads another sequence carried too.

Two sequences repeat one another if they carry the same loads after the same length of path through load space.  They
need not have been read at the same loads: between two steps of a sequence, what a model leaves changes steadily.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording


class Match(NamedTuple):
    """A step that lies on the load path of another sequence."""

    step: int
    """Row of the step."""
    before: int
    after: int
    """Rows of the steps of the other sequence between which it lies; the same row twice where it meets one."""
    share: float
    """Share of the way from `before` to `after` at which it lies."""


def matches(recording: Recording, settings: Settings) -> Iterator[tuple[int, Match]]:
    """Every step that lies on the path of a later sequence, with the number of the pair of sequences.

    A pair counts if its loads differ by no more than `Settings.same_loads` as far as both sequences go.
    """
    rows = [np.flatnonzero(recording.of_sequence == k) for k in range(len(recording.sequences))]
    for pair, (first, second) in enumerate(combinations(rows, 2)):
        yield from ((pair, match) for match in _on_path(recording.every_load, first, second, settings))


def _on_path(loads: np.ndarray, first: np.ndarray, second: np.ndarray, settings: Settings) -> list[Match]:
    """The matches of the steps `first` on the path of the steps `second`, rows of `loads` (s, k), N; none if the loads
    differ anywhere."""
    here, there = (np.vstack([np.zeros(loads.shape[1]), loads[rows]]) for rows in (first, second))
    far, along = (np.append(0.0, np.cumsum(np.abs(np.diff(path, axis=0)).sum(1))) for path in (here, there))
    matches, highest = [], np.abs(loads[[*first, *second]]).max()
    tolerance = settings.same_loads * highest
    for step, at, load in zip(first, far[1:], here[1:], strict=True):
        if at > along[-1] + tolerance:
            break
        k = max(min(int(np.searchsorted(along, at)), len(second)), 1)
        way = along[k] - along[k - 1]
        share = float(np.clip((at - along[k - 1]) / way, 0, 1)) if way > 0 else 1.0
        if np.abs((1 - share) * there[k - 1] + share * there[k] - load).max() > tolerance:
            return []
        if share == 1.0:
            matches.append(Match(int(step), int(second[k - 1]), int(second[k - 1]), share))
        elif k > 1 and way <= settings.closely_read * highest:  # at rest nothing is read
            matches.append(Match(int(step), int(second[k - 2]), int(second[k - 1]), share))
    return matches
