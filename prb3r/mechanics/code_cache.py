"""Machine code of kernels on disk, which cannot go stale and is nobody else's.

Numba keys a cached function by its own file alone, so an edit of `balance.py` would leave the entrances that lead to it
unchanged.  The cache folder is therefore named after the text of the whole package `mechanics`, sub-folders included.
Cached code is run as it stands: a folder that others own or can write to is not used.
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
    """Hash of the places and the text of all Python files of a folder and its sub-folders, 12 hexadecimal digits."""
    text = hashlib.sha256()
    for source in sorted(room.rglob("*.py")):
        text.update(source.relative_to(room).as_posix().encode() + b"\0" + source.read_bytes() + b"\0")
    return text.hexdigest()[:12]


def cache_folder(room: Path = ROOM) -> Path:
    """Folder for the machine code of the files in `room`: in the user's cache, else in the one for temporary files.

    Where neither is the user's own it is a new one, of which later processes do not know.
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
    """Whether a folder is this user's, and no link, and nobody else can write to it."""
    status = folder.lstat()
    if not hasattr(os, "geteuid"):
        return True  # such systems keep the folders of users apart
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid() and not status.st_mode & 0o022


def is_prepared() -> bool:
    """Whether any machine code of this text is on disk: without it the first solve waits for it."""
    return any(Path(own_folder()).rglob("*.nbc"))


@cache
def own_folder() -> str:
    """The cache folder of this package, made once in a process."""
    return str(cache_folder())


@contextlib.contextmanager
def once_at_a_time(place: Path) -> Iterator[None]:
    """Let the first process do what follows while others wait that want the same; they do it after, all at once.

    What another one has compiled they find in the cache, so that a computer's processors compile nothing twice.
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
    """Let one process after another do what follows."""
    with contextlib.ExitStack() as stack:
        if fcntl is not None:
            with contextlib.suppress(OSError):  # no folder, or no locks in it
                file = stack.enter_context(place.open("wb"))
                fcntl.flock(file, fcntl.LOCK_EX)
        yield
