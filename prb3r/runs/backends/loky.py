"""Worker processes on this machine, by joblib's loky.

Every worker is an executor of one process, so that a worker which dies tells which task killed it.  Workers outlive a
run without errors and serve the next run of this process: starting one and loading the package takes longer than many
studies do.
"""

import atexit
import contextlib
import os
import re
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any

from prb3r.runs.backends.shield import reason_of, shielded
from prb3r.runs.tasks import Fate, Job, Workers
from prb3r.runs.threads import LINEAR_ALGEBRA

ENVIRONMENT = dict.fromkeys((*LINEAR_ALGEBRA, "NUMBA_NUM_THREADS"), "1") | {
    "PYTHONFAULTHANDLER": os.environ.get("PYTHONFAULTHANDLER", ""),
    "MALLOC_MMAP_THRESHOLD_": str(2**25),
    "MALLOC_TRIM_THRESHOLD_": str(2**27),
}
"""Environment of a worker: one thread, as more would change the last bits of sums; no dump of a crash unless the user
asks for it; and up to 128 MiB that one task frees are kept for the next (by glibc; other systems do not know these).
Choice: blocks up to 32 MiB, the most that glibc allows, are kept, and of these a few."""


_KEPT: dict[int, list[Any]] = {}
"""Idle workers of earlier runs, by the number of the process that started them: a forked process cannot use them."""


class LokyWorkers:
    """Processes on this machine, started when first needed and replaced when dead."""

    heartbeat_s = 60.0
    """Time without an event, s, after which `check` is called."""
    strikes = 2
    """Workers that a job may kill, running alone, before it counts as crashed."""

    def __init__(self, workers: Workers, function: Callable, events: SimpleQueue) -> None:
        self.slots, self.function, self.events = max(1, workers.jobs), function, events
        self.idle: list[Any] = []
        self.busy: dict[Job, Any] = {}

    def __enter__(self) -> "LokyWorkers":
        ignore_replacements()
        self.idle = _KEPT.pop(os.getpid(), [])
        return self

    def submit(self, job: Job) -> None:
        """Start a job; when it ends, `(job, fate, result)` is put on `events`: its value, or the reason in one line."""
        from joblib.externals.loky.process_executor import BrokenProcessPool

        while True:
            self.busy[job] = self.idle.pop() if self.idle else new_worker()
            try:
                with interrupt_held():
                    future = self.busy[job].submit(shielded, self.function, job.task)
            except BrokenProcessPool:
                self.free(job, "crashed")
            else:
                future.add_done_callback(partial(self._report, job))
                return

    def _report(self, job: Job, future: Any) -> None:
        from joblib.externals.loky.process_executor import BrokenProcessPool

        error = future.exception()
        if isinstance(error, BrokenProcessPool):
            code = re.search(r"\{(.+)\}", str(error))
            self.events.put((job, "crashed", f"its worker died ({code[1]})" if code else reason_of(error)))
        else:
            self.events.put((job, *(("raised", reason_of(error)) if error else future.result())))

    def check(self) -> None:
        """Count the jobs as crashed whose executor no longer reports: its thread, which tells of the death of a worker,
        may have ended by an error of its own."""
        for job, pool in self.busy.items():
            reports = pool._executor_manager_thread
            if reports is None or not reports.is_alive():
                self.events.put((job, "crashed", "its worker ended without a word"))

    def free(self, job: Job, fate: Fate) -> None:
        """Make the worker of a job that has ended idle again, or shut it down if it crashed."""
        pool = self.busy.pop(job)
        if fate == "crashed":
            pool.shutdown()
        else:
            self.idle.append(pool)

    def __exit__(self, failed: object, *_: object) -> None:
        if failed:
            end_workers([*self.idle, *self.busy.values()])
        else:
            _KEPT.setdefault(os.getpid(), []).extend(self.idle)


@atexit.register
def end_kept_workers() -> None:
    """End the idle workers that are kept for further runs of this process."""
    end_workers(_KEPT.pop(os.getpid(), []))


def new_worker() -> Any:
    """An executor of one process, which starts at the first submission; make that one under :func:`interrupt_held`."""
    from joblib.externals.loky.process_executor import ProcessPoolExecutor

    # Started along with the first worker, the resource tracker would undo `interrupt_held`.
    with contextlib.suppress(ImportError):
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()
    ignore_replacements()
    return ProcessPoolExecutor(1, initializer=_obey, initargs=(os.getpid(),), env=ENVIRONMENT)


def ignore_replacements() -> None:
    """Ignore loky's warning that it replaces a worker whose memory has grown.

    Where warnings are errors, it would end the thread that reports results.
    """
    warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)


def end_workers(pools: list[Any]) -> None:
    """Kill the processes of executors at once, whatever they are doing.

    Work that is still queued is removed before: loky would look it up again after dropping it, and print a KeyError.
    """
    for pool in pools:
        with contextlib.suppress(Empty):
            while True:
                pool._work_ids.get_nowait()
        pool.shutdown(kill_workers=True)


def _obey(parent: int) -> None:
    """Initialise a worker: ignore SIGINT, which the parent handles, and exit when the process `parent` is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextlib.contextmanager
def interrupt_held() -> Iterator[None]:
    """Block SIGINT within the context, in which a worker starts and inherits the blocking.

    Otherwise a worker that is interrupted before `_obey` has run would print a traceback.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
