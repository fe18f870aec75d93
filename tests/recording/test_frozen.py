"""Readings that stay the same while loads change."""

from dataclasses import replace

import numpy as np
import pytest

from prb3r.recording.frozen import frozen
from tests.diagnosis.simulated import Case, recorded


def with_copies(*steps):
    """A recording whose rows `steps` have the readings of the row before."""
    recording = recorded(Case(hidden=()))
    value, of_step = recording.readings.value.copy(), recording.readings.step
    for step in steps:
        value[of_step == step] = value[of_step == step - 1]
    return recording.with_values(value)


def test_pictures_that_were_read_twice_are_told_with_their_steps():
    """Rows 1 to 3 are steps 2 to 4 of the first sequence, row 6 is step 3 of the second."""
    first, second = frozen(with_copies(2, 3, 6))
    assert first.startswith("sequence out: steps 3 and 4 have the readings of the step before to the last digit")
    assert second.startswith("sequence down: step 3 has the readings")


@pytest.mark.parametrize("why", ["noise", "begins", "held"])
def test_what_differs_begins_or_is_held_is_no_copy(why):
    recording = with_copies(*{"noise": [], "begins": [4], "held": [2]}[why])
    if why == "held":
        tension = recording.loads.tension.copy()
        tension[2] = 1.01 * tension[1]
        recording = replace(recording, loads=recording.loads._replace(tension=tension))
    assert list(frozen(recording)) == []


def test_an_arm_that_nothing_moves_is_no_copy():
    recording = with_copies(2)
    assert list(frozen(recording.with_values(np.zeros(recording.readings.count)))) == []
