"""Results of tasks, written to disk as they come, so that an interrupted run goes on where it stopped."""

import hmac
import os
import pickle
import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from prb3r.errors import EngineError, Problem
from prb3r.runs.engine import run_tasks
from prb3r.runs.files import NO_LINK
from prb3r.runs.secret import user_secret
from prb3r.runs.tasks import Piece, Workers

CODE = 32
"""Length of the authentication code (HMAC-SHA256) of an entry, bytes."""
TOLD_EVERY_S = 20.0
"""Time between two messages of a stage about its progress, s."""
_Result = TypeVar("_Result")


class Journal:
    """Values of tasks by stage and task number, appended to one file.

    Every entry carries an authentication code made with a secret of the user.  Entries with another code are not read,
    as unpickling what somebody else has written could run their code.

    Parameters
    ----------
    path : file of the journal; None: nothing is stored.
    key : identifies what the values are computed from; a file with another key is emptied.

    Raises
    ------
    EngineError
        If the file cannot be written.
    """

    def __init__(self, path: Path | None, key: str = "") -> None:
        self._path, self._begin, self._secret = path, time.monotonic(), b""
        self._spent, self._values = 0.0, dict[str, dict[int, Any]]()
        if path is None:
            return
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._secret = user_secret()
            with open(os.open(path, os.O_RDWR | os.O_CREAT | NO_LINK, 0o600), "r+b") as file:
                if self._entry(file) != key:
                    file.truncate(0)
                    file.seek(0)
                    self._write(file, key)
                self._read(file)
        except OSError as error:
            raise EngineError(Problem(str(path), f"cannot be written: {error.strerror}")) from None

    @property
    def seconds(self) -> float:
        """Time since this journal was opened, plus the time of interrupted runs before up to their last entry, s."""
        return self._spent + time.monotonic() - self._begin

    def known(self, stage: str) -> dict[int, Any]:
        """The values of a stage that an earlier run has stored, by task number."""
        return dict(self._values.get(stage, {}))

    def add(self, stage: str, number: int, value: Any) -> None:
        """Append the value of task `number` of a stage to the file, which is closed when this returns."""
        if self._path:
            with open(self._path, "ab") as file:
                self._write(file, (stage, number, value, self.seconds))

    def discard(self) -> None:
        """Remove the file."""
        if self._path:
            self._path.unlink(missing_ok=True)

    def _read(self, file: BinaryIO) -> None:
        """Read all whole entries from the position of the file on, and cut the file off after the last of them."""
        whole = file.tell()
        while (entry := self._entry(file)) is not None:
            stage, number, value, self._spent = entry
            self._values.setdefault(stage, {})[number] = value
            whole = file.tell()
        file.truncate(whole)

    def _entry(self, file: BinaryIO) -> Any:
        """The next entry of the file; None at its end, or where the entry is torn or was written by somebody else."""
        size, code = int.from_bytes(file.read(8), "big"), file.read(CODE)
        content = file.read(size) if 0 < size < 2**40 else b""
        if not content or not hmac.compare_digest(code, self._code(content)):
            return None
        return pickle.loads(zlib.decompress(content))

    def _write(self, file: BinaryIO, entry: Any) -> None:
        content = zlib.compress(pickle.dumps(entry))
        file.write(len(content).to_bytes(8, "big") + self._code(content) + content)

    def _code(self, content: bytes) -> bytes:
        return hmac.digest(self._secret, content, "sha256")


@dataclass(frozen=True)
class Stages:
    """Work in stages of many tasks each, whose results are stored in a journal as they come."""

    journal: Journal
    jobs: int
    """Number of worker processes."""
    say: Callable[[str], None] = lambda text: None
    """Called with a message about the progress of a stage."""

    def results(self, stage: str, function: Callable[[Any], _Result], tasks: Sequence[Any]) -> list[_Result]:
        """Results of `function` in the order of the tasks; results that the journal holds are not computed again.

        Raises
        ------
        RuntimeError
            If a task raises or loses its worker.
        """
        out: dict[int, _Result] = self.journal.known(stage)
        told = time.monotonic()

        def keep(number: int, pieces: list[Piece]) -> None:
            nonlocal told
            if pieces[0].fate != "done":
                raise RuntimeError(f"task {number}: {pieces[0].reason}")
            out[number] = pieces[0].value
            self.journal.add(stage, number, pieces[0].value)
            if time.monotonic() - told > TOLD_EVERY_S:
                told = time.monotonic()
                self.say(f"{len(out)} of {len(tasks)}")

        run_tasks(function, {k: task for k, task in enumerate(tasks) if k not in out}, keep, Workers(jobs=self.jobs))
        return [out[k] for k in range(len(tasks))]
