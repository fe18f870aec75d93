"""Scores in detail: confusion matrix, and scores by effect and size."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from prb3r.proof.judging.intervals import share_of
from prb3r.proof.judging.opened import OpenedCase, confident, first_right, mentioned, size_class
from prb3r.proof.settings import SETTINGS


def confusion(cases: Sequence[OpenedCase]) -> tuple[list[str], list[str], np.ndarray]:
    """Confusion matrix of single effects above the smallest of the population's sizes: true kinds (rows), kinds or
    verdicts given (columns), and counts (rows, columns).  Only the effect that is named first counts."""
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
    """One row for each kind and size of single effects: `kind`, `size`, and two scores.

    `first` is the share of the distinguishable ones that are named first, `among` the share of all that are named or
    listed as indistinguishable.
    """
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
