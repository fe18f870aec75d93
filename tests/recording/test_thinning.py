"""Fewer steps of a log: the path of the loads is kept, and every step that is kept is as it was."""

import numpy as np
import pytest
from diagnosis.simulated import recorded

from prb3r.recording.thinning import path_of, steps_of_path, thinned


def loops(steps=400, cables=2, noise=0.0, seed=0):
    """(s, l) loads of two cables that are pulled and let go, ever further, at a steady rate."""
    corners = np.array([[0, 0], [3, 0], [0, 0], [0, 5], [0, 1], [0, 7], [8, 0], [0, 0]], float)[:, :cables]
    at = np.linspace(0, len(corners) - 1, steps)
    path = np.stack([np.interp(at, np.arange(len(corners)), column) for column in corners.T], 1)
    return path + noise * np.random.default_rng(seed).standard_normal(path.shape)


@pytest.mark.parametrize(("noise", "passes"), [(0.0, 0.07), (0.02, 0.15)])
def test_straight_lines_between_the_steps_that_are_kept_pass_all_loads(noise, passes):
    """With half of 40 steps there are more of these than corners; the others are spread evenly."""
    path = loops(noise=noise)
    kept = steps_of_path(path, 40)
    assert len(kept) == len(set(kept.tolist())) == 40
    assert (kept[0], kept[-1]) == (0, len(path) - 1)
    between = np.stack([np.interp(np.arange(len(path)), kept, column[kept]) for column in path.T], 1)
    assert np.abs(between - path).max() < passes
    assert np.diff(kept).max() <= 3 * len(path) / 40


def test_every_turning_point_of_a_loop_is_kept():
    path = np.concatenate([np.linspace(0, 10, 101), np.linspace(10, 4, 61)[1:], np.linspace(4, 9, 51)[1:]])[:, None]
    assert {0, 100, 160, 210} <= set(steps_of_path(path, 20).tolist())


def test_a_path_that_is_held_keeps_steps_all_along():
    kept = steps_of_path(np.ones((100, 3)), 10)
    assert len(kept) == 10
    assert np.diff(kept).max() <= 25


def test_a_recording_with_few_steps_is_as_it_is():
    recording = recorded()
    assert thinned(recording, len(recording.steps), 1) is recording
    assert thinned(recording, 1, 100) is recording  # no sequence has so many


def test_steps_that_are_kept_are_as_they_were_and_it_is_said():
    recording = recorded()
    fewer = thinned(recording, 10, 2)
    assert fewer.sequences == recording.sequences
    names = [list(zip(each.steps["sequence"], each.steps["step"], strict=True)) for each in (recording, fewer)]
    rows = [names[0].index(name) for name in names[1]]
    assert len(rows) == 10
    assert rows == sorted(rows)
    for whole, part in zip(recording.loads, fewer.loads, strict=True):
        assert np.array_equal(whole[rows], part)
    table = {(recording.of_sequence[s], names[0][s], d, k): v for s, d, k, v in zip(*recording.readings, strict=True)}
    for s, d, k, v in zip(*fewer.readings, strict=True):
        assert table[fewer.of_sequence[s], names[1][s], d, k] == v
    assert fewer.readings.count == np.isin(recording.readings.step, rows).sum()
    assert f"of {len(recording.steps)} steps 10 are used" in fewer.remarks[-1]


def test_loads_that_never_change_are_no_part_of_the_path():
    recording = recorded()
    path = path_of(recording)
    assert path.shape == (len(recording.steps), 4)
    assert np.ptp(path, axis=0) == pytest.approx(1.0)
