"""What is done aside comes back in order, keeps what it holds until it is done, and ends with what began it."""

import contextlib
import os
import signal
import threading
import time

import pytest

from prb3r.errors import EngineError, Problem, SpecError
from prb3r.runs.backends.aside import Aside
from prb3r.runs.backends.loky import end_workers, new_worker


def work(task):
    kind, value = task
    if kind == "refuse":
        raise SpecError(Problem("here", value))
    if kind == "die":
        os._exit(3)
    if kind == "sleep":
        time.sleep(value)
    if kind == "write":
        time.sleep(0.5)
        value.touch()
    return value, os.getpid()


def holding(events, name):
    held = contextlib.ExitStack()
    held.callback(events.append, name)
    return held


def run_aside(tasks, events, end=None, apart=True):
    """Begin with tasks, end the context by the error `end` if there is one; what came back."""
    with Aside(work, apart) as aside:
        for task in tasks:
            aside.begin(task, holding(events, task[1]))
        if end is not None:
            raise end
    return aside.done


@pytest.mark.parametrize("apart", [False, True])
def test_things_come_back_in_their_order_from_one_process(apart):
    events = []
    values, processes = zip(*run_aside([("say", name) for name in "abc"], events, apart=apart), strict=True)
    assert values == tuple("abc")
    assert events == list("abc")
    assert len(set(processes)) == 1
    assert (os.getpid() in processes) is not apart


def test_what_is_held_is_held_until_the_function_has_ended_while_this_process_goes_on():
    events = []
    with Aside(work, apart=True) as aside:
        aside.begin(("sleep", 0.5), holding(events, "let go"))
        assert not events
        assert not aside.done
    assert events == ["let go"]
    assert aside.done[0][0] == 0.5


@pytest.mark.parametrize("apart", [False, True])
def test_the_earliest_error_is_the_one_that_is_raised_and_nothing_stays_held(apart):
    events = []
    later = EngineError(Problem("there", "later"))
    with pytest.raises(SpecError) as refused:
        run_aside([("refuse", "first"), ("refuse", "second")], events, later, apart)
    assert refused.value.problems == (Problem("here", "first"),)
    assert events[0] == "first"
    assert set(events) <= {"first", "second"}


def test_an_error_beside_it_waits_for_what_is_under_way(tmp_path):
    events, written = [], tmp_path / "written"
    with pytest.raises(EngineError, match="is full"):
        run_aside([("write", written)], events, EngineError(Problem("disk", "is full")))
    assert written.exists()
    assert events == [written]


def test_an_interrupt_waits_for_nothing(tmp_path):
    events, started = [], time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        run_aside([("sleep", 120.0), ("write", tmp_path / "never")], events, KeyboardInterrupt())
    assert time.monotonic() - started < 60
    assert len(events) == 2
    assert not list(tmp_path.iterdir())


def test_a_process_that_dies_is_told():
    events = []
    with pytest.raises(EngineError, match="died"):
        run_aside([("die", None)], events)
    assert events == [None]


def test_a_process_that_is_killed_with_nothing_to_do_is_replaced():
    events = []
    with Aside(work, apart=True) as aside:
        aside.begin(("say", "a"), holding(events, "a"))
        future, _ = aside.under_way[0]
        os.kill(future.result(timeout=60)[1], signal.SIGTERM)
        aside.worker._executor_manager_thread.join(timeout=60)  # it has noticed
        aside.begin(("say", "b"), holding(events, "b"))
    (first, before), (second, after) = aside.done
    assert (first, second, events) == ("a", "b", ["a", "b"])
    assert before != after


def test_a_worker_is_ended_before_it_has_looked_at_what_waits_for_it(monkeypatch):
    """Otherwise its thread would print a traceback now and then."""
    raised = []
    monkeypatch.setattr(threading, "excepthook", raised.append)
    worker = new_worker()
    worker.submit(work, ("sleep", 60.0))
    with monkeypatch.context() as asleep:
        asleep.setattr(worker._executor_manager_thread_wakeup, "wakeup", lambda: None)
        worker.submit(work, ("sleep", 60.0))
    end_workers([worker])
    assert not raised
