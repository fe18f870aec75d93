"""The omnibus test: rare where smooth moments are missing, as often as chance has it where noise alone is left."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded
from scipy.stats import chi2 as chi2_law
from scipy.stats import kstest

from prb3r.diagnosis.evidence.smooth_moments import chance_of_smooth_moments
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.prediction import predictor


@pytest.fixture(scope="module")
def fitted():
    """The constants of a rig of which the file says all."""
    return fit_constants(predictor(recorded(Case(hidden=()))))


def leaving(fitted, whitened):
    """The fit as if these whitened readings had been fitted: what constants can do is taken out."""
    residual = np.zeros(len(fitted.residual))
    residual[: len(whitened)] = whitened
    residual -= fitted.basis @ (fitted.basis.T @ residual)
    return replace(fitted, residual=residual)


def noise(fitted, seed):
    return np.random.default_rng(seed).standard_normal(fitted.model.predict.recording.readings.count)


def missing_moments(fitted, size):
    """The whitened change of the readings by moments that follow no law of the dictionary, solved anew.

    They go with the square of the distance from the middle of the arm, and turn with the pull of the outer cables.
    """
    predict, solved = fitted.model.predict, fitted.solved
    loads = predict.recording.loads
    pull = (loads.tension[:, 0] - loads.tension[:, 3]) / 90.0
    shape = np.linspace(-1, 1, solved.chain.plates) ** 2
    changed = loads._replace(moment=size * np.cos(np.pi * pull)[:, None] * shape)
    return fitted.model.noise.whiten(predict(solved.constants, solved.effects, changed) - solved.readings)


@pytest.fixture(scope="module")
def tip_alone():
    """The same where only the tip was read: 60 readings, which fields of moments could nearly all be."""
    recording = recorded(Case(hidden=()))
    tip = recording.readings.where(recording.readings.disk == recording.readings.disk.max())
    return fit_constants(predictor(replace(recording, readings=tip)))


@pytest.mark.parametrize("which", ["fitted", pytest.param("tip_alone", marks=pytest.mark.long)])
def test_of_right_models_each_chance_is_as_frequent_as_any_other(which, request):
    """Constants of which nothing is known beforehand take as many readings; without them chances were too small."""
    fitted = request.getfixturevalue(which)
    chances = [chance_of_smooth_moments(leaving(fitted, noise(fitted, k)), seed=1) for k in range(120)]
    assert kstest(chances, "uniform").pvalue > 1e-3


def test_the_scale_of_the_noise_does_not_matter(fitted):
    once = leaving(fitted, noise(fitted, 3))
    twice = replace(once, residual=2 * once.residual)
    assert chance_of_smooth_moments(twice, seed=1) == pytest.approx(chance_of_smooth_moments(once, seed=1))


def test_moments_that_are_too_small_for_the_size_of_the_residuals_show_by_being_smooth(fitted):
    """The same residuals in another order have the same size, and show nothing."""
    change = missing_moments(fitted, 1.0)
    change = missing_moments(fitted, 7.0 / np.linalg.norm(leaving(fitted, change).residual))
    found, sizes, shuffled = [], [], []
    for k in range(20):
        left = leaving(fitted, noise(fitted, k) + change)
        found.append(chance_of_smooth_moments(left, seed=1))
        sizes.append(chi2_law.sf(left.residual @ left.residual, fitted.freedom))
        mixed = np.random.default_rng(k).permutation(left.residual[: len(change)])
        shuffled.append(chance_of_smooth_moments(leaving(fitted, mixed), seed=1))
    rate = fitted.model.settings.naming_rate
    assert np.median(found) < rate / 5
    assert np.median(sizes) > 0.02
    assert 0.2 < np.median(shuffled) < 0.8
