"""Run one function on many tasks in worker processes, so that a worker that dies costs no more than its own case.

A task that raises or loses its worker is split if it can be.  A job that has lost a worker is run again alone, with
nothing else under way, and is `crashed` once it has lost as many workers alone as the backend allows (`strikes`).
"""

import contextlib
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from queue import Empty, SimpleQueue
from typing import Any

from prb3r.errors import EngineError, Problem, did_you_mean
from prb3r.runs.backends.dask import DaskWorkers
from prb3r.runs.backends.loky import LokyWorkers
from prb3r.runs.tasks import ONE_PROCESS, Fate, Job, Piece, Workers

BACKENDS: dict[str, type[LokyWorkers] | type[DaskWorkers]] = {"loky": LokyWorkers, "dask": DaskWorkers}


def run_tasks(
    function: Callable[[Any], Any],
    tasks: Mapping[int, Any] | Sequence[Any],
    on_result: Callable[[int, list[Piece]], None],
    workers: Workers = ONE_PROCESS,
    split: Callable[[Any], Sequence[Any]] = lambda task: (task,),
) -> None:
    """Apply `function` to every task in worker processes and deliver each outcome as it completes.

    Parameters
    ----------
    function
        Function of one task, importable by the workers.  It may raise or kill its process.
    tasks
        A sequence, or a mapping from numbers that the caller chooses to tasks.
    on_result
        Called in this thread with the number of a task and its pieces: one, or one for each part in the order of
        `split`.
    split
        Gives the parts of a task that raised or lost its worker.

    Raises
    ------
    EngineError
        If there are no workers or none are left.
    KeyboardInterrupt
        On SIGINT, SIGTERM or SIGHUP, after the `on_result` under way has returned and the workers have ended.  A
        second signal interrupts at once.
    """
    numbered = dict(tasks if isinstance(tasks, Mapping) else enumerate(tasks))
    if workers.backend not in BACKENDS:
        raise EngineError(Problem("backend", f"unknown: {workers.backend!r}{did_you_mean(workers.backend, BACKENDS)}"))
    if not numbered:
        return
    events: SimpleQueue = SimpleQueue()
    with _interrupts(events), BACKENDS[workers.backend](workers, function, events) as pool:
        _Run(numbered, split, on_result).drive(pool, events)


class _Run:
    """The state of a run: jobs waiting, jobs suspected of killing workers, number of jobs `under_way`, whether
    a suspect runs `alone`, and the pieces so far of tasks that were split."""

    def __init__(self, tasks: dict, split: Callable, on_result: Callable) -> None:
        self.split, self.on_result = split, on_result
        self.waiting = deque(Job(number, None, task) for number, task in tasks.items())
        self.suspects: deque[Job] = deque()
        self.under_way, self.alone = 0, False
        self.pieces: dict[int, list[Piece | None]] = {}

    def drive(self, pool: "LokyWorkers | DaskWorkers", events: SimpleQueue) -> None:
        """Run all jobs to their end; each outcome is delivered as it comes."""
        while self.waiting or self.suspects or self.under_way:
            while self.waiting and self.under_way < (1 if self.alone else pool.slots):
                self._launch(pool, self.waiting, alone=False)
            if self.suspects and not self.under_way:
                self._launch(pool, self.suspects, alone=True)
            try:
                event = events.get(timeout=pool.heartbeat_s)
            except Empty:
                pool.check()
                continue
            if isinstance(event, BaseException):
                raise event
            job, fate, result = event
            self.under_way -= 1
            pool.free(job, fate)
            self._settle(job, fate, result, pool.strikes)
            self.alone = self.alone and self.under_way > 0

    def _launch(self, pool: "LokyWorkers | DaskWorkers", queue: deque[Job], alone: bool) -> None:
        self.under_way, self.alone = self.under_way + 1, alone
        pool.submit(queue.popleft())

    def _settle(self, job: Job, fate: Fate, result: Any, strikes: int) -> None:
        """Deliver the outcome of a job that has ended, split it, or queue it to run again alone."""
        parts = self.split(job.task) if fate != "done" and job.part is None else ()
        if fate == "done":
            self._deliver(job, Piece(job.task, fate, value=result))
        elif len(parts) > 1:
            self.pieces[job.number] = [None] * len(parts)
            queue = self.suspects if fate == "crashed" else self.waiting
            queue.extend(Job(job.number, part, task) for part, task in enumerate(parts))
        elif fate == "crashed" and job.deaths + self.alone < strikes:
            job.deaths += self.alone
            self.suspects.appendleft(job)
        else:
            self._deliver(job, Piece(job.task, fate, reason=result))

    def _deliver(self, job: Job, piece: Piece) -> None:
        """Record a piece, and call `on_result` when all pieces of the task are there."""
        pieces = self.pieces.setdefault(job.number, [None])
        pieces[job.part or 0] = piece
        if None not in pieces:
            self.on_result(job.number, self.pieces.pop(job.number))


def stopping_signals() -> list[int]:
    """The signals that stop a run: SIGINT, SIGTERM and, unless it is ignored as under `nohup`, SIGHUP."""
    hangup = [getattr(signal, name) for name in ("SIGHUP",) if hasattr(signal, name)]
    heard = [number for number in hangup if signal.getsignal(number) != signal.SIG_IGN]
    return [signal.SIGINT, signal.SIGTERM, *heard]


@contextlib.contextmanager
def _interrupts(events: SimpleQueue) -> Iterator[None]:
    """Turn the signals that stop a run into events within the context, so that they take effect between deliveries."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    asked: list[int] = []

    def ask(number: int, frame: object) -> None:
        if asked:
            raise KeyboardInterrupt
        asked.append(number)
        events.put(KeyboardInterrupt())

    before = {number: signal.signal(number, ask) for number in stopping_signals()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)
    if asked:
        raise KeyboardInterrupt
