"""What is said of times in another unit, and where loads follow each other at another pace than in the recording."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from diagnosis.learnt import run
from diagnosis.simulated import Case, manipulator, recorded

from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.posterior import ModelPosterior, Posterior
from prb3r.model.effects import EFFECT_KINDS
from prb3r.model.effects.plates import PlateRelaxation, WeakenedPlate
from prb3r.model.files.toml import toml_text

CREEP = PlateRelaxation(share=0.2, steps=3.0, step_s=20.0)
WEAK = WeakenedPlate(plate=2, factor=0.5)


@pytest.fixture
def said(tmp_path):
    """What `predict` says on stderr of steps at a pace, s, for a rig with an effect, recorded at 20 s a step."""
    (tmp_path / "rig.toml").write_text(toml_text(manipulator()))

    def of(pace, found=CREEP):
        model = ModelPosterior(probability=1.0, named=True, constants={}, effects=[found], free=[], covariance=[])
        known = Posterior(manipulator=manipulator(), models=[model], pace_s=20.0)
        record = {"effects": [], "verdict": "explained", "posterior": known.model_dump(mode="json", exclude_none=True)}
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        steps = pd.DataFrame({"sequence": "a", "step": [1, 2], "cable_1_n": [5.0, 10.0], "time_s": [0.0, pace]})
        steps.to_csv(tmp_path / "steps.csv", index=False)
        told = run(tmp_path, tmp_path / "rig.toml", tmp_path / "steps.csv")
        assert told.exit_code == 0, told.output
        return told.stderr

    return of


@pytest.mark.parametrize("pace", [0.02, 20e3])
def test_another_pace_is_said_where_plates_creep(said, pace):
    assert "was not seen; is either in another unit than seconds?" in said(pace)


def test_much_the_same_pace_is_not(said):
    assert "another unit" not in said(2.0)


def test_nor_is_another_one_where_nothing_goes_by_the_time(said):
    assert "another unit" not in said(0.02, WEAK)


def test_a_diagnosis_doubts_times_as_check_does_and_keeps_the_pace():
    recording = recorded(Case(hidden=()))
    time = 20e3 * np.arange(1.0, recording.loads.steps + 1)[:, None]
    slow = replace(recording, loads=recording.loads._replace(time=time))
    found = run_stages(Task(slow, without=frozenset(EFFECT_KINDS)))
    assert [note for note in found.remarks if "are times in milliseconds?" in note]
    assert found.posterior.pace_s == 20e3
