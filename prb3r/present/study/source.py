"""The tables, descriptions and manifest that the report of a study is made from, with values in words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from prb3r.present import style
from prb3r.quantities import Quantity, titled
from prb3r.study.phrases import UNBOUNDED
from prb3r.study.spec import Study

ROUNDING = 1e-9
"""Values smaller than this share of the largest finite one in their column are shown as zero."""
MOST_VALUES = 6
"""Metrics that are shown at most of a case that a reader points at."""


@dataclass(frozen=True)
class Source:
    """A study with its table of cases, the quantities of the columns, and its manifest."""

    study: Study
    cases: pd.DataFrame
    quantities: Sequence[Quantity]
    manifest: Mapping[str, Any]

    @property
    def factors(self) -> list[str]:
        """Columns of the table of cases that hold the study's factors, in the order of its file."""
        return [factor.name for factor in self.study.factor]

    @property
    def compared(self) -> list[str]:
        """Columns of the table of cases that hold comparisons with another case, in the order of the study's file."""
        return [comparison.name for comparison in self.study.comparison]

    @property
    def measured(self) -> list[str]:
        """Columns of the table of cases that hold metrics."""
        apart = {*self.factors, *self.compared}
        return [q.name for q in self.quantities if q.name in self.cases and q.name not in apart]

    @property
    def failed(self) -> pd.DataFrame:
        """The rows of cases that failed: without a stable equilibrium, a metric or an end."""
        return self.cases[self.cases["outcome"] != "converged"]

    def quantity(self, column: str) -> Quantity:
        """Name, symbol, unit and meaning of a column of the cases: as the study describes it, else by its name."""
        return style.quantity_of(column, self.quantities)

    def shown(self, column: str) -> style.Shown:
        """How a column is shown: in the unit that a plot asks for, else in one that suits the size of its values."""
        numeric = column in self.cases and pd.api.types.is_numeric_dtype(self.cases[column])
        return style.shown(self.quantity(column), self.cases[column] if numeric else (), self.units.get(column))

    @cached_property
    def units(self) -> dict[str, str]:
        """Units that plots ask for, by column; tables of the report use the same."""
        return {column: unit for plot in self.study.plot for column, unit in plot.units()}

    def cell(self, column: str, value: Any, unit: bool = False) -> str:
        """One value as text, in the unit that its column is shown in; with `unit`, followed by that unit.

        A dash for a missing value, `without bound` for an infinite one.
        """
        if value is None or (isinstance(value, float) and np.isnan(value)):
            return "–"
        if isinstance(value, (str, bool, np.bool_)):
            return str(value)
        if np.isinf(value):
            return UNBOUNDED
        shown = self.shown(column)
        value = 0.0 if abs(value) < ROUNDING * self._largest(column) else value * shown.factor
        return style.with_unit(value, shown.unit) if unit else style.digits(value)

    def _largest(self, column: str) -> float:
        """Largest finite magnitude in a column of the cases; 0 without any."""
        values = self.cases[column].to_numpy(float) if column in self.cases else np.zeros(0)
        return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))

    def told(self, row: Mapping[str, Any]) -> str:
        """A case in two lines: its factors, then the reason if it failed, and its first metrics."""
        varied = ", ".join(self.named(name, row[name]) for name in self.factors)
        names = [name for name in (*self.measured, *self.compared) if name in row and pd.notna(row[name])]
        values = [
            f"{self.quantity(name).title} {self.cell(name, row[name], unit=True)}" for name in names[:MOST_VALUES]
        ]
        missing = [] if row["outcome"] == "converged" else [f"{row['outcome']}: {row['reason'] or 'no reason told'}"]
        lines = [f"Case {row['case_id']}{': ' if varied else ''}{varied}.", "; ".join(missing + values)]
        return "\n".join(f"{line}" for line in lines if line)

    def named(self, column: str, value: Any) -> str:
        """A factor and its value: `Order: cable 3 first`, numbers as `titled` says them."""
        title, text = self.quantity(column).title, self.cell(column, value, unit=True)
        return f"{title}: {text}" if isinstance(value, str) else titled(title, text)
