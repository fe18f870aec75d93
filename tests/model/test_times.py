"""Steps that say when they were taken: what drifts goes with the clock."""

import shutil

import numpy as np
import pandas as pd
import pytest

import prb3r
from prb3r.errors import SpecError
from prb3r.model.steps import elapsed_steps

TWO = "studies/manipulators/two-segment.toml"
PULLS = {"sequence": ["a"] * 3 + ["b"] * 2, "step": [1, 2, 3, 1, 2], "cable_1_n": [20.0, 40.0, 60.0, 30.0, 50.0]}


def drifting(per_step=2.0):
    plain = prb3r.load_manipulator(TWO)
    drift = {"kind": "tension_drift", "offset_n_per_step": per_step, "cables": ["1"]}
    return prb3r.Manipulator.model_validate(plain.model_dump(exclude_none=True) | {"effect": [drift]})


def tips(manipulator, **columns):
    table = prb3r.solve(manipulator, PULLS | columns)
    return table[table["disk"] == table["disk"].max()][["x_m", "y_m", "angle_rad"]].to_numpy()


def test_even_times_are_as_none():
    assert np.array_equal(tips(drifting()), tips(drifting(), time_s=[10.0, 12.0, 14.0, 16.0, 18.0]))


def test_a_zero_drifts_by_the_clock_through_sequences_in_any_order():
    """Sequence b was pulled first, and a after a break; 40 s in four steps, so that 2 N a step are 0.2 N a second."""
    time = np.array([20.0, 21.0, 40.0, 0.0, 5.0])
    by_hand = np.array(PULLS["cable_1_n"]) + 0.2 * time
    assert tips(drifting(), time_s=time) == pytest.approx(tips(TWO, cable_1_n=by_hand), abs=1e-12)


def test_nothing_drifts_where_nothing_does():
    assert np.array_equal(tips(TWO), tips(TWO, time_s=[0.0, 1.0, 7.0, 9.0, 9.5]))


def test_the_camera_moves_by_the_clock():
    plain = prb3r.load_manipulator(TWO).model_dump(exclude_none=True)
    moving = plain | {"effect": [{"kind": "camera_drift", "y_m_per_step": 0.001}]}
    loads = PULLS | {"time_s": [0.0, 1.0, 2.0, 7.0, 8.0]}
    seen = [prb3r.solve(manipulator, loads, as_measured=True) for manipulator in (moving, plain)]
    away = (seen[0]["y_m"] - seen[1]["y_m"]).to_numpy().reshape(5, -1)
    assert away == pytest.approx(np.tile(0.0005 * np.array(loads["time_s"])[:, None], away.shape[1]), abs=1e-15)


def test_a_step_is_as_long_as_one_is_in_the_mean():
    assert elapsed_steps(np.array([5.0, 6.0, 11.0])).tolist() == pytest.approx([0.0, 1 / 3, 2.0])
    assert elapsed_steps(np.array([7.0])).tolist() == [0.0]


@pytest.mark.parametrize(
    ("times", "said"),
    [
        ([0.0, 2.0, 1.0, 5.0, 6.0], "sequence a: step 3 is not later than the one before it (row 3); times grow"),
        ([0.0, 2.0, 2.0, 5.0, 6.0], "sequence a: step 3 is not later"),
        ([0.0, 1.0, 2.0, 0.0, 1.0], "overlap: times are of one clock"),
        ([0.0, 1.0, None, 3.0, 4.0], "row 3: empty; leave the whole column out"),
        ([0.0, 1.0, np.inf, 3.0, 4.0], "row 3 is infinite"),
        ([0.0, "noon", 2.0, 3.0, 4.0], "row 2 holds 'noon', not a number"),
    ],
)
def test_times_that_cannot_be_meant_are_refused(times, said):
    with pytest.raises(SpecError, match="column time_s") as refused:
        prb3r.solve(TWO, pd.DataFrame(PULLS | {"time_s": times}))
    assert said in str(refused.value)


def test_a_recording_goes_by_its_clock(tmp_path):
    """The sequences in the opposite order of the table; of a part of the recording the clock stays."""
    folder = tmp_path / "example"
    shutil.copytree("studies/recordings/bench-example", folder)
    steps = pd.read_csv(folder / "steps.csv")
    count = len(steps)
    backward = steps["sequence"].map({name: -k for k, name in enumerate(steps["sequence"].unique())})
    steps["time_s"] = 30.0 * (1000 * backward + steps["step"])
    steps.to_csv(folder / "steps.csv", index=False)
    recording = prb3r.load_recording(folder)
    elapsed = recording.loads.elapsed[:, 0]
    assert elapsed.min() == 0
    assert elapsed.max() == pytest.approx(count - 1)
    last = len(recording.sequences) - 1
    assert elapsed[recording.of_sequence == last].max() < elapsed[recording.of_sequence == 0].min()
    assert np.array_equal(recording.only([0]).loads.elapsed[:, 0], elapsed[recording.of_sequence == 0])
