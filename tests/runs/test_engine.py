"""Cases that die, raise or are interrupted cost themselves and nothing else."""

import contextlib
import os
import platform
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from joblib.externals.loky import process_executor
from local_cluster import at_most, local_cluster

from prb3r.errors import EngineError
from prb3r.runs.backends import dask as dask_backend
from prb3r.runs.backends.loky import LokyWorkers, end_kept_workers
from prb3r.runs.engine import run_tasks
from prb3r.runs.tasks import Workers

DEADLY, RAISING = 13, 19


def square(chunk):
    for case in chunk:
        if case == DEADLY:
            os._exit(3)
        if case == RAISING:
            raise ValueError("no equilibrium\nsecond line")
    return [case**2 for case in chunk]


def single(chunk):
    return [[case] for case in chunk]


def outcomes(tasks, workers, split=single):
    found = {}

    def keep(number, pieces):
        assert number not in found
        found[number] = pieces

    run_tasks(square, tasks, keep, workers, split)
    return found


def chunks(last, size=4):
    return [list(range(start, start + size)) for start in range(0, last, size)]


def assert_only_the_guilty_are_lost(found, tasks, crash):
    assert sorted(found) == list(range(len(tasks)))
    for number, task in enumerate(tasks):
        assert [case for piece in found[number] for case in piece.task] == task
    bad = {piece.task[0]: piece for pieces in found.values() for piece in pieces if piece.fate != "done"}
    assert set(bad) == {DEADLY, RAISING}
    assert (bad[DEADLY].fate, bad[RAISING].fate) == ("crashed", "raised")
    assert bad[DEADLY].reason.startswith(crash)
    assert bad[RAISING].reason == "ValueError: no equilibrium"
    assert all(p.value == [c**2 for c in p.task] for ps in found.values() for p in ps if p.fate == "done")


def test_a_dying_and_a_raising_case_cost_only_themselves_whatever_the_number_of_workers():
    tasks = chunks(40)
    alone, together = (outcomes(tasks, Workers(jobs=jobs)) for jobs in (1, 2))
    assert alone == together
    assert_only_the_guilty_are_lost(alone, tasks, "its worker died (EXIT(3))")


def test_what_cannot_be_split_is_lost_whole():
    found = outcomes([[1, 2], [DEADLY, 14], [3]], Workers(jobs=2), split=lambda task: [task])
    assert {number: [piece.fate for piece in pieces] for number, pieces in found.items()} == {
        0: ["done"],
        1: ["crashed"],
        2: ["done"],
    }


def victim(task):
    """Die of an outside cause the first time."""
    with contextlib.suppress(FileExistsError):
        Path(task).mkdir()
        os.kill(os.getpid(), signal.SIGKILL)
    return os.getppid()


def test_a_worker_killed_from_outside_is_replaced_and_its_task_done_again(tmp_path):
    found = {}
    run_tasks(victim, [str(tmp_path / "mark")], found.__setitem__)
    assert [piece.value for piece in found[0]] == [os.getpid()]


def own_number(task):
    return os.getpid()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_worker_whose_executor_no_longer_reports_is_replaced(monkeypatch):
    """The thread of an executor ends by an error of its own, such as a warning that counts as one, with a job under
    way."""
    end_kept_workers()
    plain, seen = process_executor._ExecutorManagerThread.process_result_item, []

    def failing_once(thread, item):
        seen.append(item)
        if len(seen) == 1:
            raise UserWarning("a worker stopped")
        plain(thread, item)

    monkeypatch.setattr(process_executor._ExecutorManagerThread, "process_result_item", failing_once)
    monkeypatch.setattr(LokyWorkers, "heartbeat_s", 0.5)
    found = outcomes([[1], [2]], Workers(jobs=1))
    assert [piece.value for number in (0, 1) for piece in found[number]] == [[1], [4]]


def test_a_worker_serves_the_next_run_unless_one_failed():
    def numbers():
        found = {}
        run_tasks(own_number, [0, 1], found.__setitem__)
        return {pieces[0].value for pieces in found.values()}

    first = numbers()
    assert len(first) == 1
    assert numbers() == first
    with pytest.raises(ZeroDivisionError):
        run_tasks(own_number, [0], lambda number, pieces: 1 / 0)
    assert numbers() != first


def threads(task):
    import numpy as np
    import threadpoolctl

    np.ones((4, 4)) @ np.ones((4, 4))
    return {pool["num_threads"] for pool in threadpoolctl.threadpool_info()}, os.environ["NUMBA_NUM_THREADS"]


def test_workers_compute_with_one_thread_whatever_the_environment_asks(monkeypatch):
    end_kept_workers()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        monkeypatch.setenv(name, "2")
    found = {}
    run_tasks(threads, {7: None}, found.__setitem__)
    assert found[7][0].value == ({1}, "1")


def pages(task):
    """Pages of memory that the system hands out for 64 arrays of a MiB."""
    import resource

    import numpy as np

    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    arrays = [np.ones(2**17) for _ in range(64)]
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before if arrays else 0


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other systems keep freed memory as they like")
def test_a_worker_keeps_the_memory_that_a_task_has_freed_for_the_next_one():
    found = {}
    run_tasks(pages, [0, 1, 2], found.__setitem__)
    assert max(found[number][0].value for number in (1, 2)) < 64 * 256 / 8


def test_an_error_in_the_caller_leaves_no_workers():
    import psutil

    with pytest.raises(ZeroDivisionError):
        run_tasks(square, chunks(40), lambda number, pieces: 1 / 0, Workers(jobs=2))
    assert not [child for child in psutil.Process().children() if "process_executor" in " ".join(child.cmdline())]


SCRIPT = """
import os, sys, time
from prb3r.runs.engine import run_tasks
from prb3r.runs.tasks import Workers

def slow(task):
    if task > 1:
        time.sleep(60)
    return os.getpid()

def show(number, pieces):
    print(pieces[0].value, flush=True)

try:
    run_tasks(slow, range(8), show, Workers(jobs=2))
except KeyboardInterrupt:
    sys.exit(130)
"""


def alive(pid):
    with contextlib.suppress(ProcessLookupError, FileNotFoundError):
        return "zombie" not in Path(f"/proc/{pid}/status").read_text()
    return False


@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for the workers in /proc")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_worker_outlives_its_parent_and_none_complains(number):
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as parent:
        guard = threading.Timer(30, parent.kill)
        guard.start()
        pids = {int(parent.stdout.readline()) for _ in range(2)}
        time.sleep(0.2)
        (os.killpg if number == signal.SIGINT else os.kill)(parent.pid, number)
        code = parent.wait(timeout=10)
        guard.cancel()
        deadline = time.monotonic() + 5
        while any(map(alive, pids)) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not any(map(alive, pids))
        assert code == (-signal.SIGKILL if number == signal.SIGKILL else 130)
        assert number == signal.SIGKILL or parent.stderr.read() == ""


def test_impossible_workers_are_refused_in_words(monkeypatch):
    with pytest.raises(EngineError, match="backend: unknown: 'daks'; did you mean 'dask'"):
        run_tasks(square, [[1]], print, Workers(backend="daks"))
    pytest.importorskip("distributed", reason="the dask backend needs the extra 'dask'")
    monkeypatch.setattr(dask_backend, "PATIENCE_S", 0.5)
    with pytest.raises(EngineError, match="needs the address of a running scheduler"):
        run_tasks(square, [[1]], print, Workers(backend="dask"))
    with pytest.raises(EngineError, match="no dask scheduler answers"):
        run_tasks(square, [[1]], print, Workers(backend="dask", scheduler="tcp://127.0.0.1:1"))
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(EngineError, match=r"pip install 'prb3r\[dask\]'"):
        run_tasks(square, [[1]], print, Workers(backend="dask"))


@pytest.fixture
def cluster():
    with local_cluster() as running:
        yield running


@pytest.mark.long
def test_dask_loses_only_the_guilty_and_refuses_other_sources(cluster, monkeypatch, tmp_path):
    tasks = chunks(24, 8)
    workers = Workers(backend="dask", scheduler=cluster.scheduler_address)
    found = {}
    with at_most(60):
        run_tasks(square, tasks, found.__setitem__, workers, single)
    assert_only_the_guilty_are_lost(found, tasks, "its worker died (2 times)")

    (tmp_path / "__init__.py").write_text("other = 1")
    monkeypatch.setattr("prb3r.__file__", str(tmp_path / "__init__.py"))
    with pytest.raises(
        EngineError, match=r"(?m)^tcp://.*imports prb3r \w+, this machine \w+; install the same version"
    ):
        run_tasks(square, tasks, found.__setitem__, workers)
