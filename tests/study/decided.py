"""Designs in tables of a few numbers, to be decided between."""

import numpy as np
import pandas as pd

from prb3r.study.designs import DesignCases
from prb3r.study.wishes import Preference, Wishes


def cases(columns, requirement=(), preference=(), circumstances=()):
    """A case for each row; designs by the column `design`."""
    frame = pd.DataFrame(columns)
    frame["outcome"] = frame.get("outcome", "converged")
    if "scenario" not in frame:
        frame["scenario"] = frame.groupby("design").cumcount()
    return DesignCases(frame, list(circumstances), Wishes(requirement=list(requirement), preference=list(preference)))


def greater(metric, **more):
    return Preference(metric=metric, better="greater", **more)


def less(metric, **more):
    return Preference(metric=metric, better="less", **more)


def random_cases(seed, requirement=(), weights=(1.0, 1.0, 1.0)):
    rng = np.random.default_rng(seed)
    table = {"design": [f"d{k}" for k in range(12)], **{name: rng.normal(size=12) for name in "abc"}}
    wishes = [greater("a", weight=weights[0]), less("b", weight=weights[1]), greater("c", weight=weights[2])]
    return cases(table, requirement, wishes)


TABLE = {
    "design": ["thin", "middle", "thick", "odd"],
    "area": [4.0, 3.0, 1.0, 2.0],
    "force": [90.0, 60.0, 50.0, 80.0],
}
