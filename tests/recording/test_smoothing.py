"""Tensions of a log without the noise of their readings: nearer to the true ones, and as they were where they turn."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import recorded
from recording.test_serial_noise import STEPS, log

from prb3r.recording.recording import Measurement
from prb3r.recording.smoothing import with_smooth_tensions

SCATTER = 0.004


def cells(seed=0, scatter=SCATTER, stated=SCATTER):
    """A log, its true tensions (s, 2), N: one pulled and let go, one held at 1 N; load cells scatter about them."""
    plain = log()
    pull = 10 * np.abs(((np.linspace(0, 5, STEPS) + 1) % 2) - 1)
    true = np.stack([pull, np.ones(STEPS)], 1)
    read = true * (1 + scatter * np.random.default_rng(seed).standard_normal(true.shape))
    columns = {f"cable_{name}_n": 0.0 for name in plain.manipulator.cable_names} | {
        "cable_1_n": read[:, 0],
        "cable_2_n": read[:, 1],
    }
    steps = plain.steps[["sequence", "step"]].assign(**columns)
    tension = np.zeros_like(plain.loads.tension)
    tension[:, :2] = read
    measured = Measurement(position_sd_m=3e-4, angle_sd_rad=5e-3, tension_sd_relative=stated)
    return replace(plain, steps=steps, loads=plain.loads._replace(tension=tension), measurement=measured), true


def test_smooth_tensions_are_nearer_to_the_true_ones():
    noisy, true = cells()
    smooth = with_smooth_tensions(noisy)
    before, after = (each.loads.tension[:, :2] - true for each in (noisy, smooth))
    assert np.std(after[:, 1]) < 0.6 * np.std(before[:, 1])
    assert np.std(after[:, 0]) < 0.8 * np.std(before[:, 0])
    assert np.abs(after).max() < 4 * SCATTER * 10
    assert "parabolas" in smooth.remarks[-1]
    for name, k in (("1", 0), ("2", 1)):
        assert np.array_equal(smooth.steps[f"cable_{name}_n"], smooth.loads.tension[:, k])


def test_exact_tensions_and_such_as_no_scatter_is_stated_of_stay_as_they_are():
    exact, true = cells(scatter=0.0)
    smooth = with_smooth_tensions(exact).loads.tension[:, :2]
    turns = 5e-3  # a stretch that holds a turning point by one step is not quite straight
    assert smooth == pytest.approx(true, abs=turns * 10)
    assert smooth[:, 1] == pytest.approx(true[:, 1], abs=1e-12)
    unknown, _ = cells(stated=0.0)
    assert with_smooth_tensions(unknown) is unknown


def test_weights_that_are_held_or_grow_evenly_are_no_log():
    noisy, _ = cells()
    tension = noisy.loads.tension.copy()
    tension[:, 0], tension[:, 1] = 7.3, 0.1 * np.arange(len(tension))
    steps = noisy.steps.assign(cable_1_n=tension[:, 0], cable_2_n=tension[:, 1])
    weights = replace(noisy, steps=steps, loads=noisy.loads._replace(tension=tension))
    assert with_smooth_tensions(weights) is weights


def test_what_is_more_than_the_stated_scatter_is_no_noise():
    """A load that wobbles by a per cent is a load that wobbles."""
    wobbling, _ = cells(scatter=0.01, stated=0.001)
    assert with_smooth_tensions(wobbling) is wobbling


def test_a_recording_in_steps_stays_as_it_is():
    assert with_smooth_tensions(recorded()) is recorded()
