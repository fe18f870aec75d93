"""Reading and writing tables on disk, as CSV or Parquet by the suffix of the file."""

import os
from pathlib import Path

import pandas as pd

from prb3r.errors import Problem, SpecError
from prb3r.model.files.comma_separated import csv_frame, csv_text
from prb3r.model.files.place import TABLE_SUFFIXES, refusal_of_place


def _table_path(path: str | Path) -> Path:
    """The path of a table; raises SpecError for a suffix that is not one of `TABLE_SUFFIXES`."""
    path = Path(path)
    if path.suffix.lower() not in TABLE_SUFFIXES:
        there = "is a folder, not a table" if path.is_dir() else f"{path.suffix or 'a file without suffix'} is no table"
        raise SpecError(Problem(str(path), f"{there}; a table is a .csv or a .parquet file"))
    return path


def is_parquet(path: Path) -> bool:
    """Whether a table of this name is a Parquet file, or else CSV."""
    return path.suffix.lower() == ".parquet"


def read_table(path: str | Path) -> pd.DataFrame:
    """The table in a CSV or Parquet file.

    Of a CSV see :func:`csv_frame`.

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
    except UnicodeDecodeError:
        raise SpecError(Problem(str(path), _foreign_text(path.read_bytes()))) from None
    except (ValueError, OSError, OverflowError) as error:  # pandas and pyarrow raise both for damaged files
        raise SpecError(Problem(str(path), f"is not a readable table: {str(error).partition(chr(10))[0]}")) from None
    except (TypeError, LookupError, AttributeError):
        raise SpecError(Problem(str(path), "is not a readable table: what pandas wrote about it is damaged")) from None


def _read(path: Path) -> pd.DataFrame:
    if not is_parquet(path):
        return csv_frame(path.read_text("utf-8"), str(path))
    frame = pd.read_parquet(path)
    return frame.reset_index(drop=frame.index.names == [None])


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
        if is_parquet(path):
            frame.to_parquet(path, index=False)
        else:
            path.write_text(csv_text(frame), encoding="utf-8")
    except OSError as error:
        raise SpecError(Problem(str(path), f"cannot be written: {(error.strerror or str(error)).lower()}")) from None
