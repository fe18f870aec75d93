"""Results in detail: confusion matrix, and scores by effect and size."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from prb3r.proof.judging.intervals import share_of
from prb3r.proof.judging.opened import OpenedCase, confident, first_right, mentioned, size_class
from prb3r.proof.settings import SETTINGS


def confusion(cases: Sequence[OpenedCase]) -> tuple[list[str], list[str], np.ndarray]:
    """True kinds, named kinds and counts, of single effects above the detectable size."""
    chosen = [
        case
        for case in cases
        if case.label.cls == "single" and size_class(case.label) > min(SETTINGS.population.multiples)
    ]
    rows = sorted({case.label.kinds[0] for case in chosen})
    columns = [*rows, "another kind", "adequate", "unexplained", "failed"]
    table = np.zeros((len(rows), len(columns)), int)
    for case in chosen:
        named = confident(case.verdict)
        said = named[0].kind if named else case.verdict.verdict
        said = said if said in columns else "another kind"
        table[rows.index(case.label.kinds[0]), columns.index(said)] += 1
    return rows, columns, table


def by_effect(cases: Sequence[OpenedCase]) -> list[dict[str, Any]]:
    """Rows of kind, size, and the scores `first` (of the distinguishable) and `among` (of all), single effects."""
    out = []
    chosen = [case for case in cases if case.label.cls == "single"]
    for kind in sorted({case.label.kinds[0] for case in chosen}):
        for size in SETTINGS.population.multiples:
            alike = [c for c in chosen if c.label.kinds[0] == kind and size_class(c.label) == size]
            if alike:
                right = share_of([first_right(c) for c in alike if c.label.distinguishable])
                among = share_of([c.label.kinds[0] in mentioned(c.verdict) for c in alike])
                out.append({"kind": kind, "size": size, "first": right, "among": among})
    return out
