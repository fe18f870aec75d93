"""Whether plates would yield in cases of a study that asks for no safety factor, or asks it of loads that have it."""

import pandas as pd

from prb3r.model.files.cells import count
from prb3r.study.spec import Study

SAFETY = "safety_factor"
OF_STRENGTH = {SAFETY, "peak_stress_pa", "peak_strain"}
"""Columns of the metric `safety`."""


def yield_warnings(cases: pd.DataFrame, study: Study) -> list[str]:
    """A warning of cases in which plates would yield, with the worst, and of requirements that hold by themselves.

    Where a requirement judges the strength of plates there is no warning of the former.

    Parameters
    ----------
    cases : the table of all cases; without the column of the metric `safety` there is no warning.
    """
    if SAFETY not in cases:
        return []
    asked = [number for number in enumerate(study.requirement, 1) if number[1].metric in OF_STRENGTH]
    if study.cloud is not None:
        return [
            f"Requirement {number} holds by itself: loads of the cloud with a {SAFETY} below {study.cloud.safety:g} do "
            "not count. Ask for a small workspace_beyond_yield (at_most) instead, or count all loads ([cloud] safety = "
            "0)."
            for number, requirement in asked
            if requirement.metric == SAFETY and (requirement.at_least or 0.0) <= study.cloud.safety
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
