"""The tables of a study, made from parts: all cases in order, whichever run or study computed them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from prb3r.mechanics.equilibrium import Outcome
from prb3r.runs import store
from prb3r.runs.parts import Kept, StateRows
from prb3r.runs.store import arrow_table, whole_table
from prb3r.study.cases import Cases, Family
from prb3r.study.chunk import CASE_FAILED, blank_columns, reason_column, state_columns
from prb3r.study.compare import with_comparisons
from prb3r.study.plan import Plan


def cases_frame(plan: Plan, places: Sequence[Kept]) -> pd.DataFrame:
    """The table of cases in their order, still without comparisons; `places` as `Plan.places` gives them.

    Its columns are number, factors, broken cables, outcome, reason, numbers of the solution, and metrics.  A converged
    case with a failed metric gets the outcome `failed`.
    """
    blank = blank_columns(np.zeros(0, np.int64), (), "", "")
    columns = {name: places[0].column(name) for name in blank if name != "case_id"}
    for metric, place in zip(plan.study.metric, places[1:], strict=False):
        columns |= {quantity.name: place.column(quantity.name) for quantity in metric.quantities()}
        reason = place.column(reason_column(metric))
        columns["outcome"][(reason != "") & (columns["outcome"] == Outcome.CONVERGED.label)] = CASE_FAILED
        columns["reason"] = np.where((reason != "") & (columns["reason"] == ""), reason, columns["reason"])
    return labelled(plan.cases, {"case_id": np.arange(len(plan.cases)), **columns})


def tabulated(plan: Plan, places: Sequence[Kept]) -> pd.DataFrame:
    """The table of cases with comparisons, all of which are stored at `places`, as `Plan.places` gives them."""
    relative = any(comparison.relative_to_length for comparison in plan.study.comparison)
    lengths = straight_lengths(plan.cases.families) if relative else {}
    return with_comparisons(cases_frame(plan, places), plan.study, lengths)


def straight_lengths(families: Sequence[Family]) -> dict[int, float]:
    """Straight length of the manipulator of each case, m, by number of the case."""
    lengths: dict[int, float] = {}
    for family in families:
        lengths |= dict.fromkeys(family.numbers.tolist(), family.manipulator().chain().length)
    return lengths


def labelled(cases: Cases, computed: Mapping[str, np.ndarray]) -> pd.DataFrame:
    """Computed columns, which include `case_id`, as a table with columns of factors and broken cables before them."""
    broken = np.empty(len(cases), object)
    for family in cases.families:
        broken[family.numbers] = ",".join(family.settings["broken"])
    rows = computed["case_id"]
    labels = {
        name: values[rows] if values.dtype == float else pd.Series(values[rows].tolist())
        for name, values in cases.factors.items()
    }
    measured = {name: values for name, values in computed.items() if name != "case_id"}
    return pd.DataFrame({"case_id": rows, **labels, "broken_cables": broken[rows], **measured})


def write_states(plan: Plan, place: Kept, path: Path, provenance: Mapping[str, Any]) -> None:
    """Write the table of states, which are all stored at `place`, to `path`; raises what `replaced` raises.

    Row groups are cut at fixed rows, so that the bytes of the file depend on the rows alone.
    """
    stored = StateRows(place)
    empty = arrow_table(state_columns(plan.cables), plan.quantities, provenance)
    with whole_table(path, empty.schema) as writer:
        if not stored.total:
            writer.write_table(empty)
        for start in range(0, stored.total, store.ROW_GROUP):
            case, known = stored.between(start, min(start + store.ROW_GROUP, stored.total))
            columns = {name: case if name == "case_id" else known[name] for name in empty.column_names}
            group = arrow_table(columns, plan.quantities, provenance)
            writer.write_table(group.cast(empty.schema), row_group_size=store.ROW_GROUP)
