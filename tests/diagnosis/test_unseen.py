"""What sequences that no fit has seen hold against a model, and what they do not."""

import numpy as np
import pytest

from prb3r.diagnosis.checks.heldout import unseen
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording
from tests.diagnosis.simulated import WEAK, Case, recorded

ASIDE = 4
"""The sequence set aside: "mixed"."""
RATE = Settings().naming_rate


def fitted_to_the_others(recording: Recording) -> Fit:
    return fit_constants(predictor(recording.only(set(range(ASIDE)))))


def with_changed(recording: Recording, step: int, disk: int, by: float) -> Recording:
    """One reading of a step of the sequence set aside, off by so many of its standard deviations."""
    steps = np.flatnonzero(recording.of_sequence == ASIDE)
    row = int(np.flatnonzero((recording.readings.step == steps[step]) & (recording.readings.disk == disk))[0])
    value = recording.readings.value.copy()
    value[row] += by * reading_sd(recording)[row]
    return recording.with_values(value)


@pytest.fixture(scope="module")
def clean() -> tuple[Recording, Fit]:
    recording = recorded(Case(hidden=()))
    return recording, fitted_to_the_others(recording)


@pytest.mark.parametrize("off", [7.0, 20.0, 300.0])
def test_a_slip_of_the_eye_refutes_nothing(clean, off):
    recording, fitted = clean
    (sequence,) = unseen(with_changed(recording, 1, 3, off), [ASIDE], Settings()).judged(fitted)
    assert sequence.p > RATE


def test_physics_that_is_missing_refutes():
    """A plate that is 30 % too soft moves all disks beyond it."""
    recording = recorded(Case(hidden=(tuple(WEAK.items()),)))
    (sequence,) = unseen(recording, [ASIDE], Settings()).judged(fitted_to_the_others(recording))
    assert sequence.p < RATE / 1000


def test_what_one_of_the_surviving_models_predicts_is_not_refuted():
    """By as much as that model is probable: the mean of the chances, never less than that of the named one."""
    recording = recorded(Case(hidden=(tuple(WEAK.items()),)))
    poor = fitted_to_the_others(recording)
    library = hypotheses(Scope.of(recording, poor.model.predict.chain, poor.solved.states), frozenset())
    (weak,) = [one for one in library if one.kind == "weakened_plate" and dict(one.place)["plate"] == 4]
    good = fit(poor.model.adding(weak), np.append(poor.p, 0.0))
    alone = unseen(recording, [ASIDE], Settings())
    (right,), (wrong,) = alone.judged(good), alone.judged(poor)
    assert right.p > 0.01
    (both,) = alone.judged_by(poor, [(0.6, poor), (0.3, good)], RATE)
    assert both.p == pytest.approx((0.6 * wrong.p + 0.3 * right.p) / 0.9)
    (named,) = alone.judged_by(good, [(0.6, poor), (0.3, good)], RATE)
    assert named == right
