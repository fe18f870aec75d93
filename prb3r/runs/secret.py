"""A secret key of the user, by which the program recognises files that it has written itself."""

import contextlib
import os
import secrets
import stat
from pathlib import Path

from prb3r.runs.files import NO_LINK

SECRET = 32
"""Length of the secret, bytes."""


def user_secret() -> bytes:
    """The secret of this user on this machine: the same at every call, or a new one where none can be stored."""
    path = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "prb3r" / "secret"
    with contextlib.suppress(OSError):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not path.exists():
            _make(path)
        known = os.open(path, os.O_RDONLY | NO_LINK)
        try:
            content = os.read(known, SECRET + 1) if _is_private(os.fstat(known)) else b""
        finally:
            os.close(known)
        if len(content) == SECRET:
            return content
    return secrets.token_bytes(SECRET)


def _make(path: Path) -> None:
    """Write a new secret to `path`, never visible in part; where several processes do, the first one wins."""
    temporary = path.with_name(f"{path.name}.{secrets.token_hex(6)}")
    with open(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(secrets.token_bytes(SECRET))
    try:
        with contextlib.suppress(FileExistsError):
            os.link(temporary, path)
    finally:
        temporary.unlink()


def _is_private(status: os.stat_result) -> bool:
    """Whether the status is that of a regular file of this user which nobody else can read or write."""
    if not hasattr(os, "geteuid"):
        return True  # such systems keep the folders of users apart
    return stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid() and not status.st_mode & 0o077
