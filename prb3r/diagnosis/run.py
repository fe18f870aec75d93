"""From the files of one or several recordings to their diagnoses, judged on other recordings where some are given."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.files import default_folder
from prb3r.diagnosis.result.transfer import Carried, on_other, supposed
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.stages import Report
from prb3r.diagnosis.together import JointDiagnosis, diagnose_together
from prb3r.errors import Problem, SpecError
from prb3r.model.given import Given, manipulator_of
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Kind, Recording
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
    _ensure_unseen([whole], others)
    with process_map(jobs) if jobs > 1 else nullcontext(serially) as apply:
        diagnosis = run_stages(Task(whole, seed, hold_out=not others, assumed=assumed), report, apply)
    return _judged_on(diagnosis, others)


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
        If there are fewer than two recordings, or two of one name.
    """
    assumed = None if assume is None else manipulator_of(assume)
    read, others = _read(recordings), _read(holdout)
    _ensure_unseen(read, others)
    names = [recording.name for recording in read]
    if len(read) < 2:
        raise SpecError(Problem("together", f"takes two recordings or more, not {len(read)}"))
    for name in sorted({name for name in names if names.count(name) > 1}):
        raise SpecError(Problem("together", f"two recordings are named {name!r}; give them names of their own"))
    folders = [default_folder(name).name for name in names]
    if alike := [name for name, folder in zip(names, folders, strict=True) if folders.count(folder) > 1]:
        told = " and ".join(map(repr, alike))
        raise SpecError(Problem("together", f"{told} would be written into one folder; give them names further apart"))
    tasks = [Task(recording, seed, hold_out=not others, assumed=assumed) for recording in read]
    with process_map(jobs) if jobs > 1 else nullcontext(serially) as apply:
        joint = diagnose_together(tasks, report, apply)
    return replace(joint, diagnoses=tuple(_judged_on(diagnosis, others) for diagnosis in joint.diagnoses))


def _read(given: Sequence[Recording | str | Path]) -> list[Recording]:
    return [place if isinstance(place, Recording) else load_recording(place) for place in given]


def _ensure_unseen(diagnosed: Sequence[Recording], others: Sequence[Recording]) -> None:
    """Check that no recording is to be judged on its own readings; raises SpecError if one is."""
    for other in others:
        for recording in diagnosed:
            same = recording.steps.equals(other.steps) and np.array_equal(
                recording.readings.value, other.readings.value
            )
            if same:
                what = f"{other.name!r} is what is diagnosed, and confirms nothing; give another recording"
                raise SpecError(Problem("holdout", what))


def _judged_on(diagnosis: Diagnosis, others: Sequence[Recording]) -> Diagnosis:
    """The diagnosis with its held-out errors replaced by those on other recordings; as it is without any."""
    if not others:
        return diagnosis
    carried = [(other, on_other(diagnosis, other)) for other in others]
    remarks = [
        f"{other.name} does without {reason}" for other, prediction in carried for reason in prediction.left_behind
    ]
    remarks += [f"{other.name}: {text}" for other, prediction in carried for text in supposed(prediction.effects)]
    return replace(diagnosis, heldout=pooled(carried), remarks=(*diagnosis.remarks, *remarks))


def pooled(carried: Sequence[tuple[Recording, Carried]]) -> HeldOut:
    """The held-out errors of several recordings as one.

    Sequences are named after their recording; mean squares are averaged by the number of readings of each.
    """
    positions = np.array([int((recording.readings.kind <= Kind.Y).sum()) for recording, _ in carried])
    readings = np.array([recording.readings.count for recording, _ in carried])
    errors = [prediction.heldout for _, prediction in carried]

    def rms(name: str) -> float | None:
        """Root mean square, over all recordings, of the error of this name; None where no recording has it."""
        counts = positions if name.endswith("_m") else readings - positions
        values = np.array([getattr(error, name) for error in errors], float)  # None as NaN
        known = np.isfinite(values)
        return float(np.sqrt(counts[known] @ values[known] ** 2 / counts[known].sum())) if known.any() else None

    return HeldOut(
        sequences=tuple(f"{recording.name}: {name}" for recording, _ in carried for name in recording.sequences),
        rmse_calibrated_m=rms("rmse_calibrated_m"),
        rmse_explained_m=rms("rmse_explained_m"),
        noise_m=rms("noise_m"),
        rmse_calibrated_rad=rms("rmse_calibrated_rad"),
        rmse_explained_rad=rms("rmse_explained_rad"),
        noise_rad=rms("noise_rad"),
        chi2_calibrated=sum(error.chi2_calibrated for error in errors),
        chi2_explained=sum(error.chi2_explained for error in errors),
        readings=sum(error.readings for error in errors),
        lost=sum(error.lost for error in errors),
    )
