"""Workers on other machines, by dask."""

import contextlib
import logging
import time
from collections.abc import Callable
from functools import partial
from queue import SimpleQueue
from typing import Any
from uuid import uuid4

from prb3r.errors import EngineError, Problem
from prb3r.runs.backends.shield import reason_of, shielded
from prb3r.runs.tasks import Fate, Job, Workers

PATIENCE_S = 30.0
"""How long to wait for a dask scheduler to answer and for workers to appear, s."""


class DaskWorkers:
    """Workers of a running dask cluster, whose scheduler retries a task that loses its worker before it gives up."""

    heartbeat_s = 2.0
    """Time without an event, s, after which `check` is called."""
    strikes = 1
    """Times that the scheduler may give up a job which runs alone, before the job counts as crashed."""

    def __init__(self, workers: Workers, function: Callable, events: SimpleQueue) -> None:
        self.address, self.function, self.events = workers.scheduler or "", function, events
        self.futures: dict[Job, Any] = {}
        self.seen = time.monotonic()

    def __enter__(self) -> "DaskWorkers":
        try:
            import distributed
        except ImportError:
            raise EngineError(Problem("dask", "is not installed; pip install 'prb3r[dask]'")) from None
        if not self.address:
            raise EngineError(Problem("dask", "needs the address of a running scheduler, such as tcp://host:8786"))
        # The client would log tracebacks of errors that are reported here in a sentence.
        self.logger = logging.getLogger("distributed.client")
        self.level = self.logger.level
        self.logger.setLevel(logging.CRITICAL + 1)
        try:
            self.client = distributed.Client(self.address, timeout=PATIENCE_S, set_as_default=False)
        except (OSError, ValueError) as error:
            self.logger.setLevel(self.level)
            raise EngineError(Problem(self.address, f"no dask scheduler answers ({reason_of(error)})")) from None
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
        """Raise EngineError if the scheduler or a worker imports another program text of prb3r than this process."""

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

    def submit(self, job: Job) -> None:
        """Start a job; when it ends, `(job, fate, result)` is put on `events`: its value, or the reason in one line."""
        task = partial(shielded, self.function, job.task)
        future = self.futures[job] = self.client.submit(task, key=f"prb3r-{uuid4().hex}", pure=False)
        future.add_done_callback(partial(self._report, job))

    def _report(self, job: Job, future: Any) -> None:
        from distributed import KilledWorker

        try:
            self.events.put((job, *future.result()))
        except KilledWorker as error:
            self.events.put((job, "crashed", f"its worker died ({error.allowed_failures + 1} times)"))
        except BaseException as error:
            lost = future.status in ("cancelled", "lost")
            gone = EngineError(Problem(self.address, "the connection to the scheduler was lost"))
            self.events.put(gone if lost else (job, "raised", reason_of(error)))

    def check(self) -> None:
        """Raise EngineError once the cluster has been without workers for `PATIENCE_S`."""
        if self.client.scheduler_info()["workers"]:
            self.seen = time.monotonic()
        elif time.monotonic() - self.seen > PATIENCE_S:
            raise EngineError(Problem(self.address, f"the scheduler has had no workers for {PATIENCE_S:g} s"))

    def free(self, job: Job, fate: Fate) -> None:
        """Release the future of a job that has ended."""
        self.futures.pop(job).release()
        self.seen = time.monotonic()

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(Exception):
            self.client.cancel(list(self.futures.values()))
        self._close()

    def _close(self) -> None:
        self.client.close(timeout=5)
        self.logger.setLevel(self.level)
