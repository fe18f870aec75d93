"""Whether there can be a file at a path, before it is read: a device or a pipe would never end."""

import stat
from pathlib import Path


def refusal_of_place(path: Path, largest: int | None = None) -> str | None:
    """Why what is at `path` is not read, if so: it is no regular file, or has more than `largest` bytes.

    Raises
    ------
    OSError
        If there is nothing that could be looked at.
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
