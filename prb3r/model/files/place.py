"""A check before a path is read: reading a device or a pipe would never end."""

import stat
from pathlib import Path

TABLE_SUFFIXES = (".csv", ".parquet")
"""Suffixes of tables, in small letters; files may have them in capitals."""


def refusal_of_place(path: Path, largest: int | None = None) -> str | None:
    """Why the file at `path` must not be read, as it is no regular file or too large (`largest`, in bytes); else None.

    Raises
    ------
    OSError
        If nothing is there or its status cannot be read; IsADirectoryError for a folder.
    """
    if "\0" in str(path):
        return "no path has a NUL in it"
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError
    if not stat.S_ISREG(status.st_mode):
        return "is no regular file"
    if largest is not None and status.st_size > largest:
        return f"has {status.st_size:,} bytes, more than {largest:,}"
    return None
