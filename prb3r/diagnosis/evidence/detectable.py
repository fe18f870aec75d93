"""What a recording would have shown."""

from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.evidence.score_test import DETECTABLE, Scores
from prb3r.diagnosis.library.hypothesis import LARGEST_EXPONENT, Hypothesis


@dataclass(frozen=True)
class Detectable:
    """The smallest effect of a kind that the recording would have shown."""

    hypothesis: Hypothesis
    size: float | None
    """Change of the first free parameter; None for an effect without degrees."""
    shown: bool
    """Whether an effect without degrees would have shown."""


def detectable(judged: Scores) -> tuple[Detectable, ...]:
    best: dict[str, Detectable] = {}
    for each in judged.directions:
        hypothesis = each.subject
        if not isinstance(hypothesis, Hypothesis) or each.size == 0:
            continue
        if not hypothesis.by_degrees:
            found = Detectable(hypothesis, None, each.size > DETECTABLE)
            if hypothesis.kind not in best or (found.shown and not best[hypothesis.kind].shown):
                best[hypothesis.kind] = found
            continue
        free = hypothesis.free[0]
        size = abs(free.value(DETECTABLE / each.size) - free.null)
        if free.log:
            size = abs(free.null * np.expm1(min(DETECTABLE / each.size, LARGEST_EXPONENT)))
        old = best.get(hypothesis.kind)
        if old is None or old.size is None or size < old.size:
            best[hypothesis.kind] = Detectable(hypothesis, float(size), True)
    return tuple(best.values())
