"""Which states figures are drawn from: of clouds of many loads the first of these, which fill the same region."""

import pandas as pd

from prb3r.runs.store import read_first
from prb3r.study.columns import named_columns
from prb3r.study.run import Result

MOST_ROWS, FEWEST_LOADS = 2**21, 2**10
"""Rows of states that are read for figures; loads of every cloud among them at least."""
ALWAYS = ("case_id", "step", "disk", "x_m", "y_m")


def loads_to_draw(result: Result) -> int | None:
    """First loads of every cloud that figures show; None: all steps."""
    plan = result.plan
    if plan.study.cloud is None or plan.study.states != "path":
        return None
    disks = len(plan.study.state_disks or range(plan.cases[0].manipulator().plates + 1))
    most = max(FEWEST_LOADS, MOST_ROWS // (disks * len(plan.cases)))
    return most if most < max(family.settings["cloud"]["count"] for family in plan.cases.families) else None


def states_to_draw(result: Result) -> pd.DataFrame | None:
    """The states that figures are drawn from; None if the study keeps none."""
    most = loads_to_draw(result)
    if most is None:
        return result.states()
    wanted = {*ALWAYS, *named_columns(result.plan.study)}
    return read_first(result.folder / "states.parquet", wanted, "step", most).to_pandas()
