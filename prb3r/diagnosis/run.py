"""From the files of a recording to its diagnosis, judged on other recordings where there are any."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from prb3r.diagnosis import stages
from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.transfer import Carried, on_other
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
    report: stages.Report = lambda step: None,
) -> Diagnosis:
    """The diagnosis of a recording, given as its folder or read already.

    Parameters
    ----------
    holdout : other recordings that the diagnosis is judged on, instead of sequences of this one.
    assume : a manipulator with effects found before, such as an `explained.toml`: they are refitted, and kept unless
        the recording contradicts them.
    seed : of thresholds and of the choice of held-out sequences; the same seed, the same diagnosis.
    jobs : worker processes.
    report : hears the name of every step as it begins.

    Raises
    ------
    RecordingError
        With every problem of the recordings' files, or if nothing near the nominal manipulator is in balance under the
        loads.
    SpecError
        With every problem of the manipulator that is assumed.
    """
    assumed = None if assume is None else manipulator_of(assume)
    whole, *others = [
        given if isinstance(given, Recording) else load_recording(given) for given in (recording, *holdout)
    ]
    with process_map(jobs) as apply:
        diagnosis = stages.run_stages(stages.Task(whole, seed, hold_out=not others, assumed=assumed), report, apply)
    if not others:
        return diagnosis
    carried = [(other, on_other(diagnosis, other)) for other in others]
    remarks = [f"{other.name}: {reason}" for other, prediction in carried for reason in prediction.left_behind]
    return replace(diagnosis, heldout=pooled(carried), remarks=(*diagnosis.remarks, *remarks))


def pooled(carried: Sequence[tuple[Recording, Carried]]) -> HeldOut:
    """Several recordings as one: sequences named after their recording, mean squares over all readings."""
    positions = np.array([int((recording.readings.kind <= Kind.Y).sum()) for recording, _ in carried])
    readings = np.array([recording.readings.count for recording, _ in carried])
    errors = [prediction.heldout for _, prediction in carried]

    def rms(name: str) -> float | None:
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
    )
