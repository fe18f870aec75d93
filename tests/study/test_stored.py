"""Workers put tables on the disk that all see; what comes back of a task is a number of rows, and the bytes are the
same."""

import pickle

import numpy as np
import pytest
from command import PROTOTYPE
from local_cluster import at_most, local_cluster

from prb3r.errors import EngineError
from prb3r.runs.parts import Parts
from prb3r.runs.tasks import Workers
from prb3r.study import compute, workspace
from prb3r.study.plan import plan_study
from prb3r.study.run import Options, solve_study
from prb3r.study.stored import Storage, Stored, StoredTask, fetched_loads, solve_and_store, storage

GRID = f"""
name = "trial"
title = "A trial"
manipulator = "{PROTOTYPE}"
states = "path"
chunk = 8
step = [{{ cable_1_n = 1, cable_3_n = 1 }}, {{ cable_3_n = 1e7 }}, {{ cable_3_n = 5 }}]
metric = [{{ kind = "position" }}]
[[factor]]
name = "one_n"
path = "step.1.cable_1_n"
linspace = {{ from = 1, to = 100, count = 40 }}
"""
CLOUD = f"""
name = "trial"
title = "A trial"
manipulator = "{PROTOTYPE}"
states = "path"
state_disks = [14]
metric = [{{ kind = "workspace" }}]
[cloud]
count = 1000
tension_n = {{ 1 = 100.0, 3 = 60.0 }}
"""


@pytest.fixture
def spec(tmp_path, monkeypatch):
    monkeypatch.setattr(workspace, "MOST_DISKS", 15 * 256)  # in this process; the blocks are cut here

    def write(text):
        (tmp_path / "trial.toml").write_text(text)
        return tmp_path / "trial.toml"

    return write


def tables(folder):
    return {name: (folder / f"trial/{name}.parquet").read_bytes() for name in ("cases", "states")}


def returned(monkeypatch):
    """What comes back of the tasks of the runs that follow, by its size when it is sent."""
    sizes, take = [], compute._Keeper.__call__

    def taken(self, number, pieces):
        sizes.extend(len(pickle.dumps(piece.value)) for piece in pieces)
        take(self, number, pieces)

    monkeypatch.setattr(compute._Keeper, "__call__", taken)
    return sizes


@pytest.mark.parametrize(("text", "tasks"), [(GRID, 5), (CLOUD, 4)], ids=["grid", "cloud"])
def test_of_two_workers_only_small_records_come_back(spec, tmp_path, monkeypatch, text, tasks):
    solve_study(spec(text), Options(tmp_path / "one"))
    sizes = returned(monkeypatch)
    solve_study(spec(text), Options(tmp_path / "two", Workers(jobs=2)))
    assert len(sizes) == tasks
    assert max(sizes) < 200
    assert tables(tmp_path / "two") == tables(tmp_path / "one")
    left = {path.suffix for path in (tmp_path / "two/trial/.parts").iterdir()}
    assert left == {".cases", ".states"}


@pytest.mark.long
def test_through_a_scheduler_pass_small_records_alone(spec, tmp_path, monkeypatch):
    texts = {"grid": GRID, "cloud": CLOUD}
    for name, text in texts.items():
        solve_study(spec(text), Options(tmp_path / name))
    sizes = returned(monkeypatch)
    with local_cluster(workers=1) as cluster, at_most(120):
        workers = Workers(backend="dask", scheduler=cluster.scheduler_address)
        for name, text in texts.items():
            solve_study(spec(text), Options(tmp_path / f"dask {name}", workers))
    assert len(sizes) == 9
    assert max(sizes) < 200
    assert all(tables(tmp_path / f"dask {name}") == tables(tmp_path / name) for name in texts)


@pytest.fixture
def task(spec, tmp_path):
    """A task of the grid whose worker is this process, and the parts that it adds to."""
    plan = plan_study(spec(GRID), tmp_path / "out")
    parts = Parts(plan.folder)
    parts.ready()
    (chunk, *_) = plan.chunks(plan.missing(parts))
    items = compute.item_columns(plan, chunk)

    def made(place):
        return StoredTask(chunk, place, plan.keys[chunk.numbers], items, plan.states_item)

    return made, parts, plan


def test_who_does_not_see_the_folder_hands_tables_over(task, tmp_path):
    made, parts, plan = task
    with storage(parts.home) as place:
        told = solve_and_store(made(place))
        assert isinstance(told, Stored)
        elsewhere = tmp_path / "elsewhere"
        elsewhere.mkdir()
        cases, states = solve_and_store(made(Storage(elsewhere, place.mark)))
        assert list(elsewhere.iterdir()) == []
        parts.take(made(place).part)
    assert told.rows == len(states["x_m"]) > 0
    assert told.failed == (cases["outcome"] != "converged").sum() > 0
    outcome, position, _ = parts.places(plan.items, plan.keys[cases["case_id"]])
    assert outcome.column("outcome").tolist() == cases["outcome"].tolist()
    assert np.array_equal(position.column("tip_y_m"), cases["tip_y_m"], equal_nan=True)
    assert not list(parts.home.glob("*.tmp"))


def test_who_sees_the_folder_but_cannot_write_there_hands_tables_over(task, monkeypatch):
    made, parts, _ = task

    def full(*_):
        raise EngineError

    monkeypatch.setattr("prb3r.study.stored.write_part", full)
    with storage(parts.home) as place:
        cases, _ = solve_and_store(made(place))
    assert len(cases["case_id"]) == 8


def test_a_part_of_a_worker_whose_run_died_counts_in_the_next(task):
    made, parts, plan = task
    with storage(parts.home) as place:
        solve_and_store(made(place))
    known = ~plan.missing(Parts(plan.folder))
    assert known[made(place).numbers].all()
    assert known.sum() == known[made(place).numbers].size


def test_what_was_damaged_on_the_way_is_told(task):
    made, parts, _ = task
    with storage(parts.home) as place:
        assert solve_and_store(made(place)).rows > 0
        (parts.home / f"{made(place).part}.cases").write_bytes(b"x")
        with pytest.raises(EngineError, match="what workers have written there is gone or damaged"):
            parts.take(made(place).part)
        with pytest.raises(EngineError, match="what workers have written there is gone or damaged"):
            fetched_loads(made(place))
