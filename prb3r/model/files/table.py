"""Reading and writing tables on disk, as CSV or Parquet by the suffix of the file."""

import os
import re
import warnings
from pathlib import Path
from typing import Any

import pandas as pd

from prb3r.errors import Problem, SpecError
from prb3r.model.files.place import refusal_of_place

TABLE_SUFFIXES = (".csv", ".parquet")
EMPTY = ("", "NA", "N/A", "n/a", "#N/A", "<NA>", "NaN", "nan", "null", "NULL", "None")
"""Texts that count as an empty cell of a CSV, except in the column `sequence`."""

FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of text that spreadsheets take for a formula."""
MARKED = re.compile(r"'+[=+\-@\t\r]")
"""Text that has been marked with an apostrophe so that no spreadsheet takes it for a formula; it may have begun with
apostrophes itself."""
LONGEST_HEADER = 60
"""Characters of a file's first line that a message repeats."""


def _table_path(path: str | Path) -> Path:
    """The path of a table; raises SpecError for a suffix that is not one of `TABLE_SUFFIXES`."""
    path = Path(path)
    if path.suffix not in TABLE_SUFFIXES:
        what = f"a table is a .csv or a .parquet file, not {path.suffix or 'without suffix'}"
        raise SpecError(Problem(str(path), what))
    return path


def read_table(path: str | Path) -> pd.DataFrame:
    """The table in a CSV or Parquet file.

    In a CSV the column `sequence` is read as text; the type of every other column follows from its cells.

    Raises
    ------
    SpecError
        For a file that is missing, cannot be read, or is no table.
    """
    path = _table_path(path)
    try:
        if (what := refusal_of_place(path)) is not None:
            raise SpecError(Problem(str(path), what))
        return _read(path)
    except FileNotFoundError:
        raise SpecError(Problem(str(path), "no such file")) from None
    except IsADirectoryError:
        raise SpecError(Problem(str(path), "is a folder, not a table")) from None
    except pd.errors.EmptyDataError:
        raise SpecError(Problem(str(path), "is empty")) from None
    except (pd.errors.ParserWarning, pd.errors.ParserError) as error:
        raise SpecError(Problem(str(path), _ragged(path, error))) from None
    except UnicodeDecodeError:
        raise SpecError(Problem(str(path), _foreign_text(path.read_bytes()))) from None
    except (ValueError, OSError, OverflowError) as error:  # pandas and pyarrow raise both for damaged files
        raise SpecError(Problem(str(path), f"is not a readable table: {str(error).partition(chr(10))[0]}")) from None
    except (TypeError, LookupError, AttributeError):
        raise SpecError(Problem(str(path), "is not a readable table: what pandas wrote about it is damaged")) from None


def _read(path: Path) -> pd.DataFrame:
    if path.suffix == ".parquet":
        frame = pd.read_parquet(path)
        return frame.reset_index(drop=frame.index.names == [None])
    header = list(pd.read_csv(path, nrows=0, skipinitialspace=True).columns)
    for mark, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and mark in header[0]:
            raise ValueError(f"columns are separated by {name}; write commas, and points in numbers")
    with warnings.catch_warnings():
        warnings.simplefilter("error", pd.errors.ParserWarning)  # pandas would cut rows that are too long
        frame = pd.read_csv(
            path,
            dtype={"sequence": str},
            skipinitialspace=True,
            index_col=False,
            keep_default_na=False,
            na_values={name: EMPTY for name in header if name != "sequence"},
        )
    for name in frame.select_dtypes(["object", "string"]):
        marked = frame[name].map(lambda cell: isinstance(cell, str) and MARKED.match(cell) is not None)
        if marked.any():
            frame.loc[marked, name] = frame.loc[marked, name].str[1:]
    nameless = [name for name in frame if re.fullmatch(r"Unnamed: \d+", str(name))]
    nothing = [name for name in nameless if frame[name].isna().all()]  # commas at the end of every line
    if filled := [name for name in nameless if name not in nothing]:
        place = list(frame.columns).index(filled[0]) + 1
        holds = frame[filled[0]].dropna().iloc[0]
        what = f"column {place} has no name in the header, but cells that hold something ({holds!s}); name or delete it"
        raise SpecError(Problem(str(path), what))
    return frame.drop(columns=nothing)


def _ragged(path: Path, error: Exception) -> str:
    """The message on a CSV that pandas cannot take apart, mostly as rows are longer than its header."""
    if isinstance(error, pd.errors.ParserError) and not re.search(r"Expected \d+ fields", str(error)):
        return f"is not a readable table: {str(error).partition(chr(10))[0]}"
    with path.open(encoding="utf-8-sig", errors="replace") as lines:
        header = next((line.strip() for line in lines if line.strip()), "")
    begins = header if len(header) <= LONGEST_HEADER else f"{header[:LONGEST_HEADER]}..."
    return (
        f"rows have more cells than the header has names; the first line, {begins!r}, has to hold the names of the "
        "columns, commas stand between cells, and points in numbers"
    )


def _foreign_text(data: bytes) -> str:
    """The message on a CSV in another encoding than UTF-8."""
    found = "it is UTF-16, which spreadsheets call Unicode text"
    if not data.startswith((b"\xff\xfe", b"\xfe\xff")):
        lines = data.split(b"\n")
        found = f"line {next(n for n, line in enumerate(lines, 1) if not _is_utf8(line))} is of another encoding"
    return f"is not UTF-8 text: {found}; save it as CSV UTF-8"


def _is_utf8(data: bytes) -> bool:
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def csv_text(frame: pd.DataFrame, header: bool = True) -> str:
    """A table as CSV text in which no spreadsheet finds a formula: text that would be one gets an apostrophe in front.

    `read_table` removes the apostrophe again; numbers get none.

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


def ensure_table_place(path: str | Path) -> Path:
    """The path, after a check that a table can be written there.

    Raises
    ------
    SpecError
        For a suffix that is not one of `TABLE_SUFFIXES`, or a place that cannot be written.
    """
    path = _table_path(path)
    wrong = {
        f"there is no folder {path.parent}": not path.parent.is_dir(),
        "is a folder": path.is_dir(),
        "permission denied": path.parent.is_dir() and not os.access(path.parent, os.W_OK),
    }
    for what in (what for what, holds in wrong.items() if holds):
        raise SpecError(Problem(str(path), f"cannot be written: {what}"))
    return path


def write_table(frame: pd.DataFrame, path: str | Path) -> None:
    """Write a table as CSV or Parquet, by the suffix of `path`.

    Raises
    ------
    SpecError
        For a suffix that is not one of `TABLE_SUFFIXES`, or a place that cannot be written.
    """
    path = _table_path(path)
    try:
        if path.suffix == ".parquet":
            frame.to_parquet(path, index=False)
        else:
            path.write_text(csv_text(frame), encoding="utf-8")
    except OSError as error:
        raise SpecError(Problem(str(path), f"cannot be written: {(error.strerror or str(error)).lower()}")) from None
