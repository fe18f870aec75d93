"""A dask cluster on this machine's own address, for tests, and a bound on how long they wait for it."""

import contextlib
import logging
import os
import signal
import threading

import pytest

LOCAL = "127.0.0.1:0"


@contextlib.contextmanager
def local_cluster(workers=2):
    distributed = pytest.importorskip("distributed", reason="the dask backend needs the extra 'dask'")
    import dask

    # One repeat instead of three, and no half minute of asking a dead worker for its results.
    quick = {"distributed.scheduler.allowed-failures": 1, "distributed.comm.timeouts.connect": "3s"}
    with (
        dask.config.set(quick),
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address=LOCAL,
            scheduler_kwargs={"dashboard": False},
            worker_dashboard_address=LOCAL,
            silence_logs=logging.CRITICAL,
        ) as cluster,
    ):
        yield cluster


@contextlib.contextmanager
def at_most(seconds):
    """Interrupt what takes longer."""
    guard = threading.Timer(seconds, lambda: os.kill(os.getpid(), signal.SIGINT))
    guard.start()
    try:
        yield
    finally:
        guard.cancel()
