"""Whether the front of a search has settled: how far its last designs have moved it."""

import numpy as np

from prb3r.study.decision import Decision

MOVED = 0.05
"""Shift of the front in the last third of a search above which it has not settled, as a share of its extent.
Choice."""


def front_shift(decision: Decision) -> float:
    """How far the last third of the designs, in the order in which they were tried, moved the Pareto front.

    The additive epsilon of the front before against the last one (Zitzler and others, IEEE Transactions on Evolutionary
    Computation 7, 2003, 117): the least shift, as a share of the extent of the front in each preference, by which the
    designs before would be as good as any on it.  0 for a front of less than two designs; infinite if none of the
    designs before keeps the requirements.
    """
    front = decision.scores[np.array(decision.front, bool)]
    if len(front) < 2 or len(decision.preferences) < 2:
        return 0.0
    early = np.arange(len(decision.designs)) < 2 * len(decision.designs) // 3
    before = decision.scores[early & decision.feasible]
    extent = np.where(np.ptp(front, axis=0) > 0, np.ptp(front, axis=0), 1.0)
    behind = ((front[:, None] - before) / extent).max(2, initial=-np.inf)
    return max(0.0, float(behind.min(1, initial=np.inf).max()))


def unsettled(decision: Decision) -> str:
    """A sentence where the front still moved in the last third of a search, and how to go on; empty if it did not."""
    shift = front_shift(decision)
    if shift <= MOVED:
        return ""
    how = f"by {100 * shift:.0f} % of its extent" if np.isfinite(shift) else "from nothing"
    return (
        f"The front still moved in the last third of the search, {how}: it has not settled. "
        f"Try more designs (designs = {2 * len(decision.designs)} in [search]). The search then goes another way: of "
        "what is stored, only designs that it meets again, such as the first ones, are not computed again."
    )
