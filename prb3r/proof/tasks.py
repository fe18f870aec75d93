"""Tasks of the worker processes: making recordings, and giving verdicts on them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from prb3r.diagnosis.settings import Settings
from prb3r.errors import Prb3rError
from prb3r.proof.concealed.design import Design, LoadSteps
from prb3r.proof.concealed.folder import recording_from_folder
from prb3r.proof.concealed.labels import Label
from prb3r.proof.concealed.recordings import recording_of
from prb3r.proof.judging.methods import MethodTask, verdict_of
from prb3r.proof.judging.verdict import Verdict
from prb3r.recording.recording import Recording


@dataclass(frozen=True)
class RecordingTask:
    """A recording to be made: of a design with what its label says."""

    design: Design
    label: Label
    extra: LoadSteps = ()
    """Steps of one more sequence, on bench rigs only."""


class VerdictTask(NamedTuple):
    """A recording, or the reason why there is none, and the method that is to judge it."""

    case: int
    recording: Recording | str
    without: frozenset[str]
    """Kinds of effect taken out of the library of the diagnosis."""
    method: str
    """Name of the method, one of `METHODS`."""
    seed: int
    settings: Settings = Settings()
    """Settings of the diagnosis."""
    targets: tuple[Mapping[str, Any], ...] = ()
    """Loads and designs for which predictions are asked."""


def record(task: RecordingTask) -> Recording | str:
    """The recording of a task, or as text the reason why there is none: no equilibrium, or a folder that is refused."""
    try:
        if task.design.flavour.is_real:
            return recording_from_folder(task.design, task.label)
        return recording_of(task.design, task.label, task.extra)
    except (ValueError, Prb3rError) as error:
        return str(error)


def answer(task: VerdictTask) -> Verdict:
    """The verdict on a recording; `failed` where there is none."""
    if isinstance(task.recording, str):
        return Verdict(task.case, task.method, "failed", reason=f"not recorded: {task.recording}")
    asked = task.without, task.method, task.seed, task.settings, task.targets
    return verdict_of(MethodTask(task.case, task.recording, *asked))
