"""Files written whole or not at all, and folders that are writable and have one writer."""

import contextlib
import errno
import json
import os
import secrets
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from prb3r.errors import EngineError, Problem, SpecError

NO_LINK = getattr(os, "O_NOFOLLOW", 0)
"""Flag of `os.open` that refuses symbolic links; 0 where the system has none."""
LOCK = ".lock"
"""Name of the lock file in a folder: the number of the writing process while one writes, empty afterwards."""


def write_whole(path: Path, content: bytes) -> Path:
    """Write a file so that readers see the old content or the new one, never a part; returns `path`.

    Raises
    ------
    EngineError
        If the disk is full or the folder does not take it.
    """
    with replaced(path) as temporary, open(temporary, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    return path


def write_json(path: Path, content: Any) -> Path:
    """Write plain data as JSON by :func:`write_whole`, one value a line, text not escaped to ASCII; returns `path`.

    Raises
    ------
    ValueError
        If a number is nan or infinite, which JSON does not have.
    """
    return write_whole(path, (json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode())


@contextlib.contextmanager
def replaced(path: Path, lasting: bool = True, make_folder: bool = True) -> Iterator[Path]:
    """A temporary file beside `path` that is renamed to `path` when the context is left without an error.

    Parameters
    ----------
    lasting : sync the folder, so that the renaming outlasts a power cut.
    make_folder : make the folder if it is missing; else a missing folder is an error.

    Raises
    ------
    EngineError
        If the disk is full or the folder does not take it.
    """
    temporary = path.with_name(f"{path.name}.{secrets.token_hex(6)}.tmp")
    try:
        if make_folder:
            path.parent.mkdir(parents=True, exist_ok=True)
        os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        yield temporary
        os.replace(temporary, path)
        if lasting:
            _sync_folder(path.parent)
    except OSError as error:
        raise EngineError(Problem(str(path), f"cannot be written: {_words(error)}")) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


@contextlib.contextmanager
def sole_writer(folder: Path) -> Iterator[None]:
    """Lock `folder` for this process until the context is left or the process ends, however it ends.

    Where the system has no such locks, nothing is locked.

    Raises
    ------
    EngineError
        If another process holds the lock, or the lock file cannot be made.
    """
    try:
        import fcntl
    except ImportError:  # no such locks on this system
        yield
        return
    with _lock_file(folder / LOCK) as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            number = os.read(lock, 20).decode("ascii", "replace").strip()
            whose = f" (process {number})" if number.isdigit() else ""
            what = f"another run{whose} is writing there; wait for its end or stop it"
            raise EngineError(Problem(str(folder), what)) from None
        os.truncate(lock, 0)
        os.write(lock, f"{os.getpid()}\n".encode())
        yield
        os.truncate(lock, 0)


@contextlib.contextmanager
def _lock_file(path: Path) -> Iterator[int]:
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | NO_LINK, 0o666)
    except OSError as error:
        raise EngineError(Problem(str(path), f"cannot be written: {_words(error)}")) from None
    try:
        yield handle
    finally:
        os.close(handle)


def make_folder(folder: Path) -> None:
    """Make a folder and its parents.

    Raises
    ------
    EngineError
        If the folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EngineError(Problem(str(folder), f"cannot be made: {_words(error)}")) from None


def clear_left_over(folder: Path) -> None:
    """Remove the temporary files that killed writers have left in a folder which only this process writes into."""
    for path in folder.glob("*.tmp"):
        with contextlib.suppress(OSError):
            path.unlink()


def _sync_folder(folder: Path) -> None:
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _words(error: OSError) -> str:
    """An error of the file system as the end of a sentence."""
    if error.errno == errno.ENOSPC:
        return "the disk is full; what is already written is kept, free some space and run again"
    if error.errno == errno.ENOENT:
        return "its folder is not there any more"
    return os.strerror(error.errno).lower() if error.errno else str(error)


def ensure_writable(folder: Path) -> None:
    """Make `folder` and check that files can be made in it, before any work is done.

    Raises
    ------
    SpecError
        If the folder or a file in it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (FileExistsError, NotADirectoryError):
        taken = next(path for path in (folder, *folder.parents) if path.exists())
        raise SpecError(Problem(str(folder), f"results cannot go there: {taken} is a file")) from None
    except OSError as error:
        raise SpecError(Problem(str(folder), f"results cannot go there: {_words(error)}")) from None
