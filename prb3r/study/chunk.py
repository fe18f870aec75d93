"""Chunks of cases that workers compute, and the columns that come back for solved and for failed cases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from prb3r.mechanics.equilibrium import Outcome
from prb3r.runs.states import Columns
from prb3r.study.cases import Family
from prb3r.study.metrics.base import Metric

CASE_FAILED, CASE_CRASHED = "failed", "crashed"
"""Outcomes of a case that raised an error, and of one that killed its worker."""
FAILURES = (ValueError, ArithmeticError, MemoryError, IndexError, np.linalg.LinAlgError)
"""Errors that make a case or a metric fail, but not the whole run."""


@dataclass(frozen=True)
class Chunk:
    """Cases for one task of a worker, and the metrics and states to compute for them."""

    families: tuple[Family, ...]
    metrics: tuple[Metric, ...]
    states: str
    """States to keep: `none`, `final` (last step) or `path` (all steps)."""
    state_disks: tuple[int, ...] | None
    """Disks whose states are kept; None: all."""
    cables: tuple[str, ...]
    """Names of the cables in the table of states."""
    items: tuple[str, ...] = ()
    """Items to compute, as parts name them."""

    @property
    def loads(self) -> int:
        """Number of cases, or of the loads in their clouds if they have clouds."""
        return sum(family.loads for family in self.families)

    @property
    def numbers(self) -> np.ndarray:
        """(cases,) numbers of the cases in the study, ascending, across families."""
        return np.sort(np.concatenate([family.numbers for family in self.families]))

    def single(self) -> list["Chunk"]:
        """A chunk for each case, in the order of their numbers, to find the case that fails or kills its worker."""
        cases = [case for family in self.families for case in family.single()]
        return [replace(self, families=(case,)) for case in sorted(cases, key=lambda case: case.numbers[0])]


def blank_columns(numbers: np.ndarray, metrics: Sequence[Metric], outcome: str, reason: str) -> Columns:
    """Columns of cases without results: `outcome` and `reason` for all of them, NaN for numbers and metrics."""
    count = len(numbers)
    measured = [quantity.name for metric in metrics for quantity in metric.quantities()]
    reasons = {reason_column(metric): np.full(count, "", object) for metric in metrics}
    return reasons | {
        "case_id": np.asarray(numbers),
        "outcome": np.full(count, outcome, object),
        "reason": np.full(count, reason, object),
        "iterations": np.zeros(count, np.int64),
        **{name: np.full(count, np.nan) for name in ("residual_n_m", "lowest_eigenvalue_n_m_per_rad", *measured)},
    }


def reason_column(metric: Metric) -> str:
    """Name of the column with the reason why a metric failed, an empty text where it did not."""
    return f"reason of {metric.quantities()[0].name}"


def failed_cases(cases: Columns, metrics: Sequence[Metric]) -> np.ndarray:
    """(cases,) whether a case has no stable equilibrium, or one of its metrics failed."""
    failed = cases["outcome"] != Outcome.CONVERGED.label
    for metric in metrics:
        failed |= cases[reason_column(metric)] != ""
    return failed


def one_below_another(tables: Sequence[Mapping[str, np.ndarray]]) -> Columns:
    """Tables of the same columns below each other, as one table."""
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def states_of_each(numbers: np.ndarray, states: Columns) -> np.ndarray:
    """(cases,) number of rows of states of each case, by the ascending `numbers` (cases,) of cases in both tables."""
    return np.diff(np.searchsorted(states["case_id"], numbers), append=len(states["case_id"]))


def state_columns(cables: Sequence[str]) -> Columns:
    """The columns of a table of states without rows, for the cables of these names."""
    numbers = {name: np.zeros(0, np.int64) for name in ("case_id", "step", "disk")}
    return numbers | {name: np.zeros(0) for name in ("x_m", "y_m", "angle_rad", *(f"cable_{c}_n" for c in cables))}
