"""Fewer steps of a recording that was read many times a second.

A log of a drive holds hundreds of steps that differ by little: their noise lasts from one to the next, so they tell
hardly more than some of them, and what a diagnosis costs grows faster than their number.  The steps that are kept
describe the path of the loads, so that friction and play that follow it go the same way: straight lines between them
pass all loads closely (the algorithm of Ramer, Comput. Graph. Image Process. 1 (1972) 244, and Douglas and Peucker,
Cartographica 10 (1973) 112).
"""

import heapq

import numpy as np

from prb3r.recording.recording import Recording


def thinned(recording: Recording, most: int, fewest: int) -> Recording:
    """The recording with at most some `most` steps, and a remark that says so; as it is where it has no more.

    Every sequence keeps the same share of its steps, but at least `fewest`, or all where it has fewer.  What steps know
    of their past (elapsed steps, rates and travel of the tensions) is that of the whole recording.
    """
    steps = len(recording.steps)
    if steps <= most:
        return recording
    kept, path = [], path_of(recording)
    for number in range(len(recording.sequences)):
        rows = np.flatnonzero(recording.of_sequence == number)
        share = max(fewest, len(rows) * most // steps)
        kept.append(rows[steps_of_path(path[rows], share)])
    rows = np.concatenate(kept)
    if len(rows) == steps:
        return recording
    text = (
        f"of {steps} steps {len(rows)} are used, spread over every sequence with all turning points of its loads: more "
        "would tell hardly more of loads that change so little from one to the next"
    )
    return recording.at_steps(rows).with_remark(text)


def path_of(recording: Recording) -> np.ndarray:
    """(s, l) loads of every step that change at all, each over its largest change: tensions, forces on disks and
    tip."""
    spread = np.ptp(recording.every_load, axis=0)
    return recording.every_load[:, spread > 0] / spread[spread > 0]


def steps_of_path(path: np.ndarray, most: int) -> np.ndarray:
    """(k,) numbers of at most `most` points of a `path` (s, l), in order: both ends, and those that describe it best.

    One half are the points that lie farthest from the straight lines between those taken before.  The other half are
    put one after the other in the middle of the widest gap.
    """
    if len(path) <= most:
        return np.arange(len(path))
    taken = [0, len(path) - 1]
    gaps = [_farthest(path, 0, len(path) - 1)]
    while len(taken) < most // 2 and gaps:
        _, first, middle, last = heapq.heappop(gaps)
        taken.append(middle)
        for start, end in ((first, middle), (middle, last)):
            if end - start > 1:
                heapq.heappush(gaps, _farthest(path, start, end))
    while len(taken) < most:
        edges = np.sort(taken)
        widest = int(np.argmax(np.diff(edges)))
        taken.append(int(edges[widest] + edges[widest + 1]) // 2)
    return np.sort(taken)


def _farthest(path: np.ndarray, first: int, last: int) -> tuple[float, int, int, int]:
    """Minus the largest distance of a point between `first` and `last` from the line between both, `first`, the number
    of that point, `last`."""
    share = np.arange(1, last - first)[:, None] / (last - first)
    line = path[first] + share * (path[last] - path[first])
    distance = np.linalg.norm(path[first + 1 : last] - line, axis=1)
    farthest = int(np.argmax(distance))
    return -float(distance[farthest]), first, first + 1 + farthest, last
