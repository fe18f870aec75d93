"""Whether plates would yield in cases of a study that asks for no safety factor."""

import pandas as pd

from prb3r.model.files.cells import count
from prb3r.study.spec import Study

SAFETY = "safety_factor"
OF_STRENGTH = {SAFETY, "peak_stress_pa", "peak_strain"}
"""Columns of the metric `safety`."""


def yield_warnings(cases: pd.DataFrame, study: Study) -> list[str]:
    """A warning of cases in which plates would yield, with the worst; none where a requirement judges their safety.

    Parameters
    ----------
    cases : the table of all cases; without the column of the metric `safety` there is no warning.
    """
    if SAFETY not in cases or any(requirement.metric in OF_STRENGTH for requirement in study.requirement):
        return []
    yields = cases[SAFETY] < 1
    if not yields.any():
        return []
    worst = cases.loc[cases[SAFETY].idxmin()]
    return [
        f"Plates would yield in {yields.sum()} of {count(len(cases), 'case')}, which no requirement rules out: "
        f"the lowest safety factor is {worst[SAFETY]:.3g}, in case {worst['case_id']}. "
        f"A requirement on {SAFETY} (at_least) excludes such designs."
    ]
