"""Noise: whitening is the inverse root of the covariance, tension scatter included."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded
from scipy.stats import multivariate_normal

from prb3r.diagnosis.fit.basis import basis_of, left_singular
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.covariance import NoiseLevel, noise_correlation, noise_of, reading_sd
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.model.steps import loads_of

CLEAN = Case(hidden=())


@pytest.fixture(scope="module")
def sensed():
    recording = recorded(CLEAN)
    predict = predictor(recording)
    return recording, tension_response(predict, predict.solve(Constants()))


def dense(recording, sensitivity):
    """Reading noise and the scatter of every tension of every step, as one matrix."""
    columns = sensitivity.reshape(len(sensitivity), -1) * recording.measurement.tension_sd_relative
    return np.diag(reading_sd(recording) ** 2) + columns @ columns.T


def test_whitened_squares_are_those_of_the_dense_covariance(sensed):
    recording, sensitivity = sensed
    noise, covariance = noise_of(recording, sensitivity), dense(recording, sensitivity)
    values = np.random.default_rng(1).standard_normal((len(covariance), 3)) * noise.sd[:, None]
    white = noise.whiten(values)
    assert white.T @ white == pytest.approx(values.T @ np.linalg.solve(covariance, values))
    assert noise.whiten(values[:, 0]) == pytest.approx(white[:, 0])
    assert noise.total_sd**2 == pytest.approx(np.diag(covariance))


@pytest.mark.parametrize("common", [0.0, 0.4])
def test_the_density_of_a_misfit_is_that_of_a_normal_distribution(sensed, common):
    recording, sensitivity = sensed
    level, uncertain = NoiseLevel(common=common, reach=2.0), np.random.default_rng(3).normal(size=(360, 2)) * 1e-3
    noise = noise_of(recording, sensitivity, level=level, tolerances=uncertain)
    correlated = noise_correlation(recording, level).toarray() * np.outer(noise.sd, noise.sd)
    covariance = correlated + dense(recording, sensitivity) - np.diag(noise.sd**2) + uncertain @ uncertain.T
    misfit = np.random.default_rng(1).standard_normal(len(covariance)) * noise.sd
    expected = multivariate_normal(cov=covariance).logpdf(misfit) + len(misfit) / 2 * np.log(2 * np.pi)
    assert noise.log_density(misfit) == pytest.approx(expected, abs=1e-5)


def test_a_tension_moves_its_own_step_alone_under_declared_slip(sensed):
    recording, sensitivity = sensed
    for step in range(len(recording.of_sequence)):
        others = recording.readings.step != step
        assert not sensitivity[others, step].any()
    pulled = recording.loads.tension > 0
    assert not sensitivity[:, ~pulled].any()
    assert np.abs(sensitivity[:, pulled]).max(0).min() > 0


def test_scatter_lets_a_common_error_of_a_tension_pass_that_reading_noise_alone_would_not(sensed):
    recording, sensitivity = sensed
    error = 0.003 * sensitivity[:, 1, 0]  # one standard deviation of the weight of the second step
    without = noise_of(
        replace(recording, measurement=recording.measurement.model_copy(update={"tension_sd_relative": 0.0})),
        sensitivity,
    )
    assert np.linalg.norm(noise_of(recording, sensitivity).whiten(error)) < 1 < np.linalg.norm(without.whiten(error))


def test_singular_vectors_come_back_where_divide_and_conquer_fails(monkeypatch):
    columns = np.random.default_rng(2).standard_normal((9, 3)) @ np.diag([1.0, 1e-3, 0.0])
    axes, size = left_singular(columns)

    def fails(*_, **__):
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(np.linalg, "svd", fails)
    slowly, as_large = left_singular(columns)
    np.testing.assert_allclose(as_large, size, atol=1e-12)
    np.testing.assert_allclose(np.abs(axes[:, :2].T @ slowly[:, :2]), np.eye(2), atol=1e-9)
    assert basis_of(columns).shape == (9, 2)


@pytest.mark.parametrize(
    ("effect", "sequence"),
    [
        ({"kind": "tension_play", "play_n": 4.0}, 2),  # the same tension again
        ({"kind": "rate_dependent_friction", "rate": 0.2, "reference_n_per_s": 1.0}, 0),  # others
        ({"kind": "breakaway_friction", "excess": 1.0, "decay_n": 15.0}, 0),
    ],
    ids=["play", "rate", "excess"],
)
def test_a_tension_moves_what_a_solve_with_it_moves(effect, sequence):
    """Later steps too, where tensions lag or friction goes by how the tension has changed."""
    recording = recorded(CLEAN)
    times = np.arange(len(recording.steps)) * 7.0
    table = recording.steps.assign(time_s=times)
    rig = recording.manipulator.replace("effect", [effect])
    loads = loads_of(rig, rig.chain(), table)
    known = replace(recording, manipulator=rig, loads=loads)
    predict = predictor(known)
    sensitivity = tension_response(predict, predict.solve(Constants()))
    step = int(np.flatnonzero(recording.of_sequence == sequence)[1])
    cable = int(np.argmax(loads.tension[step]))
    column, change = f"cable_{rig.cable_names[cable]}_n", 1e-4
    ends = []
    for way in (1, -1):
        pulled = loads.tension[step, cable] * (1 + way * change)
        other = table.assign(**{column: np.where(np.arange(len(table)) == step, pulled, loads.tension[:, cable])})
        ends.append(predict(Constants(), loads=loads_of(rig, rig.chain(), other)))
    difference = (ends[0] - ends[1]) / (2 * change)
    assert sensitivity[:, step, cable] == pytest.approx(difference, abs=1e-5 * np.abs(difference).max())
    assert np.abs(difference[recording.readings.step == step + 1]).max() > 1e-5  # the step after it moves as well
