"""The table of steps of a recording: checked, without repeated rows, and in order."""

from pathlib import Path

import numpy as np
import pandas as pd

from prb3r.errors import Problem
from prb3r.model.files.cells import count, key_problems, named, numbers, rows_of, with_keys
from prb3r.model.manipulator import Manipulator
from prb3r.model.step_checks import cable_columns, ignored_slips, step_problems, with_whole_names
from prb3r.recording.findings import Findings


def cleaned(raw: pd.DataFrame, manipulator: Manipulator | None, where: str, findings: Findings) -> pd.DataFrame | None:
    """The table of steps with each step once, the steps of a sequence together and in order; None if keys of rows are
    wrong.

    Problems and remarks are added to `findings`; if there are problems, the loads of the table must not be used.
    """
    raw = raw if manipulator is None else with_whole_names(manipulator, raw)
    name, repeated = Path(where).name, raw.duplicated()
    frame = raw[~repeated]
    problems = step_problems(manipulator, frame, where)
    if frame.empty:
        problems.append(Problem(where, "holds no steps"))
    findings.problems += problems
    if key_problems(frame, where, ("sequence", "step")):
        return None
    if repeated.any():
        findings.remarks.append(
            f"{rows_of(repeated)} of {name}: the same step with the same loads as a row before, taken once; "
            "a sequence that was pulled again needs a name of its own in both tables"
        )
    frame = _in_order(with_keys(frame), name, findings)
    if manipulator and not problems:
        if ignored := ignored_slips(manipulator, frame.columns, name):
            findings.remarks.append(ignored)
        frame = _without_negative_tensions(manipulator, frame, name, findings)
    return frame.reset_index(drop=True)


def _in_order(frame: pd.DataFrame, name: str, findings: Findings) -> pd.DataFrame:
    """The table with each sequence's rows together and sorted by step; remarks say which were not."""
    place, names = pd.factorize(frame["sequence"])
    order = np.lexsort((frame["step"], place))
    if (np.diff(place) < 0).any():
        apart = names[np.unique(place[1:][np.diff(place) < 0])]
        which = named("sequence", apart)
        findings.remarks.append(f"{name}: the rows of {which} did not stand together; each is one sequence")
    together = frame.iloc[np.argsort(place, kind="stable")]
    backward = together["sequence"].eq(together["sequence"].shift()) & together["step"].diff().lt(0)
    if backward.any():
        late = together.loc[backward, "sequence"].unique()
        which = named("sequence", late)
        findings.remarks.append(f"{name}: the steps of {which} were out of order and are sorted by number")
    return frame.iloc[order]


def _without_negative_tensions(
    manipulator: Manipulator, frame: pd.DataFrame, name: str, findings: Findings
) -> pd.DataFrame:
    """The table with tensions below zero set to zero; a remark says how many there were."""
    columns = cable_columns(manipulator, frame)
    tension = frame[columns].apply(numbers)
    if below := int((tension < 0).to_numpy().sum()):
        lowest = tension.min().idxmin()
        what = "the force sensor at rest" if below == 1 else "force sensors at rest"
        findings.remarks.append(
            f"{count(below, 'tension')} of {name} slightly below zero (lowest {lowest} = {tension[lowest].min():g}): "
            f"{what}, taken as zero"
        )
    return frame.assign(**tension.clip(lower=0.0))
