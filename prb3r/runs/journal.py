"""Results on disk as they come: a run that was interrupted goes on where it stopped."""

import pickle
import time
import zlib
from pathlib import Path
from typing import Any, BinaryIO

from prb3r.errors import EngineError, Problem


class Journal:
    """Values by stage and number, appended to one file.

    Parameters
    ----------
    path : of the file; None keeps nothing.
    key : of what the values are computed from; a journal of anything else is begun anew.

    Raises
    ------
    EngineError
        If the file cannot be written.
    """

    def __init__(self, path: Path | None, key: str = "") -> None:
        self._path, self._begin = path, time.monotonic()
        self._spent, self._values = 0.0, dict[str, dict[int, Any]]()
        if path is None:
            return
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with open(path, "r+b" if path.exists() else "w+b") as file:
                if _entry(file) != key:
                    file.truncate(0)
                    file.seek(0)
                    _write(file, key)
                self._read(file)
        except OSError as error:
            raise EngineError(Problem(str(path), f"cannot be written: {error.strerror}")) from None

    @property
    def seconds(self) -> float:
        """Time spent so far, with that of earlier runs which were interrupted, s."""
        return self._spent + time.monotonic() - self._begin

    def known(self, stage: str) -> dict[int, Any]:
        """Values of a stage that are there already, by number."""
        return dict(self._values.get(stage, {}))

    def add(self, stage: str, number: int, value: Any) -> None:
        """Append the value of a stage with its number to the file."""
        if self._path:
            with open(self._path, "ab") as file:
                _write(file, (stage, number, value, self.seconds))

    def discard(self) -> None:
        """Remove the file, as all of it has been used."""
        if self._path:
            self._path.unlink(missing_ok=True)

    def _read(self, file: BinaryIO) -> None:
        """All whole entries; what an interruption tore is cut off."""
        whole = file.tell()
        while (entry := _entry(file)) is not None:
            stage, number, value, self._spent = entry
            self._values.setdefault(stage, {})[number] = value
            whole = file.tell()
        file.truncate(whole)


def _entry(file: BinaryIO) -> Any:
    """The next entry; None where there is no whole one."""
    size = int.from_bytes(file.read(8), "big")
    content = file.read(size) if 0 < size < 2**40 else b""
    return pickle.loads(zlib.decompress(content)) if content and len(content) == size else None


def _write(file: BinaryIO, entry: Any) -> None:
    content = zlib.compress(pickle.dumps(entry))
    file.write(len(content).to_bytes(8, "big") + content)
