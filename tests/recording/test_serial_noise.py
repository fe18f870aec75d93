"""Noise that lasts from one reading of a log to the next: told by stretches of it, whatever bends the arm."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import recorded

from prb3r.diagnosis.fit.covariance import NoiseLevel, as_stated, noise_correlation
from prb3r.mechanics.chain import Loads
from prb3r.recording.recording import NO_SERIAL_NOISE, Readings, SerialNoise
from prb3r.recording.serial_noise import serial_noise
from prb3r.recording.thinning import thinned

STEPS, DISKS = 600, 3


def log(correlation=0.0, seed=0, corners=5, bend=0.05, outliers=0):
    """A log of one cable that is pulled and let go; two kinds of readings of three disks go with its tension."""
    rng, whole = np.random.default_rng(seed), recorded()
    pull = 10 * np.abs(((np.linspace(0, corners, STEPS) + 1) % 2) - 1)
    fields = {name: np.zeros((STEPS, *field.shape[1:])) for name, field in whole.loads._asdict().items()}
    fields["tension"][:, 0] = pull + 0.01 * rng.standard_normal(STEPS)
    step, disk, kind = (each.ravel() for each in np.indices((STEPS, DISKS, 2)))
    noise = rng.standard_normal((STEPS, DISKS, 2))
    for k in range(1, STEPS):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
    value = bend * (pull + 0.03 * pull**2)[step] * (disk + 1) + 3e-4 * noise.ravel()
    value[rng.choice(len(value), outliers, replace=False)] += 0.05
    return replace(
        whole,
        sequences=("log",),
        steps=whole.steps.iloc[np.zeros(STEPS, int)].assign(step=np.arange(1, STEPS + 1)).reset_index(drop=True),
        of_sequence=np.zeros(STEPS, int),
        loads=Loads(**fields),
        readings=Readings(step, disk + 1, kind, value),
    )


@pytest.mark.parametrize("correlation", [0.4, 0.6, 0.8])
@pytest.mark.parametrize("outliers", [0, 10])
def test_noise_that_lasts_is_told_and_roughly_how_long(correlation, outliers):
    found = [serial_noise(log(correlation, seed, outliers=outliers)) for seed in range(8)]
    assert all(each.share >= 0.75 for each in found)
    span = np.median([each.span for each in found])
    assert abs(np.log(span * -np.log(correlation))) < np.log(2.5)


@pytest.mark.parametrize("bend", [0.0, 0.05])
def test_noise_of_which_nothing_lasts_is_told_to_last_in_no_log(bend):
    """Turning points of the loads are kinks of the readings, and no noise."""
    assert {serial_noise(log(0.0, seed, bend=bend)) for seed in range(40)} == {NO_SERIAL_NOISE}


def test_a_recording_in_steps_is_no_log():
    """Within few steps loads change so much that physics and noise are not told apart."""
    assert serial_noise(recorded()) == NO_SERIAL_NOISE
    assert serial_noise(log(0.9, corners=90)) == NO_SERIAL_NOISE
    assert as_stated(recorded()) == NoiseLevel()


def test_noise_of_the_steps_that_are_kept_is_correlated_as_in_the_whole_log():
    whole = replace(log(0.7), serial_noise=SerialNoise(0.8, 3.0))
    fewer = thinned(whole, 40, 10)
    assert len(fewer.steps) == 40
    assert np.ptp(np.diff(fewer.row_as_read)) > 0  # the steps are not evenly spread
    level = as_stated(fewer)
    assert (level.serial, level.span) == (0.8, 3.0)
    kept = np.isin(whole.readings.step, fewer.row_as_read)
    expected = noise_correlation(whole, level).toarray()[np.ix_(kept, kept)]
    assert noise_correlation(fewer, level).toarray() == pytest.approx(expected)
