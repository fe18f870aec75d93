"""A cloud that is stopped half-way goes on from the blocks that it has, and comes to the same."""

import numpy as np
import pandas as pd
import pytest
from command import PROTOTYPE
from in_process import InProcess

from prb3r.runs import pending
from prb3r.runs.engine import BACKENDS
from prb3r.study import workspace
from prb3r.study.plan import Silent
from prb3r.study.run import Options, solve_study

BLOCKS, SIZE = 8, 256
SPEC = f"""
name = "cloud"
title = "A cloud"
manipulator = "{PROTOTYPE}"
states = "path"
state_disks = [14]
[cloud]
count = {BLOCKS * SIZE - 48}
tension_n = {{ 1 = 100.0, 3 = 60.0 }}
[[metric]]
kind = "workspace"
"""


class Stopped(Silent):
    """A listener that stops a run after some loads, and remembers what it heard."""

    def __init__(self, loads=10**9):
        self.left, self.stored, self.solved = loads, None, 0

    def begin(self, name, cases, done, what="cases"):
        self.stored = done

    def advance(self, cases, failed):
        self.solved += cases
        self.left -= cases
        if self.left < 0:
            raise KeyboardInterrupt


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setattr(workspace, "MOST_DISKS", 15 * SIZE)
    monkeypatch.setitem(BACKENDS, "loky", InProcess)  # each stop would end the workers, and new ones load all anew

    def solve(out, heard, text=SPEC):
        path = tmp_path / "cloud.toml"
        path.write_text(text)
        return solve_study(path, Options(tmp_path / out), heard)

    return solve


@pytest.mark.parametrize("kept", ["path", "final", "none"])
def test_a_cloud_goes_on_from_its_blocks_and_ends_with_the_same_bytes(run, tmp_path, kept):
    text = SPEC.replace('"path"', f'"{kept}"')
    if kept == "none":
        text = text.replace("state_disks = [14]\n", "")
    whole = run("whole", Silent(), text)
    with pytest.raises(KeyboardInterrupt):
        run("cut", Stopped(3 * SIZE), text)
    assert len(list(tmp_path.glob("cut/cloud/.parts/*.pending"))) == 4
    heard = Stopped()
    cut = run("cut", heard, text)
    assert (heard.stored, heard.solved) == (4 * SIZE, 4 * SIZE - 48)
    for name in ["cases.parquet", *(["states.parquet"] if kept != "none" else [])]:
        assert (cut.folder / name).read_bytes() == (whole.folder / name).read_bytes()
    assert not list(tmp_path.glob("cut/cloud/.parts/*.pending"))
    assert run("cut", heard, text).computed == 0


def test_a_damaged_block_or_one_without_its_states_is_solved_again(run, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        run("out", Stopped(3 * SIZE))
    home = tmp_path / "out/cloud/.parts"
    (some, other) = sorted(home.glob("*.pending"))[:2]
    content = bytearray(some.read_bytes())
    content[-400] ^= 1
    some.write_bytes(content)
    number = int(other.stem.rpartition("-")[2])
    stem = other.stem.rpartition("-")[0]
    pending.block_path(home, stem, number).unlink()
    heard = Stopped()
    result = run("out", heard)
    assert heard.stored == 2 * SIZE
    assert result.states().equals(run("whole", Silent()).states())


def test_a_run_that_died_before_its_case_was_kept_needs_no_block_again(run, monkeypatch):
    from prb3r.study import compute

    keep = compute.keep_columns
    monkeypatch.setattr(compute, "keep_columns", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        run("out", Silent())
    monkeypatch.setattr(compute, "keep_columns", keep)
    heard = Stopped()
    assert run("out", heard).failed == 0
    assert heard.solved == 0


ALIKE = """
[[factor]]
name = "pull"
[[factor.level]]
label = "as it is"
[[factor.level]]
label = "the same"
set = { "cloud.tension_n" = { 1 = 100.0, 3 = 60.0 } }
[[factor.level]]
label = "less"
set = { "cloud.tension_n" = { 1 = 90.0, 3 = 60.0 } }
"""


def test_cases_that_differ_in_their_labels_alone_are_computed_once(run, tmp_path):
    """Their blocks have the same names: the first case to end took away what workers had written for the second."""
    whole, heard = run("whole", Silent()), Stopped()
    three = run("three", heard, SPEC + ALIKE)
    count = BLOCKS * SIZE - 48
    assert (heard.stored, heard.solved, three.computed) == (count, 2 * count, 3)
    cases = pd.read_parquet(three.folder / "cases.parquet").set_index("pull")["workspace_area_m2"]
    (area,) = pd.read_parquet(whole.folder / "cases.parquet")["workspace_area_m2"]
    assert cases["as it is"] == cases["the same"] == area > cases["less"]
    states = pd.read_parquet(three.folder / "states.parquet")
    of_case = [states[states.case_id == number].drop(columns="case_id").to_numpy() for number in range(3)]
    assert np.array_equal(of_case[0], of_case[1])
    assert not np.array_equal(of_case[0], of_case[2])
    assert run("three", Stopped(), SPEC + ALIKE).computed == 0
