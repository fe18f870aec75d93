"""The smallest effects that a recording would have shown."""

from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.library.hypothesis import LARGEST_EXPONENT, Free, Hypothesis
from prb3r.diagnosis.settings import Settings


@dataclass(frozen=True)
class Detectable:
    """The smallest effect of a kind that the recording would have shown."""

    hypothesis: Hypothesis
    size: float | None
    """Change of the free parameter `free`, in its unit; None for an effect that does not vanish continuously."""
    shown: bool
    """Whether the effect would have shown; always True where it vanishes continuously and has a `size`."""
    free: Free | None = None
    """The first free parameter that moves any reading; None where there is no `size`."""


def detectable(judged: Scores, settings: Settings) -> tuple[Detectable, ...]:
    """For each kind of effect, the smallest that the recording would have shown, at the place where it shows best.

    It shows where it moves the whitened readings by `Settings.detectable` or more.  Where an effect has several free
    parameters, `Alternative.size` is that of the one felt least.
    """
    best: dict[str, Detectable] = {}
    for candidate in judged.alternatives:
        hypothesis = candidate.subject
        if not isinstance(hypothesis, Hypothesis) or candidate.size == 0:
            continue
        known = best.get(hypothesis.kind)
        if not hypothesis.continuous:
            shown = candidate.size > settings.detectable
            if known is None or (shown and not known.shown):
                best[hypothesis.kind] = Detectable(hypothesis, None, shown)
            continue
        free, u = hypothesis.free[candidate.parameter], settings.detectable / candidate.size
        way = -1.0 if free.null == free.high else 1.0  # an efficiency of 1 can only fall
        exponent = way * min(u, LARGEST_EXPONENT)
        size = abs(free.null * np.expm1(exponent)) if free.log else abs(free.value(way * u) - free.null)
        if known is None or known.size is None or size < known.size:
            best[hypothesis.kind] = Detectable(hypothesis, float(size), True, free)
    return tuple(best.values())
