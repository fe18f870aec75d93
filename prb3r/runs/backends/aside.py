"""What is done in a process of its own while this one goes on with something else."""

import contextlib
from collections import deque
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from prb3r.errors import EngineError, Problem
from prb3r.runs.backends.loky import end_workers, interrupt_held, new_worker

T = TypeVar("T")


class Aside(Generic[T]):
    """One function on one thing after another, apart or, where that is not asked for, in this process at once.

    `done` holds what it returned, in the order of the things, all of it once the context is left.  Leaving it by an
    interrupt ends what is under way; by anything else waits, and what the function raised earlier than that is raised.
    """

    def __init__(self, function: Callable[[Any], T], apart: bool) -> None:
        """`function` of one thing, which returns or raises what can be pickled; `apart`: in a process of its own."""
        self.function, self.apart = function, apart
        self.done: list[T] = []
        self.under_way: deque[tuple[Any, contextlib.ExitStack]] = deque()
        self.worker: Any = None

    def __enter__(self) -> "Aside[T]":
        return self

    def begin(self, thing: Any, held: contextlib.ExitStack) -> None:
        """Begin with a thing; `held` is closed when the function has ended for it.

        Raises
        ------
        EngineError
            If the process has died with an earlier thing.
        Exception
            Whatever the function raised for an earlier one or, in this process, for this one.
        """
        with held:
            if self.apart:
                self._take(wait=False)
                self.worker = self.worker or new_worker()
                with interrupt_held():
                    future = self.worker.submit(self.function, thing)
                self.under_way.append((future, held.pop_all()))
            else:
                self.done.append(self.function(thing))

    def _take(self, wait: bool) -> None:
        """Take what is done, in order; `wait` for all of it."""
        from joblib.externals.loky.process_executor import BrokenProcessPool

        while self.under_way and (wait or self.under_way[0][0].done()):
            future, held = self.under_way[0]
            try:
                self.done.append(future.result())
            except BrokenProcessPool:
                raise EngineError(Problem("workers", "the process that draws figures died; run it again")) from None
            self.under_way.popleft()
            held.close()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None or issubclass(kind, Exception):
                self._take(wait=True)
        finally:
            end_workers([self.worker] if self.worker else [])
            for _future, held in self.under_way:
                held.close()
