"""Decisions between designs: over all their cases, or for each value of a circumstance by itself."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError
from prb3r.study.compare import select
from prb3r.study.decision import Decision, wish_columns
from prb3r.study.designs import DesignCases, known_values

ALL_ALIKE = "all of them alike"
"""What comes first where preferences tell no design from another."""


def decide(cases: DesignCases) -> Decision:
    """The decision between the designs of `cases` by their requirements and preferences.

    Requirements are judged over all cases of a design, preferences over the scenarios that all designs share and in
    which no design that keeps the requirements fails.

    Raises
    ------
    SpecError
        If no scenario has cases of all designs.
    """
    frame, names, wishes = cases.frame, cases.names, cases.wishes
    bounded = cases.values(wishes.requirement, frame)
    per_design = [set(frame.loc[frame["design"] == name, "scenario"]) for name in names]
    shared, every = set.intersection(*per_design), set.union(*per_design)
    if not shared:
        raise SpecError(Problem("compare", "the designs share no case"))
    margins = [[r.margin(v) for r, v in zip(wishes.requirement, row, strict=True)] for row in bounded]
    able = {name for name, row in zip(names, margins, strict=True) if min(row, default=0.0) >= 0}
    wanted = [np.isnan(known_values(frame, preference.metric)) for preference in wishes.preference]
    without = (frame["outcome"] != "converged") & np.any([np.zeros(len(frame), bool), *wanted], axis=0)
    lost = without & frame["design"].isin(able or set(names))
    failed = set(frame.loc[lost, "scenario"]) & shared
    fails = [frame[without & (frame["design"] == name) & frame["scenario"].isin(shared)] for name in names]
    kept = frame[frame["scenario"].isin(shared - failed)]
    values = cases.values(wishes.preference, kept)
    return Decision(
        designs=names,
        requirements=wishes.requirement,
        preferences=wishes.preference,
        bounded=bounded,
        values=pd.DataFrame(values, names, wish_columns(wishes.preference)),
        quantities=[cases.quantity(criterion) for criterion in wishes.criteria],
        shared=len(shared),
        left_out=len(every) - len(shared),
        failed=len(failed),
        fails=[rows["scenario"].nunique() for rows in fails],
        missing=cases.missing(wishes.requirement),
        counted=[select(kept, preference.where)["scenario"].nunique() for preference in wishes.preference],
        remark=cases.remark,
    )


def by_circumstance(cases: DesignCases) -> dict[str, list[tuple[Any, str | None]]]:
    """By circumstance, each of its values with the design that wins in the cases with this value alone.

    The winner is None where no design keeps the requirements, or where each of them fails.  Circumstances with a single
    value, or with a value at which a wish has no cases that count, are left out.
    """
    winners = {}
    for column in cases.circumstances:
        parts = [(value, cases.only(column, value)) for value in cases.frame[column].drop_duplicates()]
        counted = (select(part.frame, c.where) for _, part in parts for c in cases.wishes.criteria)
        if len(parts) > 1 and not any(rows.empty for rows in counted):
            winners[column] = [(value, _winner(part)) for value, part in parts]
    return winners


def _winner(cases: DesignCases) -> str | None:
    """The design that wins; where in each case some design fails that keeps the requirements, of those that fail in
    none; None if there is no such design either."""
    decision = decide(cases)
    if decision.failed < decision.shared or not decision.preferences:
        return _first_of(decision)
    sound = [name for name, number in zip(decision.designs, decision.fails, strict=True) if not number]
    if not sound:
        return None
    return _first_of(decide(replace(cases, frame=cases.frame[cases.frame["design"].isin(sound)])))


def _first_of(decision: Decision) -> str | None:
    """The design that comes first, or all that preferences do not tell from it; None if no design will do."""
    if not decision.preferences or decision.winner is None:
        return decision.winner
    best = decision.ranking[0]
    alike = [k for k in decision.ranking if np.array_equal(decision.scores[k], decision.scores[best])]
    return ALL_ALIKE if 1 < len(alike) == len(decision.designs) else " and ".join(decision.designs[k] for k in alike)
