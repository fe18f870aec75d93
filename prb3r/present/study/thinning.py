"""Selection of the states that figures and pages are made from, so that memory does not grow with the study.

Of clouds with many loads these are the first loads, which fill the same region.  Of many cases whose states no plot
draws these are the first cases, as a page has no room for all of them.
"""

import pandas as pd

from prb3r.runs.store import count_rows, read_first
from prb3r.study.chunk import state_columns
from prb3r.study.columns import named_columns
from prb3r.study.plots.base import Plot
from prb3r.study.run import Result

MOST_ROWS, FEWEST_LOADS = 2**21, 2**10
"""Rows of states that are read at most, but at least so many loads of every cloud."""
ALWAYS = ("case_id", "step", "disk", "x_m", "y_m")
"""Columns of the states of clouds that are always read; others are if the study names them, angles if a plot draws
them."""


def loads_to_draw(result: Result) -> int | None:
    """Number of first loads of every cloud that figures show; None: all, or the study has no cloud."""
    plan = result.plan
    if plan.study.cloud is None or plan.study.states != "path":
        return None
    disks = len(plan.study.state_disks or range(plan.cases[0].manipulator().plates + 1))
    most = max(FEWEST_LOADS, MOST_ROWS // (disks * len(plan.cases)))
    return most if most < _most_loads(result) else None


def _most_loads(result: Result) -> int:
    """The largest number of loads of a cloud of the study."""
    return max(int(family.settings["cloud"]["count"]) for family in result.plan.cases.families)


def states_to_draw(result: Result) -> pd.DataFrame | None:
    """The states that figures and page are made from; None if the study keeps none, or has no plot and no decision."""
    plan, table = result.plan, result.folder / "states.parquet"
    if plan.study.states == "none" or not (plan.study.plot or plan.study.decides):
        return None
    if plan.study.cloud is not None and plan.study.states == "path":
        most = loads_to_draw(result) or _most_loads(result)
        angles = {"angle_rad"} if any(plot.of_angles for plot in plan.study.plot) else set[str]()
        return read_first(table, {*ALWAYS, *angles, *named_columns(plan.study)}, "step", most).to_pandas()
    drawn = any(plot.of_states or not _columns_drawn(plot) <= set(result.cases) for plot in plan.study.plot)
    if drawn or (rows := count_rows(table)) <= MOST_ROWS:
        return result.states()
    last = max(0, MOST_ROWS * len(plan.cases) // rows - 1)
    return read_first(table, state_columns(plan.cables), "case_id", last).to_pandas()


def _columns_drawn(plot: Plot) -> set[str]:
    return {column for column in plot.drawn() if column}
