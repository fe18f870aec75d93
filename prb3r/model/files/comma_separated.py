"""Tables as CSV text: reading what spreadsheets and people write, and writing what no spreadsheet runs."""

import csv
import io
import re
import warnings
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError

EMPTY = ("", "NA", "N/A", "n/a", "#N/A", "<NA>", "NaN", "nan", "null", "NULL", "None")
"""Texts that count as an empty cell, except in the column `sequence`."""
SEPARATORS = ((";", "semicolons"), ("\t", "tabs"), ("|", "vertical bars"))
"""What other programs put between cells instead of commas."""
FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of text that spreadsheets take for a formula."""
MARKED = re.compile(r"'+[=+\-@\t\r]")
"""Text that has been marked with an apostrophe so that no spreadsheet takes it for a formula; it may have begun with
apostrophes itself."""
PANDAS = tuple(map(int, pd.__version__.split(".")[:2]))
"""Version of pandas that is installed."""
TO_THE_LAST_DIGIT: dict[str, Any] = {"float_precision": "round_trip"} if PANDAS < (3, 1) else {}
"""What pandas before 3.1 needs to read a number as it was written, to the last digit; later ones do, and warn of it."""
LONGEST_HEADER = 60
"""Characters of a file's first line that a message repeats."""


# Reading --------------------------------------------------------------------------------------------------------------


def csv_frame(text: str, where: str) -> pd.DataFrame:
    """The table in the text of a CSV; space around names and cells is no part of them.

    The column `sequence` is read as text; the type of every other column follows from its cells.  The index counts the
    rows below the header from 0; blank lines are rows without any cell.  Cells beyond the last name, and columns
    without a name, are left out where they hold nothing.  `where` names the table in messages.

    Raises
    ------
    SpecError
        If the text is no table.
    """
    text = text.strip("\ufeff \t\r\n")
    if not text:
        raise SpecError(Problem(where, "is empty"))
    try:
        names = [name.strip("\ufeff \t\xa0") for name in next(_rows(text))]
        _ensure_commas(names)
        try:
            frame = _parsed(text, names)
        except (pd.errors.ParserWarning, pd.errors.ParserError) as error:
            frame = _parsed(text, _with_nameless_columns(text, names, error))
        return _named(frame)
    except csv.Error as error:
        raise SpecError(Problem(where, f"is not a readable table: {error}")) from None
    except ValueError as error:
        raise SpecError(Problem(where, str(error).partition("\n")[0])) from None


def _rows(text: str) -> Iterator[list[str]]:
    """The cells of each row of a CSV, from its header on."""
    return csv.reader(io.StringIO(text, newline=""), skipinitialspace=True)


def _ensure_commas(names: Sequence[str]) -> None:
    """Raise ValueError if a header that was cut at commas is better cut elsewhere."""
    for mark, name in SEPARATORS:
        if ",".join(names).count(mark) >= len(names):
            raise ValueError(_foreign_separator(name))


def _foreign_separator(name: str) -> str:
    return f"columns are separated by {name}; write commas between cells, and points in numbers"


def _parsed(text: str, names: Sequence[str]) -> pd.DataFrame:
    """The table below the header of a CSV, with columns 0, 1, ... of these names, whose texts are what was meant."""
    texts = {k for k, name in enumerate(names) if name == "sequence"}
    with warnings.catch_warnings():
        warnings.simplefilter("error", pd.errors.ParserWarning)  # pandas would cut rows that are too long
        frame = pd.read_csv(
            io.BytesIO(text.encode()),
            header=None,
            names=range(len(names)),
            skiprows=1,
            dtype=dict.fromkeys(texts, str),
            skipinitialspace=True,
            skip_blank_lines=False,
            index_col=False,
            keep_default_na=False,
            na_values={k: EMPTY for k in range(len(names)) if k not in texts},
            low_memory=False,
            **TO_THE_LAST_DIGIT,
        )
    for k in frame.select_dtypes(["object", "string"]):
        number, distinct = pd.factorize(frame[k])  # -1 for an empty cell; few names stand in many rows
        meant = [cell if k in texts or cell not in EMPTY else np.nan for cell in map(_meant, distinct)]
        frame[k] = np.array([*meant, np.nan], object)[number]
    return frame.set_axis(list(names), axis=1)


def _meant(cell: Any) -> Any:
    """A cell; text without space around it, and without the apostrophe that `csv_text` puts before formulas."""
    if not isinstance(cell, str):
        return cell
    cell = cell.strip()
    return cell[1:] if cell.startswith("'") and MARKED.match(cell) else cell


def _with_nameless_columns(text: str, names: Sequence[str], error: Exception) -> list[str]:
    """The names, and an empty one for every cell of the longest row beyond them.

    Raises
    ------
    ValueError
        If such a cell holds something, or if the `error` of pandas has another reason.
    """
    rows = list(_rows(text))
    for number, row in enumerate(rows):
        if any(cell.strip() for cell in row[len(names) :]):
            begins = ",".join(rows[0])
            begins = begins if len(begins) <= LONGEST_HEADER else f"{begins[:LONGEST_HEADER]}..."
            raise ValueError(
                f"rows have more cells than the header has names, first row {number}: {len(row)} instead of "
                f"{len(names)}; the first line, {begins!r}, has to hold the names of the columns, commas stand between "
                "cells, and points in numbers"
            )
    if unclosed := re.search(r"EOF inside string starting at row (\d+)", str(error)):
        place = f"row {unclosed[1]}" if int(unclosed[1]) else "the header"
        raise ValueError(f"a quotation mark opens in {place} and is never closed")
    if (width := max(map(len, rows))) == len(names):
        raise ValueError(f"is not a readable table: {error}")
    return [*names, *[""] * (width - len(names))]


def _named(frame: pd.DataFrame) -> pd.DataFrame:
    """The table without columns that have no name and hold nothing.

    Raises ValueError if a column without a name holds something, if a name stands there twice, or if the only name is
    several.
    """
    nameless = [k for k, name in enumerate(frame.columns) if not name]
    for k in nameless:
        if (full := frame.iloc[:, k].dropna()).size:
            what = f"has no name in the header, but cells that hold something ({full.iloc[0]!s}); name or delete it"
            raise ValueError(f"column {k + 1} {what}")
    frame = frame.iloc[:, [k for k in range(frame.shape[1]) if k not in nameless]]
    if twice := frame.columns[frame.columns.duplicated()].tolist():
        raise ValueError(f"column {twice[0]!r} stands there twice")
    if frame.shape[1] == 1 and " " in frame.columns[0]:
        raise ValueError(_foreign_separator("spaces"))
    return frame


# Writing --------------------------------------------------------------------------------------------------------------


def csv_text(frame: pd.DataFrame, header: bool = True) -> str:
    """A table as CSV text in which no spreadsheet finds a formula: text that would be one gets an apostrophe in front.

    `csv_frame` removes the apostrophe again; numbers get none.

    Parameters
    ----------
    header : whether to begin with the names of the columns.
    """
    texts = {name: frame[name].astype(object).map(_marked) for name in frame.select_dtypes(["object", "string"])}
    return frame.assign(**texts).to_csv(index=False, header=header)


def _marked(cell: Any) -> Any:
    """A cell, with an apostrophe in front if it is text that a spreadsheet could take for a formula."""
    begins = isinstance(cell, str) and cell.lstrip("'").startswith(FORMULA)
    return f"'{cell}" if begins and not _is_number(cell) else cell


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
