"""The noise of readings and tensions, told apart by what each of them moves."""

from dataclasses import replace

import numpy as np
import pytest

from prb3r.diagnosis.checks.residuals import neighbours_alike
from prb3r.diagnosis.evidence.noise_level import ReadingChanges, noise_level
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.renewal import level_under
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.covariance import NoiseLevel, as_stated, noise_correlation, noise_of, reading_sd
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.result.rig_remarks import noisy
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Kind, Readings, Recording, SerialNoise
from tests.diagnosis.simulated import recorded


def drawn(recording: Recording, reading: float, tension: float, seed: int) -> tuple[np.ndarray, ReadingChanges]:
    """A misfit (r,) of a linear rig whose readings and tensions scatter that many times as much as stated."""
    rng = np.random.default_rng(seed)
    count, step = recording.readings.count, recording.readings.step
    columns = np.zeros((count, step.max() + 1))
    columns[np.arange(count), step] = 2 * rng.normal(size=count)
    sd = reading_sd(recording)[:, None]
    fitted, possible = sd * rng.normal(size=(count, 2)), sd * rng.normal(size=(count, 5))
    misfit = sd[:, 0] * (reading * rng.normal(size=count) + tension * columns @ rng.normal(size=columns.shape[1]))
    return misfit + fitted @ [3.0, -4.0], ReadingChanges(fitted, sd * columns, possible)


@pytest.mark.parametrize(("reading", "tension"), [(1.0, 1.0), (1.3, 0.6), (0.8, 2.0)])
def test_both_scales_are_found_and_their_intervals_cover(reading, tension):
    recording = recorded()
    believed = np.ones(recording.readings.count)
    found = [noise_level(recording, *drawn(recording, reading, tension, k), believed, Settings()) for k in range(30)]
    logs = np.log([(level.reading.value, level.tension.value) for level in found])
    assert logs.mean(0) == pytest.approx(np.log([reading, tension]), abs=0.15)
    covered = [level.reading.low <= reading <= level.reading.high for level in found]
    covered += [level.tension.low <= tension <= level.tension.high for level in found]
    assert np.mean(covered) > 0.85


def test_a_scatter_beyond_what_is_considered_is_told_as_at_least_so_much():
    """Factors up to 4.06 are considered; of tensions that scatter 6.7 times as much as stated the least is told."""
    recording = recorded()
    believed = np.ones(recording.readings.count)
    far = noise_level(recording, *drawn(recording, 1.0, 6.7, 0), believed, Settings())
    assert far.tension.open == (False, True)
    (said,) = [remark for remark in noisy(far, Settings()) if "tensions" in remark]
    assert said.startswith(f"the scatter of the tensions is at least {far.tension.low:.2g} times the stated one: state")
    within = noise_level(recording, *drawn(recording, 1.0, 2.0, 0), believed, Settings())
    assert within.tension.open == (False, False)
    assert within.tension.text == f"{within.tension.value:.2g}"


def test_tensions_that_are_stated_exact_are_taken_as_exact():
    recording = recorded()
    misfit, around = drawn(recording, 1.0, 0.0, 0)
    exact = around._replace(tensions=np.zeros((recording.readings.count, 0)))
    level = noise_level(recording, misfit, exact, np.ones(len(misfit)), Settings())
    assert level.tension[:3] == (1.0, 1.0, 1.0)
    assert level.level.tension == 1.0


def test_a_rig_whose_tensions_scatter_twice_as_much_as_stated_is_found_so():
    """Readings as predicted, with noise as stated and tensions 4 % off where 2 % is stated."""
    right = recorded()
    stated = replace(right, measurement=right.measurement.model_copy(update={"tension_sd_relative": 0.02}))
    begun = fit_constants(predictor(stated))
    rng, readings = np.random.default_rng(0), stated.readings
    response = tension_response(begun.model.predict, begun.solved).reshape(readings.count, -1)
    off = reading_sd(stated) * rng.normal(size=readings.count) + 0.04 * response @ rng.normal(size=response.shape[1])
    scattered = replace(stated, readings=readings._replace(value=begun.solved.readings + off))
    level = level_under(fit_constants(predictor(scattered)), Doubts(np.ones(readings.count)), ())
    assert 1.1 < level.tension.low < 2 < level.tension.high
    assert level.reading.low < 1 < level.reading.high


@pytest.mark.parametrize(("neighbouring", "common"), [(0.0, 0.0), (0.45, 0.8)])
def test_noise_that_goes_on_from_disk_to_disk_is_told_and_whitened(neighbouring, common):
    """Errors of markers that are followed in one image: each disk's is `neighbouring` times that of the last one, and
    noise of its own; half in common to neighbours would leave a correlation that chance does not."""
    recording = recorded()
    readings, rng = recording.readings, np.random.default_rng(5)
    own = rng.normal(size=(readings.step.max() + 1, len(Kind), readings.disk.max() + 1))
    of_all = own.copy()
    for disk in range(1, own.shape[-1]):
        of_all[..., disk] = neighbouring * of_all[..., disk - 1] + np.sqrt(1 - neighbouring**2) * own[..., disk]
    misfit = reading_sd(recording) * of_all[readings.step, readings.kind, readings.disk]
    fitted, possible = reading_sd(recording)[:, None] * rng.normal(size=(2, readings.count, 3))
    changes = ReadingChanges(fitted, np.zeros((readings.count, 0)), possible)
    level = noise_level(recording, misfit, changes, np.ones(readings.count), Settings()).level
    assert level.common == pytest.approx(common, abs=0.1)
    left = noise_of(recording, np.zeros((readings.count, *recording.loads.tension.shape)), level=level).whiten(misfit)
    assert neighbours_alike(recording, left, "disks") > 0.01


def test_the_covariance_grows_with_the_square_of_the_factor():
    recording = recorded()
    sensitivity = np.random.default_rng(0).normal(size=(recording.readings.count, *recording.loads.tension.shape))
    variance = [
        noise_of(recording, sensitivity, level=NoiseLevel(tension=factor)).total_sd ** 2 for factor in (0.0, 1.0, 3.0)
    ]
    assert variance[2] - variance[0] == pytest.approx(9 * (variance[1] - variance[0]), rel=1e-9)


@pytest.mark.parametrize("span", [2.0, 5.6])
def test_how_long_the_noise_of_a_log_lasts_is_told_better_by_the_fit_of_a_model(span):
    """Stretches of a log tell it to a factor of two; a sequence of forty steps tells it better."""
    whole = recorded()
    step, disk, kind = (each.ravel() for each in np.indices((40, 6, 2)))
    log = replace(
        whole,
        steps=whole.steps.iloc[np.zeros(40, int)].reset_index(drop=True),
        of_sequence=np.zeros(40, int),
        readings=Readings(step, disk + 1, kind, np.zeros(len(step))),
        serial_noise=SerialNoise(0.98, 2.8),
    )
    stated = as_stated(log)
    root = np.linalg.cholesky(noise_correlation(log, stated._replace(span=span)).toarray())
    sd, told = reading_sd(log), []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        changes = ReadingChanges(
            sd[:, None] * rng.normal(size=(len(sd), 2)),
            np.zeros((len(sd), 0)),
            sd[:, None] * rng.normal(size=(len(sd), 3)),
        )
        misfit = sd * (root @ rng.normal(size=len(sd)))
        told.append(noise_level(log, misfit, changes, np.ones(len(sd)), Settings(), stated).level)
    assert np.median([level.span for level in told]) == pytest.approx(span, rel=0.05)
    assert {level.serial for level in told} == {0.98}
    last = noise_level(log, misfit, changes, np.ones(len(sd)), Settings(), stated)
    (said,) = [text for text in noisy(last, Settings(), logged=True) if "lasts" in text]
    assert said.startswith("about 98 % of the noise of a disk's readings lasts over some")
