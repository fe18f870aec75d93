"""Run a function in a separate process while this process goes on with other work."""

import contextlib
from collections import deque
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from prb3r.errors import EngineError, Problem
from prb3r.runs.backends.loky import end_workers, interrupt_held, new_worker

T = TypeVar("T")


class Aside(Generic[T]):
    """A function applied to one argument after another, in a separate process or, if not `apart`, in this one at once.

    `done` holds the values returned so far, in the order of the arguments, all of them once the context is left.
    Leaving the context by an interrupt kills the process; leaving it otherwise waits for the process, and raises what
    the function has raised.
    """

    def __init__(self, function: Callable[[Any], T], apart: bool) -> None:
        """`function` of one argument, whose values and errors can be pickled; `apart`: run it in a separate process."""
        self.function, self.apart = function, apart
        self.done: list[T] = []
        self.under_way: deque[tuple[Any, contextlib.ExitStack]] = deque()
        self.worker: Any = None

    def __enter__(self) -> "Aside[T]":
        return self

    def begin(self, thing: Any, held: contextlib.ExitStack) -> None:
        """Start the function on `thing`; `held` is closed when the function has ended for it.

        Raises
        ------
        EngineError
            If the process has died on an earlier argument.
        Exception
            Whatever the function raised for an earlier argument or, in this process, for this one.
        """
        with held:
            if self.apart:
                self._take(wait=False)
                future = self._submit(thing)
                self.under_way.append((future, held.pop_all()))
            else:
                self.done.append(self.function(thing))

    def _submit(self, thing: Any) -> Any:
        """The future of the function on `thing`, in the process or, if it has died with nothing to do, in a new one."""
        from joblib.externals.loky.process_executor import BrokenProcessPool

        while True:
            self.worker = self.worker or new_worker()
            try:
                with interrupt_held():
                    return self.worker.submit(self.function, thing)
            except BrokenProcessPool:
                self._take(wait=True)
                end_workers([self.worker])
                self.worker = None

    def _take(self, wait: bool) -> None:
        """Move finished values to `done`, in order; with `wait`, wait for all of them."""
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
