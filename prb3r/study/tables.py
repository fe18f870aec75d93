"""The tables of a study, made from parts: all cases in order, whichever run or study computed them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from prb3r.mechanics.equilibrium import Outcome
from prb3r.runs import store
from prb3r.runs.parts import Kept, Parts, gathered, present, rows_of_states, state_counts
from prb3r.runs.states import as_slice
from prb3r.runs.store import arrow_table, whole_table
from prb3r.study.cases import Cases, Family
from prb3r.study.chunk import CASE_FAILED, blank_columns, reason_column, state_columns
from prb3r.study.compare import with_comparisons
from prb3r.study.plan import Plan


def cases_frame(plan: Plan, parts: Parts) -> pd.DataFrame:
    """The table of cases in their order, from parts that hold all of them, still without comparisons.

    Its columns are number, factors, broken cables, outcome, reason, numbers of the solution, and metrics.  A converged
    case with a failed metric gets the outcome `failed`.
    """
    known = parts.place(plan.items[0], plan.keys)
    blank = blank_columns(np.zeros(0, np.int64), (), "", "")
    columns = {name: gathered(parts, known, name) for name in blank if name != "case_id"}
    for metric, item in plan.metric_items:
        place = parts.place(item, plan.keys)
        columns |= {quantity.name: gathered(parts, place, quantity.name) for quantity in metric.quantities()}
        reason = gathered(parts, place, reason_column(metric))
        columns["outcome"][(reason != "") & (columns["outcome"] == Outcome.CONVERGED.label)] = CASE_FAILED
        columns["reason"] = np.where((reason != "") & (columns["reason"] == ""), reason, columns["reason"])
    return labelled(plan.cases, pd.DataFrame({"case_id": np.arange(len(plan.cases)), **columns}))


def tabulated(plan: Plan, parts: Parts) -> pd.DataFrame:
    """The table of cases with comparisons, from parts that hold all cases."""
    relative = any(comparison.relative_to_length for comparison in plan.study.comparison)
    lengths = straight_lengths(plan.cases.families) if relative else {}
    return with_comparisons(cases_frame(plan, parts), plan.study, lengths)


def straight_lengths(families: Sequence[Family]) -> dict[int, float]:
    """Straight length of the manipulator of each case, m, by number of the case."""
    lengths: dict[int, float] = {}
    for family in families:
        lengths |= dict.fromkeys(family.numbers.tolist(), family.manipulator().chain().length)
    return lengths


def labelled(cases: Cases, computed: pd.DataFrame) -> pd.DataFrame:
    """Computed columns, which include `case_id`, with columns of factors and broken cables put before them."""
    broken = np.empty(len(cases), object)
    for family in cases.families:
        broken[family.numbers] = ",".join(family.settings["broken"])
    rows = computed["case_id"].to_numpy()
    labels = {
        name: values[rows] if values.dtype == float else pd.Series(values[rows].tolist())
        for name, values in cases.factors.items()
    }
    measured = {name: computed[name].to_numpy() for name in computed if name != "case_id"}
    return pd.DataFrame({"case_id": rows, **labels, "broken_cables": broken[rows], **measured})


def write_states(plan: Plan, parts: Parts, path: Path, provenance: Mapping[str, Any]) -> None:
    """Write the table of states to `path`; raises what `replaced` raises.

    Row groups are cut at fixed rows, so that the bytes of the file depend on the rows alone.
    """
    place = parts.place(plan.items[-1], plan.keys)
    ends = np.cumsum(state_counts(parts, place))
    empty = arrow_table(state_columns(plan.cables), plan.quantities, provenance)
    with whole_table(path, empty.schema) as writer:
        for start in range(0, max(int(ends[-1]), 1), store.ROW_GROUP):
            stop = min(start + store.ROW_GROUP, int(ends[-1]))
            group = arrow_table(_states(plan, parts, place, ends, slice(start, stop)), plan.quantities, provenance)
            writer.write_table(group.cast(empty.schema), row_group_size=store.ROW_GROUP)


def _states(plan: Plan, parts: Parts, place: Kept, ends: np.ndarray, rows: slice) -> dict[str, np.ndarray]:
    """Columns of some rows of the table of states; `ends` (cases,) is the row after the last state of each case."""
    case, part, row = rows_of_states(parts, place, ends, rows)
    columns = state_columns(plan.cables) | {"case_id": case}
    names = [name for name in columns if name != "case_id"]
    columns |= {name: np.empty(len(case), columns[name].dtype) for name in names}
    for number in present(part):
        here = as_slice(np.flatnonzero(part == number))
        for name, values in parts.parts[number].states.picked(row[here], names).items():
            columns[name][here] = values
    return columns
