"""A load path of a fit that creeps on ends by its allowance, and what it has reached counts."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.budget import usual_allowance
from prb3r.mechanics.equilibrium import Outcome
from prb3r.mechanics.plate_law import Law


@pytest.fixture(scope="module")
def creeping():
    """Plates that hardly resist beyond a curvature of 4 1/m: holes stick and slip ever more finely."""
    predict = predictor(recorded(Case(hidden=(), program="reversing")))
    knee = np.full((predict.chain.plates, 2), 4.0)
    return replace(predict, chain=predict.chain._replace(presliding=1e-5, law=Law(knee=knee, ratio=0.02)))


def work_of_sequences(predict, solved):
    return np.bincount(predict.recording.of_sequence, solved.states.work)


@pytest.mark.long
def test_no_sequence_takes_more_than_it_may(creeping):
    settings, steps = creeping.settings, np.bincount(creeping.recording.of_sequence)
    solved, usual = creeping.solve(Constants()), usual_allowance()
    patient = replace(settings, work_of_sequence=usual.of_sequence, work_of_step=usual.of_step)
    in_full = replace(creeping, settings=patient).solve(Constants())
    may = settings.work_of_sequence + settings.work_of_step * steps
    assert (work_of_sequences(creeping, solved) <= 1.1 * may).all()  # a sub-step under way is ended
    assert work_of_sequences(creeping, in_full).max() > 5 * may.max()
    in_time = np.isfinite(solved.states.angle[:, -1])
    assert np.array_equal(solved.states.x[in_time], in_full.states.x[in_time])


def test_a_step_that_is_given_up_counts_by_what_it_lacks(creeping):
    solved = creeping.solve(Constants())
    lost, given_up = creeping.lost(solved), solved.states.outcome == Outcome.GAVE_UP
    assert given_up.sum() >= 5
    missing = lost.missing[given_up[creeping.recording.readings.step]]
    assert ((missing > 0) & (missing <= 1)).all()
    assert np.isfinite(lost.readings).all()


def test_paths_of_linear_plates_stay_far_below_it():
    predict = predictor(recorded(Case(hidden=(), program="reversing")))
    along = replace(predict, chain=predict.chain._replace(presliding=1e-6))
    solved = along.solve(Constants())
    assert np.isfinite(solved.readings).all()
    assert work_of_sequences(along, solved).max() < Settings().work_of_sequence / 10
