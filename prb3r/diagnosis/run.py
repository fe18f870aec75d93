"""From the files of a recording to its diagnosis, judged on other recordings where there are any."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from prb3r.diagnosis import stages
from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.transfer import Carried, on_other
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Recording
from prb3r.runs.engine import together


def diagnosis_of(
    recording: Recording | str | Path,
    *,
    holdout: Sequence[Recording | str | Path] = (),
    seed: int = 0,
    jobs: int = 1,
    report: stages.Report = lambda step: None,
) -> Diagnosis:
    """Diagnose a recording, given as its folder or read already.

    Parameters
    ----------
    holdout : other recordings that the diagnosis is judged on, instead of sequences of this one.
    seed : of thresholds and of the choice of held-out sequences; the same seed, the same diagnosis.
    jobs : worker processes.
    report : hears the name of every step as it begins.

    Raises
    ------
    RecordingError
        With every problem of the files, or if nothing near the nominal manipulator is in balance under the loads.
    """
    whole, *others = [each if isinstance(each, Recording) else load_recording(each) for each in (recording, *holdout)]
    with together(jobs) as in_workers:
        diagnosis = stages.diagnose(whole, seed=seed, report=report, hold_out=not others, each=in_workers)
    if not others:
        return diagnosis
    carried = {other.name: (other, on_other(diagnosis, other)) for other in others}
    remarks = [f"{name}: {text}" for name, (_, prediction) in carried.items() for text in prediction.left_behind]
    return replace(diagnosis, heldout=pooled(list(carried.values())), remarks=(*diagnosis.remarks, *remarks))


def pooled(judged: Sequence[tuple[Recording, Carried]]) -> HeldOut:
    """Several recordings as one: sequences named after their recording, mean squares over all readings."""
    positions = [int((recording.readings.kind <= 1).sum()) for recording, _ in judged]
    angles = [recording.readings.count - count for (recording, _), count in zip(judged, positions, strict=True)]
    held = [carried.heldout for _, carried in judged]

    def rms(name: str) -> float | None:
        counts = positions if name.endswith("_m") else angles
        known = [(getattr(one, name), n) for one, n in zip(held, counts, strict=True) if getattr(one, name) is not None]
        return float(np.sqrt(sum(v**2 * n for v, n in known) / sum(n for _, n in known))) if known else None

    return HeldOut(
        sequences=tuple(f"{recording.name}: {name}" for recording, _ in judged for name in recording.sequences),
        rmse_calibrated_m=rms("rmse_calibrated_m"),
        rmse_explained_m=rms("rmse_explained_m"),
        noise_m=rms("noise_m"),
        rmse_calibrated_rad=rms("rmse_calibrated_rad"),
        rmse_explained_rad=rms("rmse_explained_rad"),
        noise_rad=rms("noise_rad"),
        chi2_calibrated=sum(one.chi2_calibrated for one in held),
        chi2_explained=sum(one.chi2_explained for one in held),
        readings=sum(one.readings for one in held),
    )
