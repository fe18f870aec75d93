"""Workers: run one function on many tasks so that a worker that dies costs nothing but its own case.

Every loky worker is a pool of its own, so a death names its task.  A task that raises or loses its worker is split if
it can be.  What has lost a worker then runs alone, with nothing else under way, and is `crashed` if it loses its worker
again and again.  This is the only module that knows joblib and dask.
"""

import contextlib
import logging
import os
import re
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, Literal
from uuid import uuid4

from prb3r.errors import EngineError, Problem, did_you_mean

PATIENCE_S = 30.0
"""How long to wait for a dask scheduler to answer and for workers to appear."""

ENVIRONMENT = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS"), "1"
) | {"PYTHONFAULTHANDLER": os.environ.get("PYTHONFAULTHANDLER", "")}
"""Of a worker: one thread, as more would change the last bits of sums; no dump of a crash unless asked for."""

Fate = Literal["done", "raised", "crashed"]


@dataclass(frozen=True)
class Piece:
    """What became of a task, or of one part of a task that had to be split."""

    task: Any
    fate: Fate
    value: Any = None
    """What the function returned, if done."""
    reason: str = ""
    """One line, if not."""


@dataclass(frozen=True)
class Workers:
    """Who does the work."""

    backend: Literal["loky", "dask"] = "loky"
    jobs: int = 1
    """Number of worker processes on this machine, for loky."""
    scheduler: str | None = None
    """Address, for dask: `tcp://host:8786`."""


def run_tasks(
    function: Callable[[Any], Any],
    tasks: Mapping[int, Any] | Sequence[Any],
    on_result: Callable[[int, list[Piece]], None],
    workers: Workers = Workers(),
    split: Callable[[Any], Sequence[Any]] = lambda task: (task,),
) -> None:
    """Apply `function` to every task in worker processes and deliver each outcome as it completes.

    Parameters
    ----------
    function
        Of one task; importable by the workers.  It may raise or kill its process.
    tasks
        A sequence, or a mapping from numbers of the caller's choice.
    on_result
        Called in this thread with the task's number and its pieces: one, or those of `split` in their order.
    split
        The parts of a task, for one that raised or lost its worker.

    Raises
    ------
    EngineError
        If there are no workers or none are left.
    KeyboardInterrupt
        On SIGINT or SIGTERM, after the `on_result` under way, with the workers gone.  A second signal does not wait.
    """
    numbered = dict(tasks if isinstance(tasks, Mapping) else enumerate(tasks))
    if workers.backend not in BACKENDS:
        raise EngineError(Problem("backend", f"unknown: {workers.backend!r}{did_you_mean(workers.backend, BACKENDS)}"))
    if not numbered:
        return
    events: SimpleQueue = SimpleQueue()
    with _interrupts(events), BACKENDS[workers.backend](workers, function, events) as pool:
        _Run(numbered, split, on_result).drive(pool, events)


@contextlib.contextmanager
def together(jobs: int) -> Iterator[Callable[[Callable[[Any], Any], Sequence[Any]], list[Any]]]:
    """A map over `jobs` worker processes that live as long as the context; here where one is enough."""
    if jobs == 1:
        yield lambda function, tasks: [function(task) for task in tasks]
        return
    from joblib import Parallel, delayed, parallel_config

    with parallel_config(backend="loky", inner_max_num_threads=1), Parallel(n_jobs=jobs, batch_size=1) as parallel:

        def each(function: Callable[[Any], Any], tasks: Sequence[Any]) -> list[Any]:
            if len(tasks) < 2:
                return [function(task) for task in tasks]
            return parallel(delayed(function)(task) for task in tasks)

        yield each


@dataclass(eq=False)
class _Job:
    number: int
    part: int | None
    task: Any
    deaths: int = 0


class _Run:
    """What is waiting, suspected, under way and partly done."""

    def __init__(self, tasks: dict, split: Callable, on_result: Callable) -> None:
        self.split, self.on_result = split, on_result
        self.waiting = deque(_Job(number, None, task) for number, task in tasks.items())
        self.suspects: deque[_Job] = deque()
        self.flying, self.alone = 0, False
        self.pieces: dict[int, list[Piece | None]] = {}

    def drive(self, pool: "_Loky | _Dask", events: SimpleQueue) -> None:
        while self.waiting or self.suspects or self.flying:
            while self.waiting and self.flying < (1 if self.alone else pool.slots):
                self._launch(pool, self.waiting, alone=False)
            if self.suspects and not self.flying:
                self._launch(pool, self.suspects, alone=True)
            try:
                event = events.get(timeout=pool.heartbeat_s)
            except Empty:
                pool.check()
                continue
            if isinstance(event, BaseException):
                raise event
            job, fate, result = event
            self.flying -= 1
            pool.free(job, fate)
            self._settle(job, fate, result, pool.strikes)
            self.alone = self.alone and self.flying > 0

    def _launch(self, pool: "_Loky | _Dask", queue: deque[_Job], alone: bool) -> None:
        self.flying, self.alone = self.flying + 1, alone
        pool.submit(queue.popleft())

    def _settle(self, job: _Job, fate: Fate, result: Any, strikes: int) -> None:
        parts = self.split(job.task) if fate != "done" and job.part is None else ()
        if fate == "done":
            self._deliver(job, Piece(job.task, fate, value=result))
        elif len(parts) > 1:
            self.pieces[job.number] = [None] * len(parts)
            queue = self.suspects if fate == "crashed" else self.waiting
            queue.extend(_Job(job.number, part, task) for part, task in enumerate(parts))
        elif fate == "crashed" and job.deaths + self.alone < strikes:
            job.deaths += self.alone
            self.suspects.appendleft(job)
        else:
            self._deliver(job, Piece(job.task, fate, reason=result))

    def _deliver(self, job: _Job, piece: Piece) -> None:
        pieces = self.pieces.setdefault(job.number, [None])
        pieces[job.part or 0] = piece
        if None not in pieces:
            self.on_result(job.number, self.pieces.pop(job.number))


class _Loky:
    """Processes on this machine, started when first needed and replaced when dead."""

    heartbeat_s = 60.0
    strikes = 2

    def __init__(self, workers: Workers, function: Callable, events: SimpleQueue) -> None:
        self.slots, self.function, self.events = max(1, workers.jobs), function, events
        self.idle: list[Any] = []
        self.busy: dict[_Job, Any] = {}

    def __enter__(self) -> "_Loky":
        # Started along with the first worker, it would undo `_interrupt_held`.
        with contextlib.suppress(ImportError):
            from multiprocessing import resource_tracker

            resource_tracker.ensure_running()
        return self

    def submit(self, job: _Job) -> None:
        from joblib.externals.loky.process_executor import BrokenProcessPool, ProcessPoolExecutor

        while True:
            fresh = not self.idle
            one = ProcessPoolExecutor(1, initializer=_obey, initargs=(os.getpid(),), env=ENVIRONMENT) if fresh else None
            self.busy[job] = one or self.idle.pop()
            try:
                with _interrupt_held():
                    future = self.busy[job].submit(_shielded, self.function, job.task)
            except BrokenProcessPool:
                self.free(job, "crashed")
            else:
                future.add_done_callback(partial(self._report, job))
                return

    def _report(self, job: _Job, future: Any) -> None:
        from joblib.externals.loky.process_executor import BrokenProcessPool

        error = future.exception()
        if isinstance(error, BrokenProcessPool):
            code = re.search(r"\{(.+)\}", str(error))
            self.events.put((job, "crashed", f"its worker died ({code[1]})" if code else _reason(error)))
        else:
            self.events.put((job, *(("raised", _reason(error)) if error else future.result())))

    def check(self) -> None:
        """Nothing to look after: a process that dies reports itself."""

    def free(self, job: _Job, fate: Fate) -> None:
        one = self.busy.pop(job)
        if fate == "crashed":
            one.shutdown()
        else:
            self.idle.append(one)

    def __exit__(self, *_: object) -> None:
        for one in [*self.idle, *self.busy.values()]:
            one.shutdown(kill_workers=True)


class _Dask:
    """A cluster that others keep running; its scheduler retries what loses a worker before it gives up."""

    heartbeat_s = 2.0
    strikes = 1

    def __init__(self, workers: Workers, function: Callable, events: SimpleQueue) -> None:
        self.address, self.function, self.events = workers.scheduler or "", function, events
        self.futures: dict[_Job, Any] = {}
        self.seen = time.monotonic()

    def __enter__(self) -> "_Dask":
        try:
            import distributed
        except ImportError:
            raise EngineError(Problem("dask", "is not installed; pip install 'prb3r[dask]'")) from None
        if not self.address:
            raise EngineError(Problem("dask", "needs the address of a running scheduler, such as tcp://host:8786"))
        # It would print tracebacks of what is reported here in a sentence.
        self.logger = logging.getLogger("distributed.client")
        self.level = self.logger.level
        self.logger.setLevel(logging.CRITICAL + 1)
        try:
            self.client = distributed.Client(self.address, timeout=PATIENCE_S, set_as_default=False)
        except (OSError, ValueError) as error:
            self.logger.setLevel(self.level)
            raise EngineError(Problem(self.address, f"no dask scheduler answers ({_reason(error)})")) from None
        try:
            self.client.wait_for_workers(1, timeout=PATIENCE_S)
            self._same_source()
            self.slots = 2 * sum(self.client.nthreads().values())
        except BaseException as error:
            self._close()
            if isinstance(error, TimeoutError):
                raise EngineError(Problem(self.address, "the scheduler has no workers; start some")) from None
            raise
        return self

    def _same_source(self) -> None:
        def source() -> str:
            import hashlib
            from pathlib import Path

            try:
                import prb3r
            except ImportError:
                return "absent"
            folder = Path(prb3r.__file__).parent
            files = sorted(folder.rglob("*.py"))
            content = b"\0".join(str(path.relative_to(folder)).encode() + path.read_bytes() for path in files)
            return hashlib.sha256(content).hexdigest()[:12]

        here = source()
        others = {"scheduler": self.client.run_on_scheduler(source), **self.client.run(source)}
        wrong = [
            Problem(where, f"imports prb3r {there}, this machine {here}; install the same version on both")
            for where, there in others.items()
            if there != here
        ]
        if wrong:
            raise EngineError(*wrong)

    def submit(self, job: _Job) -> None:
        task = partial(_shielded, self.function, job.task)
        future = self.futures[job] = self.client.submit(task, key=f"prb3r-{uuid4().hex}", pure=False)
        future.add_done_callback(partial(self._report, job))

    def _report(self, job: _Job, future: Any) -> None:
        from distributed import KilledWorker

        try:
            self.events.put((job, *future.result()))
        except KilledWorker as error:
            self.events.put((job, "crashed", f"its worker died ({error.allowed_failures + 1} times)"))
        except BaseException as error:
            lost = future.status in ("cancelled", "lost")
            gone = EngineError(Problem(self.address, "the connection to the scheduler was lost"))
            self.events.put(gone if lost else (job, "raised", _reason(error)))

    def check(self) -> None:
        """Give up once the cluster has been without workers for too long."""
        if self.client.scheduler_info()["workers"]:
            self.seen = time.monotonic()
        elif time.monotonic() - self.seen > PATIENCE_S:
            raise EngineError(Problem(self.address, f"the scheduler has had no workers for {PATIENCE_S:g} s"))

    def free(self, job: _Job, fate: Fate) -> None:
        self.futures.pop(job).release()
        self.seen = time.monotonic()

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(Exception):
            self.client.cancel(list(self.futures.values()))
        self._close()

    def _close(self) -> None:
        self.client.close(timeout=5)
        self.logger.setLevel(self.level)


BACKENDS: dict[str, type[_Loky] | type[_Dask]] = {"loky": _Loky, "dask": _Dask}


def _shielded(function: Callable, task: Any) -> tuple[Fate, Any]:
    """In a worker: the result, or the reason there is none."""
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)
    try:
        return "done", function(task)
    except Exception as error:
        return "raised", _reason(error)


def _obey(parent: int) -> None:
    """In a new worker: leave interrupts to the parent, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _reason(error: BaseException) -> str:
    first = next(iter(str(error).splitlines()), "")
    return f"{type(error).__name__}: {first}"[:300].removesuffix(": ")


@contextlib.contextmanager
def _interrupts(events: SimpleQueue) -> Iterator[None]:
    """SIGINT and SIGTERM as events, so that they come between deliveries."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    asked: list[int] = []

    def ask(number: int, frame: object) -> None:
        if asked:
            raise KeyboardInterrupt
        asked.append(number)
        events.put(KeyboardInterrupt())

    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)
    if asked:
        raise KeyboardInterrupt


@contextlib.contextmanager
def _interrupt_held() -> Iterator[None]:
    """Keep SIGINT back while a worker starts: it inherits that, and would print a traceback before it can obey."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
