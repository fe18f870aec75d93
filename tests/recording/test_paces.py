"""What the times of steps say, and doubts about their unit."""

import re

import numpy as np
import pytest

from prb3r.check import check_file
from prb3r.quantities import duration
from tests.recording.dirty import Bench


@pytest.fixture
def bench(tmp_path):
    """Sequences of steps that take 20 s each, with a break of a minute between them."""
    bench = Bench(tmp_path)
    bench.steps["time_s"] = [0.0, 20, 40, 100, 120, 140]
    return bench


def test_it_is_told_how_long_a_recording_took_and_how_fast_its_steps_followed(bench):
    told = check_file(bench.write())
    assert "its times (time_s) span 2.33 min, 20 s from one step to the next (median)" in told
    assert "are times in" not in told


def test_nothing_is_told_of_times_that_are_not_there(bench):
    bench.steps = bench.steps.drop(columns="time_s")
    assert "time" not in check_file(bench.write())


@pytest.mark.parametrize(
    ("times", "asked"),
    [(1000, ["milliseconds"]), (1 / 86400, ["hours or days"]), (60, []), (1e-3, [])],
)
def test_times_that_nobody_takes_are_doubted(bench, times, asked):
    """Sixty times as slow is creep that is watched for hours, a thousandth is what a drive logs 50 times a second."""
    bench.steps["time_s"] *= times
    assert re.findall(r"are times in (.*)\?", check_file(bench.write())) == asked


def test_the_pace_is_that_of_the_table_as_read(bench):
    recording = bench.load()
    assert recording.at_steps(np.array([0, 2, 3, 5])).pace_s == recording.pace_s == 20.0


def test_times_are_told_in_the_unit_in_which_people_say_them():
    said = ["5 ms", "0.5 s", "45 s", "12 min", "5.56 h", "21.8 days"]
    assert [duration(each) for each in (0.005, 0.5, 45.0, 720.0, 2e4, 1.88e6)] == said
