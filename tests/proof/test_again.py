"""One recording of a run, written to a folder anew, is the one that the run has."""

import json

import numpy as np
import pytest

from prb3r.proof.again import write_case
from prb3r.proof.arguments import of_a_run
from prb3r.proof.prove import concealed_recordings, stages_of
from prb3r.recording.reading import load_recording

RUN = {"cases": 2, "seed": 71}
CLASSES = "clean", "imperfect-clean"


@pytest.mark.long
def test_a_recording_of_a_run_is_written_as_the_run_has_it(tmp_path):
    stages = stages_of(**RUN, jobs=1, say=lambda text: None, kept=None, classes=CLASSES)
    concealed = concealed_recordings(**RUN, stages=stages, classes=CLASSES)
    assert {task.label.cls for task in concealed.tasks} == set(CLASSES)
    for case, (task, recorded) in enumerate(zip(concealed.tasks, concealed.recordings, strict=True)):
        write_case(RUN["seed"], RUN["cases"], case, tmp_path / str(case), CLASSES)
        label = json.loads((tmp_path / f"{case}.truth.json").read_text())
        assert (label["case"], label["cls"]) == (case, task.label.cls)
        again = load_recording(tmp_path / str(case))
        assert np.array_equal(again.readings.value, recorded.readings.value)
        assert np.array_equal(again.loads.tension, recorded.loads.tension)


def test_a_recording_that_a_run_has_not_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no recording 2: a run of 2 has 0 to 1"):
        write_case(RUN["seed"], RUN["cases"], 2, tmp_path / "none", CLASSES)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["1", "2", "2", "x"], "there is no recording 2: a run of 2 has 0 to 1"),
        (["1", "2", "0", "x", "cleen"], "there is no class 'cleen'; the classes are clean, imperfect-clean"),
        (["1", "0", "0", "x"], "a run has one recording at least"),
        (["one", "2", "0", "x"], "invalid int value: 'one'"),
    ],
)
def test_wrong_words_end_with_a_message(monkeypatch, capsys, words, said):
    monkeypatch.setattr("sys.argv", ["again", *words])
    with pytest.raises(SystemExit, match="2"):
        of_a_run("", CLASSES, case=True)
    assert said in capsys.readouterr().err
