"""Many load steps block by block: the same as at once, in memory that does not grow with their number."""

import tracemalloc
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from command import PROTOTYPE, prb3r

from prb3r.errors import SpecError
from prb3r.model import solve as solving
from prb3r.model.manipulator import load_manipulator
from prb3r.model.solve import solve, solve_in_blocks

RIG = load_manipulator(PROTOTYPE)


def steps(sequences, each=1):
    rng = np.random.default_rng(3)
    count = sequences * each
    return pd.DataFrame(
        {
            "sequence": np.repeat([f"s{k}" for k in range(sequences)], each),
            "step": np.tile(np.arange(1, each + 1), sequences),
            "cable_1_n": rng.uniform(0, 80, count),
            "cable_3_n": rng.uniform(0, 40, count),
        }
    )


@pytest.mark.parametrize("block", [1, 7, 64])
@pytest.mark.parametrize("friction", ["declared", "history"])
def test_blocks_below_one_another_are_the_whole_table(monkeypatch, block, friction):
    rig, table = RIG.replace("friction.direction", friction), steps(6, 4)
    whole = solve(rig, table, also=["lowest_eigenvalue_n_m_per_rad"])
    monkeypatch.setattr(solving, "BLOCK", block)
    blocks = solve_in_blocks(rig, table, also=["lowest_eigenvalue_n_m_per_rad"])
    parts = list(blocks)
    assert blocks.steps == 24
    assert pd.concat(parts, ignore_index=True).equals(whole)
    assert all(set(one["sequence"]).isdisjoint(other["sequence"]) for one, other in pairwise(parts))
    assert len(parts) == {1: 6, 7: 6, 64: 1}[block]


def test_the_memory_of_results_does_not_grow_with_the_steps(monkeypatch):
    monkeypatch.setattr(solving, "BLOCK", 128)
    peaks = []
    for count in (256, 2048):
        blocks = solve_in_blocks(RIG, steps(count))
        next(iter(blocks))
        tracemalloc.start()
        rows = sum(len(block) for block in blocks)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert rows == 15 * count
    assert peaks[1] < 1.3 * peaks[0]
    loads = blocks.table.loads  # nor do loads that the table does not name
    assert (loads.force.shape, loads.force.strides, loads.moment.strides) == ((2048, 14, 2), (0, 0, 0), (0, 0))


def test_every_problem_is_told_before_anything_is_solved():
    wrong = steps(3).assign(cable_9_n=1.0, cable_1_n=-5.0)
    with pytest.raises(SpecError) as refused:
        solve_in_blocks(RIG, wrong)
    assert len(refused.value.problems) == 2


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_the_command_writes_blocks_as_one_table_and_tells_how_far_it_is(tmp_path, monkeypatch, suffix):
    steps(5, 2).to_csv(tmp_path / "steps.csv", index=False)
    words = ("solve", PROTOTYPE, tmp_path / "steps.csv")
    at_once = prb3r(*words).stdout
    monkeypatch.setattr(solving, "BLOCK", 4)
    done = prb3r(*words, "-o", tmp_path / f"out.{suffix}")
    assert done.stdout == f"10 steps, 0 without a stable equilibrium, in {tmp_path / f'out.{suffix}'}\n"
    assert "solve: 10 of 10 steps in" in done.stderr
    read = pd.read_csv if suffix == "csv" else pd.read_parquet
    table = read(tmp_path / f"out.{suffix}")
    (tmp_path / "at-once.csv").write_text(at_once)
    pd.testing.assert_frame_equal(table, pd.read_csv(tmp_path / "at-once.csv"), check_dtype=False, rtol=1e-15)
    assert prb3r(*words).stdout == at_once


def test_the_command_tells_how_many_steps_of_all_blocks_have_no_stable_equilibrium(tmp_path, monkeypatch):
    steps(5, 2).assign(tip_x_n=[-1e3, *[0.0] * 8, -1e3]).to_csv(tmp_path / "steps.csv", index=False)
    monkeypatch.setattr(solving, "BLOCK", 4)
    done = prb3r("solve", PROTOTYPE, tmp_path / "steps.csv", "-o", tmp_path / "out.csv")
    tips = pd.read_csv(tmp_path / "out.csv").query("disk == 14")
    failed = (~tips["outcome"].isin(["converged", "detour"])).sum()
    assert done.returncode == 1
    assert done.stdout.startswith(f"10 steps, {failed} without a stable equilibrium")
    assert f" s, {failed} failed" in done.stderr
    assert failed >= tips["x_m"].isna().sum() > 0


@pytest.mark.parametrize(
    ("place", "said"),
    [("none/out.csv", "there is no folder"), ("out.txt", "a .csv or a .parquet file"), ("taken.csv", "is a folder")],
)
def test_a_place_that_takes_no_table_is_refused_before_anything_is_solved(tmp_path, monkeypatch, place, said):
    (tmp_path / "taken.csv").mkdir()
    monkeypatch.setattr(solving, "_solved", lambda *_: pytest.fail("solved"))
    steps(1).to_csv(tmp_path / "steps.csv", index=False)
    done = prb3r("solve", PROTOTYPE, tmp_path / "steps.csv", "-o", tmp_path / place)
    assert done.returncode == 2
    assert said in done.stderr
