"""Tables in, tables out: many sequences at once are what they are alone, and columns mean what they say."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import prb3r
from prb3r.errors import SpecError
from prb3r.model import solve as module
from prb3r.model.manipulator import Manipulator

MANIPULATORS = Path(__file__).parents[2] / "studies/manipulators"
WRIST = prb3r.load_manipulator(MANIPULATORS / "two-segment.toml")
LAW = {"kind": "empirical_moment", "terms": [{"of": "tension", "coefficient": 0.02}]}


def table(sequences: int, steps: int, **columns) -> pd.DataFrame:
    rng = np.random.default_rng(5)
    pulls = {f"cable_{k}_n": np.maximum(rng.uniform(-40, 40, sequences * steps), 0) for k in (1, 2, 3, 4)}
    names = np.repeat([f"s{k}" for k in range(sequences)], steps)
    frame = pd.DataFrame({"sequence": names, "step": np.tile(np.arange(1, steps + 1), sequences), **pulls, **columns})
    return frame.sample(frac=1.0, random_state=1)


def with_(**changes) -> Manipulator:
    return Manipulator.model_validate(WRIST.model_dump(exclude_none=True) | changes)


@pytest.mark.parametrize(
    ("manipulator", "loads"),
    [
        (WRIST, {}),
        (WRIST, {"tip_y_n": 0.5}),
        (with_(friction={"coefficient": 0.3, "direction": "history"}), {}),
        (with_(effect=[LAW]), {}),
        (with_(model="constant-curvature"), {}),
    ],
)
def test_many_sequences_at_once_are_to_the_bit_what_each_is_alone(manipulator, loads, monkeypatch):
    monkeypatch.setattr(module, "BLOCK", 7)
    steps = table(5, 3, **loads)
    together = prb3r.solve(manipulator, steps, also=["stress_pa", "lowest_eigenvalue_n_m_per_rad"])
    alone = [
        prb3r.solve(manipulator, rows, also=["stress_pa", "lowest_eigenvalue_n_m_per_rad"])
        for _, rows in steps.groupby("sequence", sort=False)
    ]
    pd.testing.assert_frame_equal(together, pd.concat(alone, ignore_index=True), check_exact=True)
    assert (together["outcome"] == "converged").all()


def test_the_number_of_solves_does_not_grow_with_the_number_of_sequences(monkeypatch):
    calls = []
    solver = module.equilibria_of
    monkeypatch.setattr(module, "equilibria_of", lambda *a, **k: calls.append(1) or solver(*a, **k))
    prb3r.solve(WRIST, table(300, 1))
    assert len(calls) == 1


def test_columns_and_files_are_as_good_as_a_frame(tmp_path):
    steps = table(4, 2).sort_values(["sequence", "step"])
    steps.to_csv(tmp_path / "steps.csv", index=False)
    expected = prb3r.solve(WRIST, steps)
    columns = {name: steps[name].to_numpy() for name in steps}
    pd.testing.assert_frame_equal(prb3r.solve(WRIST, columns), expected)
    pd.testing.assert_frame_equal(prb3r.solve(WRIST, tmp_path / "steps.csv"), expected)
    one = prb3r.solve(WRIST, {"sequence": ["a"], "step": [1], "cable_1_n": 20.0})
    assert one["cable_1_n"].iloc[0] == 20.0
    with pytest.raises(SpecError, match="is no table of steps: All arrays must be of the same length"):
        prb3r.solve(WRIST, {"sequence": ["a", "b"], "step": [1], "cable_1_n": [20.0]})


def test_tensions_fall_along_the_cable_by_friction_alone():
    steps = {"sequence": ["a"], "step": [1], "cable_1_n": [30.0], "cable_4_n": [10.0]}
    free = prb3r.solve(with_(friction={}), steps)
    assert free["cable_1_n"].to_numpy() == pytest.approx(np.full(15, 30.0))
    rubbing = prb3r.solve(with_(friction={"coefficient": 0.3}), steps)["cable_1_n"].to_numpy()
    assert rubbing[0] == 30.0
    assert (np.diff(rubbing) < 0).all()
    impossible = prb3r.solve(WRIST, {"sequence": ["a"], "step": [1], "cable_1_n": [1e6]})
    assert (impossible["outcome"] == "no equilibrium").all()
    assert impossible["cable_1_n"].iloc[0] == 1e6
    assert impossible["cable_1_n"].iloc[1:].isna().all()


def test_the_stress_of_a_gently_pulled_plate_is_that_of_a_beam_under_tension_times_lever():
    pull = 0.5
    steps = {"sequence": ["a"], "step": [1], "cable_1_n": [pull]}
    frame = prb3r.solve(with_(friction={}), steps, also=["stress_pa"])
    segment, lever = WRIST.segment[0], abs(WRIST.cable[0].offset(0))
    expected = 6 * pull * lever / (segment.width_m * segment.thickness_m**2)
    assert frame["stress_pa"].iloc[1:].to_numpy() == pytest.approx(np.full(14, expected), rel=1e-3)
    assert np.isnan(frame["stress_pa"].iloc[0])


def test_tensions_are_as_applied_at_the_base_and_those_of_the_plate_that_ends_there_at_other_disks():
    rig = with_(friction={"coefficient": 0.0}, effect=[{"kind": "pulley_friction", "efficiency": 0.5}])
    tension = prb3r.solve(rig, {"sequence": ["a"], "step": [1], "cable_1_n": [30.0]})["cable_1_n"].to_numpy()
    assert tension[0] == 30.0
    assert tension[1:] == pytest.approx(np.full(14, 15.0))
