"""Cases for one task of a worker, and the columns that come back, whatever became of the cases."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from prb3r.runs.states import Columns
from prb3r.study.cases import Family
from prb3r.study.metrics.base import Metric

CASE_FAILED, CASE_CRASHED = "failed", "crashed"
FAILURES = (ValueError, ArithmeticError, MemoryError, IndexError, np.linalg.LinAlgError)
"""What makes a case or a metric fail, instead of the run."""


@dataclass(frozen=True)
class Chunk:
    """Cases for one task of a worker, and what to measure."""

    families: tuple[Family, ...]
    metrics: tuple[Metric, ...]
    states: str
    """`none`, `final` or `path`."""
    state_disks: tuple[int, ...] | None
    cables: tuple[str, ...]
    """Names of the cables in the table of states."""
    items: tuple[str, ...] = ()
    """What is asked for, as parts name it."""

    @property
    def loads(self) -> int:
        """Number of what is to be solved: cases, or the loads of their clouds."""
        return sum(family.loads for family in self.families)

    @property
    def numbers(self) -> np.ndarray:
        """(cases,) numbers that its cases have in the study, ascending, whatever their families."""
        return np.sort(np.concatenate([family.numbers for family in self.families]))

    def single(self) -> list["Chunk"]:
        """Chunks of a single case each, in their order, for finding the one that kills its worker."""
        cases = [case for family in self.families for case in family.single()]
        return [replace(self, families=(case,)) for case in sorted(cases, key=lambda case: case.numbers[0])]


def blank_columns(numbers: np.ndarray, metrics: Sequence[Metric], outcome: str, reason: str) -> Columns:
    """The columns of cases that could not be computed."""
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
    """The column that says why a metric could not be had; empty where it could."""
    return f"reason of {metric.quantities()[0].name}"


def one_below_another(tables: Sequence[Columns]) -> Columns:
    """Tables of the same columns as one, their rows in the order of the tables."""
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def state_columns(cables: Sequence[str]) -> Columns:
    """The columns of a table of states without rows."""
    numbers = {name: np.zeros(0, np.int64) for name in ("case_id", "step", "disk")}
    return numbers | {name: np.zeros(0) for name in ("x_m", "y_m", "angle_rad", *(f"cable_{c}_n" for c in cables))}
