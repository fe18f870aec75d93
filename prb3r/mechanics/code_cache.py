"""The folder on disk for the machine code of kernels, which never is stale and belongs to the user alone.

Numba keys a cached function by its own file alone, so after an edit of `balance.py` the cached entrances that call it
would be used unchanged.  The folder is therefore named after a hash of the text of the whole package `mechanics`,
sub-packages included.  Cached code is run unchecked: a folder that others own or can write to is not used.
"""

import contextlib
import hashlib
import os
import stat
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

try:
    import fcntl
except ImportError:  # not on Windows, where workers compile side by side
    fcntl = None  # type: ignore[assignment]

ROOM = Path(__file__).parent


def text_key(room: Path = ROOM) -> str:
    """Hash of the paths and the text of all Python files in a folder and its sub-folders, 12 hexadecimal digits."""
    text = hashlib.sha256()
    for source in sorted(room.rglob("*.py")):
        text.update(source.relative_to(room).as_posix().encode() + b"\0" + source.read_bytes() + b"\0")
    return text.hexdigest()[:12]


def cache_folder(room: Path = ROOM) -> Path:
    """Folder for the machine code of the files in `room`: in the user's cache folder, else in that for temporary files.

    If neither can be used (see `is_own`), it is a new temporary folder, which later processes do not find.
    """
    name, user = f"kernels-{text_key(room)}", os.getuid() if hasattr(os, "getuid") else "user"
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "prb3r"
    for place in (home, Path(tempfile.gettempdir()) / f"prb3r-{user}"):
        try:
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
            (place / name).mkdir(mode=0o700, exist_ok=True)
        except OSError:
            continue
        if is_own(place) and is_own(place / name) and os.access(place / name, os.W_OK):
            return place / name
    return Path(tempfile.mkdtemp(prefix="prb3r-"))


def is_own(folder: Path) -> bool:
    """Whether a folder belongs to this user, is no link, and nobody else can write to it."""
    status = folder.lstat()
    if not hasattr(os, "geteuid"):
        return True  # such systems keep the folders of users apart
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid() and not status.st_mode & 0o022


def is_prepared() -> bool:
    """Whether machine code of the package's present text is on disk; otherwise the first solve has to compile it."""
    return any(Path(own_folder()).rglob("*.nbc"))


@cache
def own_folder() -> str:
    """The cache folder of this package, made once in a process."""
    return str(cache_folder())


@contextlib.contextmanager
def once_at_a_time(place: Path) -> Iterator[None]:
    """Let the first of several processes with the lock file `place` run the context while the others wait; these run it
    afterwards, all at the same time.

    They then find what the first has compiled in the cache, so that nothing is compiled twice.
    """
    with contextlib.ExitStack() as stack:
        if fcntl is not None:
            with contextlib.suppress(OSError):  # no folder, or no locks in it
                file = stack.enter_context(place.open("wb"))
                try:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    fcntl.flock(file, fcntl.LOCK_EX)
                    fcntl.flock(file, fcntl.LOCK_UN)
        yield


@contextlib.contextmanager
def one_after_another(place: Path) -> Iterator[None]:
    """Let processes with the lock file `place` run the context one after another."""
    with contextlib.ExitStack() as stack:
        if fcntl is not None:
            with contextlib.suppress(OSError):  # no folder, or no locks in it
                file = stack.enter_context(place.open("wb"))
                fcntl.flock(file, fcntl.LOCK_EX)
        yield
