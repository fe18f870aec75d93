"""Whether workspaces have converged: with the number of their loads, and with the size of the cells of their areas."""

import pandas as pd

from prb3r.study.columns import named_columns
from prb3r.study.compare import with_comparisons
from prb3r.study.spec import Study

AREA, COARSE, EXTRAPOLATED = "workspace_area_m2", "workspace_coarse_m2", "workspace_extrapolated_m2"

SETTLED_SHARE = 0.9
"""Share of a workspace below which the first half of its loads reaches too little to call the workspace converged."""
LEFT_SHARE = 0.9
"""Share of an area below which too little is left of it, extrapolated to cells of no size, to call it that of the
region.  Choice."""
CURVE_SHARE = 0.5
"""The same share of a region that is as good as a curve: it is thinner than a cell, so that most of the area is that of
cells along its edge."""
MOVED_RATIO = 0.1
"""Relative change of a ratio of areas, extrapolated to cells of no size, beyond which it is warned of.  Choice."""
MOST_DROPPED = 0.25
"""Share of the loads of a workspace that may not count before this is warned of.  Choice."""


def workspace_warnings(cases: pd.DataFrame, study: Study) -> list[str]:
    """Warnings about workspaces that have not converged, or of which many loads do not count; none if all is well.

    Areas that depend on the size of their cells are warned of, unless the study uses other columns of its workspaces
    alone: those that are compared, drawn or wished for.

    Parameters
    ----------
    cases : the table of all cases; without columns of the metric `workspace` there is no warning.
    """
    if AREA not in cases:
        return []
    used = {name for name in named_columns(study) if name.startswith("workspace_")}
    said = _few_loads(cases)
    if not used or AREA in used:
        said += _cells(cases) + _ratios(cases, study)
    return said + _dropped(cases)


def _few_loads(cases: pd.DataFrame) -> list[str]:
    """A warning of workspaces that still grow with their loads."""
    shares = cases["workspace_half_share"]
    few = shares[shares < SETTLED_SHARE]
    if few.empty:
        return []
    return [
        f"{len(few)} of {len(shares)} workspaces still grow with the number of loads: the first half reaches as "
        f"little as {100 * few.min():.0f} % of the area. Give more loads (count); larger cells (cell) hide this, and "
        "add more along the edge."
    ]


def _cells(cases: pd.DataFrame) -> list[str]:
    """Warnings of areas that depend on their cells, told apart by the remedy, where there are enough loads to tell."""
    left = (cases[EXTRAPOLATED] / cases[AREA].where(cases[AREA] > 0)).where(_settled(cases))
    thin, edged, said = left < CURVE_SHARE, (left >= CURVE_SHARE) & (left < LEFT_SHARE), []
    if thin.any():
        said.append(
            f"{thin.sum()} of {len(cases)} workspaces are thinner than a cell, as good as curves: extrapolated to "
            f"cells of no size, {_from_to(left[thin])} % of the area is left, and what is counted is cells along the "
            "curve. Compare the outline (workspace_hull_m2) or the width (workspace_width_m) of such, not the area."
        )
    if edged.any():
        said.append(
            f"{edged.sum()} of {len(cases)} areas depend on the size of the cells: extrapolated to cells of no size, "
            f"{_from_to(left[edged])} % is left. Give smaller cells (cell) together with more loads (count), four "
            "times as many for cells half as wide, or compare workspace_extrapolated_m2."
        )
    return said


def _ratios(cases: pd.DataFrame, study: Study) -> list[str]:
    """A warning for each ratio of areas that depends on the cells, with the case where it does most."""
    said = []
    for comparison in study.comparison:
        if comparison.kind != "ratio" or comparison.of != AREA:
            continue
        asked = [comparison.model_copy(update={"of": of}) for of in (AREA, COARSE, EXTRAPOLATED)]
        here, coarse, finest = (
            with_comparisons(cases, study.model_copy(update={"comparison": [each]}), {})[comparison.name].where(
                _settled(cases)
            )
            for each in asked
        )
        moved = ((finest - here) / here.where(here > 0)).abs()
        if many := int((moved > MOVED_RATIO).sum()):
            most = moved.idxmax()
            said.append(
                f"{comparison.name}, a ratio of areas, depends on the size of the cells, in {many} of {len(cases)} "
                f"cases by more than {100 * MOVED_RATIO:.0f} %: in case {cases.loc[most, 'case_id']} it is "
                f"{here[most]:.2g}, in cells twice as wide {coarse[most]:.2g}, and extrapolated to cells of no size "
                f"{finest[most]:.2g}. Compare {EXTRAPOLATED}, workspace_hull_m2 or workspace_width_m."
            )
    return said


def _dropped(cases: pd.DataFrame) -> list[str]:
    """A warning of workspaces of which many loads do not count."""
    loads, dropped = cases["workspace_loads"], cases["workspace_dropped"]
    if not (many := int((dropped > MOST_DROPPED).sum())):
        return []
    worst = dropped.idxmax()
    return [
        f"{many} of {len(dropped)} workspaces lose many loads: up to {100 * dropped[worst]:.0f} % bring plates too "
        f"near to yield or have no equilibrium, and are not replaced: area, outline and hull rest on "
        f"{loads[worst]:,.0f} loads and come out too small, the more so the larger the tensions. Give more loads "
        "(count) or smaller tensions (tension_n), and compare workspaces of about as many loads (workspace_loads)."
    ]


def _settled(cases: pd.DataFrame) -> pd.Series:
    """Whether the loads of each case fill its cells: among points that stand alone no area can be extrapolated."""
    return cases["workspace_half_share"] >= SETTLED_SHARE


def _from_to(shares: pd.Series) -> str:
    """The lowest and the highest of shares in per cent, or the one number that both are."""
    low, high = (f"{100 * share:.0f}" for share in (shares.min(), shares.max()))
    return low if low == high else f"{low} to {high}"
