"""Shipped studies, solved in small."""

from collections.abc import Collection
from pathlib import Path

import numpy as np
import pandas as pd

from prb3r.study.chunk import Chunk
from prb3r.study.plan import plan_study
from prb3r.study.work import solve_chunk

STUDIES = Path(__file__).parents[2] / "studies"


def small(
    name: str, *, cloud: int | None = None, every: int = 1, metrics: Collection[str] = (), **keep
) -> pd.DataFrame:
    """The rows of a shipped study whose factors have the values `keep`, with comparisons, solved in this process.

    `metrics` are the kinds that are computed, all where none is named; clouds have `cloud` loads, and of the targets of
    a path there is one in `every`.
    """
    from prb3r.study.compare import with_comparisons
    from prb3r.study.tables import labelled, straight_lengths

    plan = plan_study(STUDIES / f"{name}.toml")
    wanted = tuple(
        metric.model_copy(update={"count": cloud}) if cloud and metric.kind == "workspace" else metric
        for metric in plan.study.metric
        if not metrics or metric.kind in metrics
    )
    chosen = [
        case.number
        for case in plan.cases
        if all(np.any([_same(case.factors[factor], value) for value in values]) for factor, values in keep.items())
    ]
    families = [part for number in chosen for part in plan.cases.between(number, number + 1)]
    assert families
    for family in families if cloud else ():
        family.settings["cloud"]["count"] = cloud
    for family in families if every > 1 else ():
        family.settings["reach"]["target"] = family.settings["reach"]["target"][::every]
    columns, _ = solve_chunk(Chunk(tuple(families), wanted, "none", None, plan.cables))
    frame = labelled(plan.cases, columns)
    assert (frame["outcome"] == "converged").all(), frame["reason"].tolist()
    return with_comparisons(frame, plan.study, straight_lengths(families))


def _same(a, b) -> bool:
    return np.isclose(a, b, rtol=1e-9) if isinstance(b, (int, float)) else a == b
