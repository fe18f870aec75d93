"""Results in detail: confusion matrix, and scores by effect and size."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from prb3r.proof.judging.intervals import share_of
from prb3r.proof.judging.opened import Judged, confident, first_right, mentioned, size_class


def confusion(cases: Sequence[Judged]) -> tuple[list[str], list[str], np.ndarray]:
    """True kinds, named kinds and counts, of single effects at 2 and 5 times the detectable size."""
    chosen = [case for case in cases if case.label.cls == "single" and size_class(case.label) > 1]
    rows = sorted({case.label.kinds[0] for case in chosen})
    columns = [*rows, "another kind", "adequate", "unexplained", "failed"]
    table = np.zeros((len(rows), len(columns)), int)
    for case in chosen:
        named = confident(case.verdict)
        said = named[0].kind if named else case.verdict.verdict
        said = said if said in columns else "another kind"
        table[rows.index(case.label.kinds[0]), columns.index(said)] += 1
    return rows, columns, table


def by_effect(cases: Sequence[Judged]) -> list[dict[str, Any]]:
    """Right first, by kind and size."""
    out = []
    chosen = [case for case in cases if case.label.cls == "single"]
    for kind in sorted({case.label.kinds[0] for case in chosen}):
        for size in (1.0, 2.0, 5.0):
            own = [c for c in chosen if c.label.kinds[0] == kind and size_class(c.label) == size]
            apart = [first_right(c) for c in own if c.label.distinguishable]
            if own:
                right = share_of(apart)
                among = share_of([c.label.kinds[0] in mentioned(c.verdict) for c in own])
                out.append({"kind": kind, "size": size, "first": right, "among": among})
    return out
