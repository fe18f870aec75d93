"""What a study does not ask of its designs, although some of its cases fall short of it: strength, and targets."""

import pandas as pd

from prb3r.model.files.cells import count
from prb3r.study.spec import Study

SAFETY = "safety_factor"
OF_STRENGTH = {SAFETY, "peak_stress_pa", "peak_strain"}
"""Columns of the metric `safety`."""
SHARE_REACHED = "reached_share"
OF_TARGETS = {SHARE_REACHED, "first_missed", "farthest_off_m", "most_turned_off_rad", "reachable_share"}
"""Columns of the metric `follow` that tell whether targets are reached."""


def unasked_warnings(cases: pd.DataFrame, study: Study) -> list[str]:
    """Warnings of plates that yield and of targets that are missed where no requirement rules that out; `cases` is the
    table of all cases."""
    return [*_yielding(cases, study), *_missed(cases, study)]


def _missed(cases: pd.DataFrame, study: Study) -> list[str]:
    """A warning of cases in which targets are missed, in a study that decides between designs."""
    if SHARE_REACHED not in cases or not study.decides or any(wish.metric in OF_TARGETS for wish in study.requirement):
        return []
    missed = cases[SHARE_REACHED] < 1
    if not missed.any():
        return []
    return [
        f"Targets are missed in {missed.sum()} of {count(len(cases), 'case')}, which no requirement rules out. "
        f"A requirement on {SHARE_REACHED} (at_least = 1) excludes such designs."
    ]


def _yielding(cases: pd.DataFrame, study: Study) -> list[str]:
    """A warning of cases in which plates would yield, with the worst, and of requirements that hold by themselves.

    Where a requirement judges the strength of plates there is no warning of the former.

    Parameters
    ----------
    cases : the table of all cases; without the column of the metric `safety` there is no warning.
    """
    if SAFETY not in cases:
        return []
    asked = [(number, wish) for number, wish in enumerate(study.requirement, 1) if wish.metric in OF_STRENGTH]
    if study.cloud is not None and cases[SAFETY].notna().any():
        safety = study.cloud.safety
        kept = [n for n, wish in asked if wish.metric == SAFETY and wish.at_least is not None and wish.limit <= safety]
        if kept:
            return [
                f"Requirement {number} holds by itself: loads of the cloud with a {SAFETY} below {safety:g} do not "
                "count. Ask for a small workspace_beyond_yield (at_most) instead, or count all loads ([cloud] safety = "
                "0)."
                for number in kept
            ]
    yields = cases[SAFETY] < 1
    if asked or not yields.any():
        return []
    worst = cases.loc[cases[SAFETY].idxmin()]
    return [
        f"Plates would yield in {yields.sum()} of {count(len(cases), 'case')}, which no requirement rules out: "
        f"the lowest safety factor is {worst[SAFETY]:.3g}, in case {worst['case_id']}. "
        f"A requirement on {SAFETY} (at_least) excludes such designs."
    ]
