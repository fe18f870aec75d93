"""Beside friction that grows without bound as a tension falls, idle cables that are paid out answer to their first
tension by a factor of 1e200; such a derivative is not taken for what an effect does."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.planted import other_steps
from diagnosis.simulated import MU, manipulator, recorded

from prb3r.diagnosis.evidence.linearised import moved_readings
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.renewal import level_under
from prb3r.diagnosis.evidence.score_test import alternatives
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.model.manipulator import Manipulator

FALLS = {"kind": "load_dependent_friction", "exponent": 0.83, "tension_n": 30.0}
ON_IDLE_CABLES = {"tension_offset", "tension_drift"}


@pytest.fixture(scope="module")
def paid_out():
    """Constants of a rig whose friction falls with the load, and whose idle cables are declared as paid out."""
    known = recorded()
    slip = {f"slip_{n}": known.steps[f"slip_{n}"].where(known.steps[f"cable_{n}_n"] > 0, 1.0) for n in "1234"}
    rig = Manipulator.model_validate(manipulator(effects=[FALLS]))
    return fit_constants(predictor(replace(other_steps(known, **slip), manipulator=rig)))


@pytest.fixture(scope="module")
def smooth(suspects):
    return [hypothesis for hypothesis in suspects if hypothesis.continuous]


def test_no_effect_of_its_prior_size_moves_the_arm_beyond_all_sense(paid_out, smooth):
    probes = [(hypothesis, start) for hypothesis in smooth for start in hypothesis.starts(MU)]
    silent = set()
    for (hypothesis, start), moved in zip(probes, moved_readings(paid_out, probes), strict=True):
        sizes = [free.prior_sd for free in hypothesis.free]
        assert (np.abs(moved) * sizes < 1e3).all(), hypothesis.name
        if (start > 0).all() and not moved.any():
            silent.add(hypothesis.kind)
    assert silent == ON_IDLE_CABLES  # toward tension; away from it idle cables stay slack


def test_scores_and_noise_stay_numbers(paid_out, smooth):
    """They are those without the suspects of which nothing is known."""
    others = [hypothesis for hypothesis in smooth if hypothesis.kind not in ON_IDLE_CABLES]
    doubts = Doubts(np.ones(paid_out.model.predict.recording.readings.count))
    with np.errstate(over="raise", invalid="raise"):
        scored = alternatives(paid_out, smooth)
        level, without = (level_under(paid_out, doubts, library) for library in (smooth, others))
    assert all(np.isfinite(alternative.basis).all() for alternative in scored)
    assert level.level.scale == pytest.approx(without.level.scale, rel=0.05)
