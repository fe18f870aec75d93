"""From the files of a recording to its diagnosis."""

from collections.abc import Sequence
from pathlib import Path

from prb3r.errors import Problem, RecordingError
from prb3r.recording import diagnose as core
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Recording


def diagnose(
    recording: Recording | str | Path,
    *,
    holdout: Sequence[Recording | str | Path] = (),
    seed: int = 0,
    report: core.Report = lambda step: None,
) -> core.Diagnosis:
    """Diagnose a recording, given as its folder or read already.

    Parameters
    ----------
    holdout : other recordings that the diagnosis is judged on, instead of sequences of this one.
    seed : of thresholds and of the choice of held-out sequences; the same seed, the same diagnosis.
    report : hears the name of every step as it begins.

    Raises
    ------
    RecordingError
        With every problem of the files, or if nothing near the nominal manipulator is in balance under the loads.
    """
    if holdout:
        what = "judging on other recordings is not available yet; without it a quarter of the sequences is set aside"
        raise RecordingError(Problem("--holdout", what))
    whole = recording if isinstance(recording, Recording) else load_recording(recording)
    return core.diagnose(whole, seed=seed, report=report, hold_out=not holdout)
