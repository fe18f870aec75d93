"""What lasts through a sequence is told by what was pulled again, and by nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, pulled_again, recorded

from prb3r.diagnosis.evidence.repeatability import Uncertain, differences, repeatability
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.covariance import (
    AS_STATED,
    NoiseLevel,
    correlation_root,
    lasting_scatter,
    noise_correlation,
    noise_of,
    reading_sd,
)
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.investigate import investigate
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.plates import WeakenedPlate


@pytest.fixture(scope="module")
def again():
    """Three times the same five sequences, read without noise; the tensions scatter by a per cent, as is stated."""
    quiet = pulled_again(0.0)
    return replace(quiet, measurement=quiet.measurement.model_copy(update={"tension_sd_relative": 0.01}))


@pytest.fixture(scope="module")
def sensed(again):
    """(r, s, m) by the relative change of every tension."""
    predict = predictor(again)
    return tension_response(predict, predict.solve(Constants()))


def gains(recording, share, seed, sd=0.01):
    """(s, m) relative errors of the tensions, of which a share of the variance is the same all through a sequence."""
    rng, shape = np.random.default_rng(seed), recording.loads.tension.shape
    lasting = rng.standard_normal((len(recording.sequences), shape[1]))[recording.of_sequence]
    return sd * (np.sqrt(share) * lasting + np.sqrt(1 - share) * rng.standard_normal(shape))


def misfit(recording, sensitivity, share, seed, reading=1.0):
    """(r,) of a right model, to first order in the errors of the tensions."""
    noise = np.random.default_rng([seed, 1]).standard_normal(recording.readings.count)
    moved = np.einsum("rsm,sm->r", sensitivity, gains(recording, share, seed))
    return reading * reading_sd(recording) * noise + moved


def told(recording, sensitivity, left, believed=AS_STATED):
    uncertain = Uncertain(reading_sd(recording), 0.01 * sensitivity)
    return repeatability(recording, left, uncertain, Settings(), believed)


def test_lasting_scatter_has_the_covariance_of_steps_that_share_a_part():
    change = np.random.default_rng(0).standard_normal((7, 5, 2))
    columns = lasting_scatter(change, 0.3).reshape(7, -1)
    steps = 0.7 * np.eye(5) + 0.3
    assert columns @ columns.T == pytest.approx(np.einsum("rsm,st,qtm->rq", change, steps, change))


def test_the_root_whitens_noise_that_goes_on_along_a_sequence(again):
    level, sd = NoiseLevel(common=0.2, reach=2.0, serial=0.4, span=3.0), reading_sd(again)
    step, disk, kind, _ = again.readings
    here, there = 0, 0 + np.flatnonzero((disk == disk[0]) & (kind == kind[0]) & (step == step[0] + 2))[0]
    dense = noise_correlation(again, level).toarray()
    assert dense[here, there] == pytest.approx(0.4 * np.exp(-2 / 3))
    other = again.of_sequence[step] != again.of_sequence[step[0]]
    assert not dense[here, other].any()
    assert np.diag(dense) == pytest.approx(1)
    values = np.random.default_rng(1).standard_normal(len(sd)) * sd
    white = correlation_root(again, sd, level) @ values
    assert white @ white == pytest.approx((values / sd) @ np.linalg.solve(dense, values / sd))


@pytest.mark.parametrize(("share", "least", "most"), [(0.0, 0.0, 0.1), (0.9, 0.5, 0.95)])
def test_gains_that_last_are_told_from_tensions_that_scatter(again, sensed, share, least, most):
    found = [told(again, sensed, misfit(again, sensed, share, seed)) for seed in range(8)]
    assert least <= np.mean([level.lasting for level in found]) <= most
    assert np.mean([level.serial for level in found]) < 0.1


@pytest.mark.long
def test_what_is_believed_of_shares_stays_unless_another_is_likelier_by_what_counts(again, sensed):
    """As of which model the noise is told must not matter: the shares that are found are found again from there."""
    wrong = AS_STATED._replace(lasting=0.9, serial=0.75, span=10.0)
    for seed in range(4):
        left = misfit(again, sensed, 0.5, seed)
        found = told(again, sensed, left)
        assert told(again, sensed, left, found) == found
        assert told(again, sensed, left, found._replace(scale=2.0)) == found  # scales are not its business
        assert told(again, sensed, left, wrong).serial <= 0.25
    gone = told(again, sensed, misfit(again, sensed, 0.0, 1), AS_STATED._replace(lasting=0.9))
    assert gone.lasting < 0.5


@pytest.mark.long
def test_of_very_many_differences_those_are_taken_that_tell_of_tensions():
    quiet = pulled_again(0.0, times=10)
    many = replace(quiet, measurement=quiet.measurement.model_copy(update={"tension_sd_relative": 0.01}))
    predict = predictor(many)
    sensitivity = tension_response(predict, predict.solve(Constants()))
    weights = differences(many, Settings(), np.square(sensitivity).sum((1, 2)) / reading_sd(many) ** 2)
    assert weights.shape[0] <= Settings().most_differences
    assert told(many, sensitivity, misfit(many, sensitivity, 0.9, 1)).lasting >= 0.5
    assert told(many, sensitivity, misfit(many, sensitivity, 0.0, 1)).lasting == 0


def test_noise_that_goes_on_along_a_sequence_is_found(again, sensed):
    level = AS_STATED._replace(serial=0.7, span=10.0)
    root = np.linalg.cholesky(noise_correlation(again, level).toarray())
    sd = reading_sd(again)
    found = [told(again, sensed, sd * (root @ np.random.default_rng(k).standard_normal(len(sd)))) for k in range(6)]
    assert np.mean([level.serial for level in found]) > 0.4


def test_physics_that_every_pull_shows_alike_does_not_count(again, sensed):
    """A plate at half of its stiffness, which the model lacks, moves every repetition by the same."""
    weak = predictor(again)(Constants(), [WeakenedPlate(kind="weakened_plate", plate=4, factor=0.5)])
    missing = weak - predictor(again)(Constants())
    assert np.abs(missing / reading_sd(again)).max() > 20
    assert told(again, sensed, missing + misfit(again, sensed, 0.0, 0)) == told(
        again, sensed, misfit(again, sensed, 0.0, 0)
    )


def test_sequences_of_which_none_repeats_another_tell_nothing():
    recording = recorded(Case(hidden=()))
    assert differences(recording, Settings(), np.ones(recording.readings.count)) is None
    sensitivity = np.zeros((recording.readings.count, *recording.loads.tension.shape))
    left = reading_sd(recording) * np.random.default_rng(0).standard_normal(recording.readings.count)
    assert told(recording, sensitivity, left) == AS_STATED


def test_no_difference_is_told_by_others(again):
    weights = differences(again, Settings(), np.ones(again.readings.count)).toarray()
    assert np.linalg.matrix_rank(weights) == len(weights)
    assert weights.sum(1) == pytest.approx(0)


@pytest.mark.long
def test_pulls_with_gains_of_their_own_are_adequate_and_it_is_said(again):
    """Each pull with some 3 % more or less tension than noted: without shares that last, physics would be missing."""
    tension = again.loads.tension * (1 + gains(again, 1.0, 5, sd=0.03))
    really = replace(again, loads=again.loads._replace(tension=tension))
    noise = reading_sd(again) * np.random.default_rng(2).standard_normal(again.readings.count)
    read = again.with_values(predictor(really)(Constants()) + noise)
    found = investigate(Task(read))
    assert found.verdict == "adequate"
    assert any("lasts through a sequence" in remark for remark in found.remarks)
    blind = investigate(Task(read, settings=replace(Settings(), lasting_shares=(), serial_shares=())))
    assert blind.verdict == "unexplained"


def test_the_covariance_holds_what_lasts(again, sensed):
    level = NoiseLevel(lasting=0.5)
    noise = noise_of(again, sensed, level=level)
    common = 0.01 * sensed[:, again.of_sequence == 0].sum((1, 2))
    assert np.linalg.norm(noise.whiten(common)) < 0.8 * np.linalg.norm(noise_of(again, sensed).whiten(common))
