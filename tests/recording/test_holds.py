"""Readings that move on while loads are held."""

from dataclasses import replace

import numpy as np
import pytest

from prb3r.recording.holds import creeping
from prb3r.recording.recording import Recording
from tests.diagnosis.simulated import Case, recorded

LOADED, HOLD = 4, 3
"""Load steps of each sequence, and readings under each load."""


def held(creep: float, seed: int = 0) -> Recording:
    """A recording whose every load is held for three readings, during which readings go on by a share `creep` of what
    the load moved them, with noise of their stated standard deviations."""
    recording, rng = recorded(Case(hidden=())), np.random.default_rng(seed)
    disk, kind = np.array([1, 2, 3] * 2), np.repeat([0, 1], 3)
    sequences, steps, loads, values = [], [], [], []
    for sequence in range(3):
        for load in range(1, LOADED + 1):
            for age in range(HOLD):
                sequences.append(sequence)
                loads.append(5.0 * load * (1 + 1e-4 * age))
                moved = 4e-3 * disk * (load + creep * age)
                values.append(moved + recording.measurement.position_sd_m * rng.standard_normal(len(disk)))
                steps.append(len(steps))
    count, chosen = len(steps), np.zeros(len(steps), int)
    tension = np.outer(loads, [1.0] + [0.0] * (recording.loads.tension.shape[1] - 1))
    held_loads = recording.loads._replace(
        tension=tension,
        force=recording.loads.force[chosen],
        tip=recording.loads.tip[chosen],
        slip=recording.loads.slip[chosen],
    )
    readings = recording.readings._replace(
        step=np.repeat(steps, len(disk)),
        disk=np.tile(disk, count),
        kind=np.tile(kind, count),
        value=np.concatenate(values),
    )
    return replace(recording, of_sequence=np.array(sequences), loads=held_loads, readings=readings)


def test_an_arm_that_creeps_is_said_to_with_its_share():
    (doubt,) = creeping(held(creep=0.1))
    assert "at 9 holds by 2" in doubt  # two times 10 % in each hold; the first loads follow on no reading
    assert "moved them" in doubt


@pytest.mark.parametrize("creep", [0.0, -0.1])
def test_noise_or_a_motion_back_is_no_creep(creep):
    assert [list(creeping(held(creep, seed))) for seed in range(20)] == [[]] * 20


def test_where_no_load_is_held_nothing_is_said():
    assert list(creeping(recorded(Case(hidden=())))) == []
