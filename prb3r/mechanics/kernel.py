"""How kernels are compiled: one decorator, and a disk cache that cannot go stale.

Numba keys a cached kernel by its own file alone, so an edit of `balance.py` would leave the kernels that call it
unchanged.  The cache folder is therefore named after the text of the whole package.
"""

import hashlib
import os
import tempfile
from pathlib import Path

from numba import njit
from numba.core import config


def _cache_folder() -> str:
    sources = sorted(Path(__file__).parent.glob("*.py"))
    text = hashlib.sha256(b"\0".join(source.read_bytes() for source in sources))
    name = f"kernels-{text.hexdigest()[:12]}"
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "prb3r" / name
    try:
        home.mkdir(parents=True, exist_ok=True)
        if os.access(home, os.W_OK):
            return str(home)
    except OSError:
        pass
    return str(Path(tempfile.gettempdir()) / f"prb3r-{os.getuid() if hasattr(os, 'getuid') else 'user'}" / name)


_FOLDER = _cache_folder()
_COMPILE = njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})


def kernel(function):
    """Compile `function` with numba (no bounds checks, no division checks) and keep the machine code on disk.

    Divisions follow IEEE rules; NaN and infinity stay visible, so that a failed solve can be told from a good one.
    """
    folder = config.CACHE_DIR  # type: ignore[attr-defined]
    config.CACHE_DIR = _FOLDER  # type: ignore[attr-defined]
    try:
        return _COMPILE(function)
    finally:
        config.CACHE_DIR = folder  # type: ignore[attr-defined]
