"""From the files of one or several recordings to their diagnoses, judged on other recordings where some are given."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.files import default_folder
from prb3r.diagnosis.result.other_recordings import judged_on
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import Report
from prb3r.diagnosis.together import JointDiagnosis, diagnose_together
from prb3r.errors import Problem, SpecError
from prb3r.model.given import Given, manipulator_of
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Recording
from prb3r.recording.serial_noise import with_serial_noise
from prb3r.recording.smoothing import with_smooth_tensions
from prb3r.recording.thinning import thinned
from prb3r.runs.backends.process_map import process_map


def diagnosis_of(
    recording: Recording | str | Path,
    *,
    holdout: Sequence[Recording | str | Path] = (),
    assume: Given | None = None,
    seed: int = 0,
    jobs: int = 1,
    report: Report = lambda step: None,
) -> Diagnosis:
    """The diagnosis of a recording, given as its folder or read already.

    Parameters
    ----------
    holdout : other recordings that the diagnosis is judged on, instead of sequences of this one.
    assume : a manipulator with effects found before, such as an `explained.toml`: they are refitted, and kept unless
        the recording contradicts them.
    seed : of thresholds and of the choice of held-out sequences; the same seed, the same diagnosis.
    jobs : worker processes.
    report : called with the name of every step as it begins.

    Raises
    ------
    RecordingError
        With every problem of the recordings' files, or if nothing near the nominal manipulator is in balance under the
        loads.
    SpecError
        With every problem of the manipulator that is assumed, or if a recording is to be judged on itself.
    """
    assumed = None if assume is None else manipulator_of(assume)
    (whole,), others = _read([recording]), _read(holdout)
    _refuse_known(others, [whole])
    with process_map(jobs) if jobs > 1 else nullcontext(serially) as apply:
        diagnosis = run_stages(Task(whole, seed, hold_out=not others, assumed=assumed), report, apply)
    return judged_on(diagnosis, others, whole.manipulator)


def joint_diagnosis_of(
    recordings: Sequence[Recording | str | Path],
    *,
    holdout: Sequence[Recording | str | Path] = (),
    assume: Given | None = None,
    seed: int = 0,
    jobs: int = 1,
    report: Report = lambda step: None,
) -> JointDiagnosis:
    """The diagnosis of several recordings with what their rigs share; parameters and errors as of `diagnosis_of`.

    Raises
    ------
    SpecError
        If there are fewer than two recordings, or two of one name or with the same readings.
    """
    assumed = None if assume is None else manipulator_of(assume)
    read, others = _read(recordings), _read(holdout)
    _refuse_known(others, read)
    names = [recording.name for recording in read]
    if len(read) < 2:
        raise SpecError(Problem("together", f"takes two recordings or more, not {len(read)}"))
    for name in sorted({name for name in names if names.count(name) > 1}):
        raise SpecError(Problem("together", f"two recordings are named {name!r}; give them names of their own"))
    folders = [default_folder(name).name for name in names]
    if alike := [name for name, folder in zip(names, folders, strict=True) if folders.count(folder) > 1]:
        told = " and ".join(map(repr, alike))
        raise SpecError(Problem("together", f"{told} would be written into one folder; give them names further apart"))
    for one, other in combinations(read, 2):
        if np.array_equal(one.readings.value, other.readings.value):
            told = f"{one.name!r} and {other.name!r} have the same readings, which would count twice; give one of them"
            raise SpecError(Problem("together", told))
    tasks = [Task(recording, seed, hold_out=not others, assumed=assumed) for recording in read]
    with process_map(jobs) if jobs > 1 else nullcontext(serially) as apply:
        joint = diagnose_together(tasks, report, apply)
    pairs = zip(joint.diagnoses, read, strict=True)
    return replace(joint, diagnoses=tuple(judged_on(single, others, own.manipulator) for single, own in pairs))


def _read(given: Sequence[Recording | str | Path]) -> list[Recording]:
    """The recordings, with as many of their steps as are used."""
    settings = Settings()
    read = [place if isinstance(place, Recording) else load_recording(place) for place in given]
    used = settings.steps_used, settings.steps_of_sequence
    return [thinned(with_smooth_tensions(with_serial_noise(recording)), *used) for recording in read]


def _refuse_known(others: Sequence[Recording], diagnosed: Sequence[Recording]) -> None:
    """Raise a SpecError for each of the `others` that has the readings of a diagnosed recording."""

    def known(other: Recording) -> bool:
        return any(np.array_equal(other.readings.value, own.readings.value) for own in diagnosed)

    what = "has the readings that are diagnosed, which confirm nothing; give another recording"
    if again := [Problem("holdout", f"{other.name} {what}") for other in others if known(other)]:
        raise SpecError(*again)
