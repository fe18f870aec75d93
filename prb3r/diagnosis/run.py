"""From the files of one or several recordings to their diagnoses, judged on other recordings where some are given."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from prb3r.diagnosis.chance import chi2_tail
from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.setup.remedy import with_manipulator
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.effects import NamedEffect
from prb3r.diagnosis.result.files import default_folder
from prb3r.diagnosis.result.same_rig import same_geometry
from prb3r.diagnosis.result.transfer import on_other, supposed
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import Report
from prb3r.diagnosis.together import JointDiagnosis, diagnose_together
from prb3r.errors import Problem, SpecError
from prb3r.markdown import listed
from prb3r.model.given import Given, manipulator_of
from prb3r.model.manipulator import Manipulator
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
    return _judged_on(diagnosis, others, whole.manipulator)


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
    return replace(joint, diagnoses=tuple(_judged_on(single, others, own.manipulator) for single, own in pairs))


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


def _judged_on(diagnosis: Diagnosis, others: Sequence[Recording], filed: Manipulator) -> Diagnosis:
    """The diagnosis with its held-out errors and gains replaced by those on other recordings; as it is without any.

    Where a blunder was mended in the manipulator file `filed`, other recordings of that file are judged with it mended.
    """
    if not others:
        return diagnosis
    mended = [_mended_too(other, diagnosis, filed) for other in others]
    remarks = [text for _, text in mended if text]
    carried = [(other, on_other(diagnosis, other)) for other, _ in mended]
    for other, prediction in carried:
        remarks += [f"{other.name} does without {reason}" for reason in prediction.left_behind]
        if prediction.of_the_bench:
            remarks.append(
                f"{other.name} is taken to stand on the bench of {diagnosis.name}, mounted alike, with "
                f"{listed(prediction.of_the_bench)}: bench = false under [sharing] in its file where it does not"
            )
        remarks += [f"{other.name}: {text}" for text in supposed(prediction.effects)]
        remarks += _missed(other, prediction.heldout, diagnosis)

    def judged(effect: NamedEffect, number: int) -> NamedEffect:
        errors = [(other, error) for other, prediction in carried if (error := prediction.without[number])]
        return replace(effect, heldout_gain=pooled(errors).gain if errors else None)

    return replace(
        diagnosis,
        heldout=pooled([(other, prediction.heldout) for other, prediction in carried]),
        effects=tuple(judged(effect, number) for number, effect in enumerate(diagnosis.effects)),
        remarks=(*diagnosis.remarks, *remarks),
    )


NOTICED = 1.05
"""How many times as far as noise allows another recording has to be missed to be told of, if that is no chance.
Choice: of many readings even the smallest share is none."""


def _missed(other: Recording, error: HeldOut, diagnosis: Diagnosis) -> list[str]:
    """A sentence on another recording that is missed by more than noise, or that has no equilibrium; else none."""
    lost = f", and {error.lost} of its readings have no equilibrium" if error.lost else ""
    noise = diagnosis.noise
    chi2 = error.chi2_explained / max(noise.scale, noise.tension_scale, 1.0) ** 2
    size = float(np.sqrt(chi2 / error.readings)) if error.readings else np.inf
    if not lost and not _is_missed(size, error.readings, diagnosis):
        return []
    return [
        f"{other.name} is missed by {size:.2g} times what noise and tolerances allow{lost}: what was learnt here does "
        "not predict it; diagnose it too, or both --together"
    ]


def _is_missed(size: float, readings: int, diagnosis: Diagnosis) -> bool:
    """Whether an error of `size`, in units of what noise and tolerances allow, is one.

    It is if it comes by chance in fewer than `Settings.naming_rate` of recordings; where readings of the diagnosed
    recording share noise, so that they are fewer than they seem, beyond `Settings.misleading`.
    """
    settings, noise = Settings(**diagnosis.settings), diagnosis.noise
    if max(noise.common, noise.lasting, noise.serial) > 0:
        return size > settings.misleading
    return size > NOTICED and (not readings or chi2_tail(size**2 * readings, readings) < settings.naming_rate)


def _mended_too(other: Recording, diagnosis: Diagnosis, filed: Manipulator) -> tuple[Recording, str]:
    """Another recording with what `diagnosis` mends in the manipulator file `filed`, if it has the same file; and what
    is to be said of it, empty if nothing."""
    files, remark = {blunder.file for blunder in diagnosis.setup}, ""
    if "manipulator" in files and same_geometry(other.manipulator, filed):
        mended = other.manipulator.model_copy(update={"cable": diagnosis.nominal.cable})
        other, remark = with_manipulator(other, mended).recording, "is judged with its manipulator file mended too"
        files.discard("manipulator")
    elif same_geometry(other.manipulator, diagnosis.nominal):
        files.discard("manipulator")
    if files:
        remark = "is judged as it was recorded: whether the same blunder was made there was not looked for"
    return other, remark and f"{other.name} {remark}"


def pooled(judged: Sequence[tuple[Recording, HeldOut]]) -> HeldOut:
    """The held-out errors of several recordings as one.

    Sequences are named after their recording; mean squares are averaged by the number of readings of each.
    """
    positions = np.array([int(recording.readings.is_position.sum()) for recording, _ in judged])
    readings = np.array([recording.readings.count for recording, _ in judged])
    errors = [error for _, error in judged]

    def rms(name: str) -> float | None:
        """Root mean square, over all recordings, of the error of this name; None where no recording has it."""
        counts = positions if name.endswith("_m") else readings - positions
        values = np.array([getattr(error, name) for error in errors], float)  # None as NaN
        known = np.isfinite(values)
        return float(np.sqrt(counts[known] @ values[known] ** 2 / counts[known].sum())) if known.any() else None

    return HeldOut(
        sequences=tuple(f"{recording.name}: {name}" for recording, _ in judged for name in recording.sequences),
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
        positions=sum(error.positions for error in errors),
        felt=any(error.felt for error in errors),
    )
