"""Comparisons between cases of one study: differences to a baseline case, and fitted straight lines."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from prb3r.study.spec import LineFit, Study
from prb3r.study.wishes import Scalar


def select(frame: pd.DataFrame, where: Mapping[str, Any]) -> pd.DataFrame:
    """The rows where each column of `where` has the given value or one of a list; numbers compared to nine digits."""
    for name, wanted in where.items():
        options = wanted if isinstance(wanted, list) else [wanted]
        frame = frame[np.any([_equal(frame[name], option) for option in options], axis=0)]
    return frame


def _equal(column: pd.Series, value: Scalar) -> np.ndarray:
    """(rows,) whether a column has the value, numbers up to a relative difference of 1e-9."""
    if isinstance(value, (int, float)) and not isinstance(value, bool) and column.dtype.kind in "fi":
        return np.isclose(column.to_numpy(float), value, rtol=1e-9, atol=1e-12)
    return (column == value).to_numpy()


def with_comparisons(cases: pd.DataFrame, study: Study, lengths: Mapping[int, float]) -> pd.DataFrame:
    """`cases` with a column for each comparison; NaN where either case has no value or the baseline case is missing.

    Parameters
    ----------
    lengths : straight length of the manipulator, m, by number of the case; needed by comparisons relative to it.
    """
    cases = cases.copy()
    factors = [factor.name for factor in study.factor]
    for comparison in study.comparison:
        rest = [name for name in factors if name not in comparison.to]
        base = select(cases, comparison.to)
        columns = [comparison.of]
        if comparison.kind == "distance":
            columns = [f"{comparison.of}_x_m", f"{comparison.of}_y_m"]
        if rest:
            known = base.drop_duplicates(rest)[list(dict.fromkeys([*rest, *columns]))]
            paired = cases[rest].merge(known, on=rest, how="left")
        else:
            paired = pd.concat([base[columns]] * len(cases), ignore_index=True)
        compared, other = cases[columns].to_numpy(float), paired[columns].to_numpy(float)
        with np.errstate(divide="ignore", invalid="ignore"):
            if comparison.kind == "ratio":
                value = (compared / other)[:, 0]
            else:
                difference = compared - other
                value = np.hypot(*difference.T) if comparison.kind == "distance" else difference[:, 0]
        if comparison.relative_to_length:
            value = value / cases["case_id"].map(lengths).to_numpy(float)
        cases[comparison.name] = value
    return cases


def fitted_lines(cases: pd.DataFrame, study: Study) -> list[dict[str, Any]]:
    """The straight lines that the study asks for: columns, number of points, slope, intercept and largest deviation."""
    return [_fit(select(cases, fit.where), fit) for fit in study.fit]


def _fit(cases: pd.DataFrame, fit: LineFit) -> dict[str, Any]:
    """A straight line fitted to the cases by least squares; None for its numbers where the points leave it open."""
    points = cases[[fit.x, fit.y]].to_numpy(float)
    points = points[np.isfinite(points).all(1)]
    law: dict[str, Any] = {"x": fit.x, "y": fit.y, "where": fit.where, "points": len(points)}
    at = set(points[:, 0].tolist()) | ({0.0} if fit.through_origin else set())
    if len(points) < 2 or len(at) < 2:
        return law | {"slope": None, "intercept": None, "largest_deviation": None}
    x, y = points.T
    if fit.through_origin:
        slope, intercept = float(x @ y / (x @ x)), 0.0
    else:
        slope, intercept = np.polynomial.Polynomial.fit(x, y, 1).convert().coef[::-1].tolist()
    deviation = float(np.abs(y - slope * x - intercept).max())
    return law | {"slope": slope, "intercept": intercept, "largest_deviation": deviation}
