"""What is fitted to small loads alone."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import recorded

from prb3r.diagnosis.evidence.outliers import Doubts, NotedWeight
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.search.small_loads import at_small_loads, load_share

SHARE = 0.6


def calibrated(recording):
    fitted = fit_constants(predictor(recording))
    return fitted, Doubts(np.ones(recording.readings.count))


def test_steps_that_are_not_read_are_not_solved_and_change_nothing():
    recording = recorded()
    known, doubts = calibrated(recording)
    light = load_share(recording.loads) <= SHARE
    small = at_small_loads(known, doubts, SHARE)
    assert small.solved.loads.steps == light.sum() < len(light)
    read = recording.readings.where(light[recording.readings.step])
    np.testing.assert_array_equal(small.model.predict.recording.readings.value, read.value)
    predict = replace(known.model.predict, recording=replace(recording, readings=read))
    noise = Doubts(np.ones(read.count)).noise(predict, known.solved, known.model.settings)
    whole = fit(replace(known.model, predict=predict, noise=noise), known.p)
    assert small.p == pytest.approx(whole.p, abs=1e-5)
    assert small.chi2 == pytest.approx(whole.chi2, rel=1e-4)


def test_where_states_remember_those_before_every_step_is_solved():
    recording = recorded()
    friction = recording.manipulator.friction.model_copy(update={"direction": "history", "presliding_m": 1e-4})
    remembering = recording.manipulator.model_copy(update={"friction": friction})
    known, doubts = calibrated(replace(recording, manipulator=remembering))
    small = at_small_loads(known, doubts, SHARE)
    assert small.solved.loads.steps == recording.loads.steps
    assert small.model.predict.recording.readings.count < recording.readings.count


def test_weights_that_are_not_believed_keep_their_steps():
    recording = recorded()
    known, doubts = calibrated(recording)
    steps = np.flatnonzero(load_share(recording.loads) <= SHARE)
    heavy = np.flatnonzero(load_share(recording.loads) > SHARE)
    doubted = tuple(NotedWeight(int(step), 0) for step in (steps[3], heavy[0]))
    small = at_small_loads(known, replace(doubts, weights=doubted), SHARE)
    believed = small.model.noise.believed
    assert set(small.model.predict.recording.readings.step[~believed]) == {3}
