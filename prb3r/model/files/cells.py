"""Cells of tables: reading numbers and names of sequences, and messages on cells that are wrong.

The index of a table has to count its rows from 0; messages count them from 1.
"""

import re
from collections.abc import Collection, Iterable, Sequence
from decimal import Decimal
from numbers import Real
from typing import Any

import numpy as np
import pandas as pd

from prb3r.errors import Problem

LARGEST = 1e100
"""Largest magnitude of a number in a table: beyond it products overflow, and nothing mechanical is so large."""


def _plain(values: pd.Series) -> bool:
    """Whether the type of a column is one of NumPy's number types."""
    return values.dtype.kind in "fiu"


def numbers(values: pd.Series) -> pd.Series:
    """The cells of a column as floats; NaN for cells that are empty or hold no number."""
    if values.dtype == float:
        return values
    if not _plain(values):
        text = values.map(lambda cell: isinstance(cell, str | Real | Decimal) and not isinstance(cell, bool))
        values = pd.to_numeric(values.astype(object).where(text.astype(bool)).map(_bounded), errors="coerce")
    return values.astype(float)


def _bounded(cell: object) -> object:
    """The cell unchanged, but infinity for a whole number beyond `LARGEST`, which no float may be able to hold."""
    if isinstance(cell, int) and abs(cell) > LARGEST:
        return np.inf if cell > 0 else -np.inf
    return cell


def is_empty(values: pd.Series) -> pd.Series:
    """Whether each cell of a column is empty."""
    if _plain(values):
        return values.isna()
    if values.dtype == "str":
        return values.isna() | (values.str.strip() == "")
    return values.isna() | values.map(lambda cell: isinstance(cell, str) and not cell.strip()).astype(bool)


def blank_rows(frame: pd.DataFrame) -> pd.Series:
    """Whether each row of a table holds nothing at all."""
    blank = pd.Series(True, frame.index)
    for k in range(frame.shape[1]):
        blank &= is_empty(frame.iloc[:, k])
    return blank


def number_problems(values: pd.Series, place: str) -> list[Problem]:
    """Problems with the cells of a column that are neither empty nor finite numbers up to `LARGEST`."""
    read, problems = numbers(values), []
    strange = read.isna() & ~is_empty(values)
    if strange.any():
        first = values[strange].iloc[0]
        what = f"row {strange.idxmax() + 1} holds {_shown(first)}, not a number{_remedy(first)}{others(strange)}"
        problems.append(Problem(place, what))
    for wrong, what in ((read.abs() == np.inf, "infinite"), (too_large(read) & (read.abs() < np.inf), "too large")):
        if wrong.any():
            problems.append(Problem(place, f"row {wrong.idxmax() + 1} is {what}{others(wrong)}"))
    return problems


def _remedy(cell: object) -> str:
    """How a text that people read as a number is written, as the ending of a message; empty for all else."""
    if not isinstance(cell, str):
        return ""
    for sought, instead, remedy in (
        (r"[,.'\s]", "", "write a decimal point, and nothing between thousands"),
        ("[\u2212\u2013]", "-", "write a hyphen for minus"),
        (r"[^\d.,eE+-]+$", "", "write the number alone, in the unit that the name of the column ends with"),
    ):
        bare = re.sub(sought, instead, cell)
        if bare != cell and pd.notna(pd.to_numeric(bare, errors="coerce")):
            return f"; {remedy}"
    return ""


def too_large(values: Any) -> Any:
    """Whether the magnitudes of numbers exceed `LARGEST`."""
    return abs(values) > LARGEST


def key_problems(frame: pd.DataFrame, where: str, keys: Sequence[str]) -> list[Problem]:
    """Problems with the key columns of a table, which tell rows apart: `sequence`, and others that hold numbers."""
    problems = []
    for key in keys:
        if key not in frame:
            problems.append(Problem(where, f"column {key!r} is missing"))
            continue
        place, empty = f"{where} column {key}", is_empty(frame[key])
        if key != "sequence":
            problems += number_problems(frame[key], place)
        if empty.any():
            problems.append(Problem(place, f"{rows_of(empty)}: empty; every row needs its {key}"))
    return problems


def with_keys(frame: pd.DataFrame) -> pd.DataFrame:
    """A table whose keys have been checked, with sequences as text and steps as numbers, as integers if all are whole.

    Sequences that are numbers in Parquet get the names that they would have in CSV.
    """
    names, step = frame["sequence"], numbers(frame["step"])
    if pd.api.types.is_float_dtype(names) and (names % 1 == 0).all():
        names = names.astype(int)
    whole = bool((step % 1 == 0).all() and (step.abs() < 2**53).all())
    number, distinct = pd.factorize(names)  # few names stand in many rows
    texts = np.array([str(name) for name in distinct], object)[number]
    return frame.assign(sequence=pd.Series(texts, frame.index, object), step=step.astype(int) if whole else step)


# Words ----------------------------------------------------------------------------------------------------------------


def rows_of(which: pd.Series) -> str:
    """The rows, counted from 1, at which a mask is true, in words: `row 3` or `rows 3-5, 9`."""
    rows = which.index[which] + 1
    return f"row{'s' * (len(rows) > 1)} {ranges(rows)}"


def ranges(values: Iterable[int], most: int = 6) -> str:
    """Whole numbers in words, as in `1-3, 7`; after `most` stretches only the number of the others is given."""
    ordered = np.unique(np.asarray(list(values), int))
    stretches = [s for s in np.split(ordered, np.flatnonzero(np.diff(ordered) > 1) + 1) if len(s)]
    texts = [f"{s[0]}" if len(s) == 1 else f"{s[0]}-{s[-1]}" for s in stretches[:most]]
    left = sum(len(s) for s in stretches[most:])
    return ", ".join(texts) + (f" and {left} more" if left else "")


def count(number: int, what: str, form: str = "") -> str:
    """A number, in a format, with its noun, in the plural where it needs one: `1 row`, `3 rows`."""
    return f"{number:{form}} {what}{'s' * (number != 1)}"


def written_out(value: float, form: str) -> str:
    """A number in the format `form`, but without an exponent below a million."""
    text = f"{value:{form}}"
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e6 else text


def named(what: str, names: Collection[str]) -> str:
    """Names after their noun, in the plural where it needs one: `cable 3`, `cables 3, 4`."""
    return f"{what}{'s' * (len(names) > 1)} {', '.join(names)}"


def _shown(cell: object) -> str:
    """A cell as it is shown in a message, cut to 60 characters."""
    text = repr(cell) if isinstance(cell, str) else str(cell)
    return text if len(text) <= 60 else f"{text[:57]}..."


def others(which: pd.Series) -> str:
    """Ending of a message about one row of a mask: how many more rows are like it, empty for none."""
    more = int(which.sum()) - 1
    return f" (and {count(more, 'more row')} like it)" if more else ""
