"""Several recordings diagnosed together: each alone, then all with what their rigs share, then each with the others."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from prb3r.diagnosis.library.groups import groups_of
from prb3r.diagnosis.result.common import Common, common_of
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search.apply import Apply, serially
from prb3r.diagnosis.search.together import Alone, choose_together
from prb3r.diagnosis.stages import Report, Searched, Task, check, without_blunders
from prb3r.errors import Problem, RecordingError


@dataclass(frozen=True, eq=False)
class JointDiagnosis:
    """What several recordings tell together."""

    diagnoses: tuple[Diagnosis, ...]
    """One for each recording, in their order: with what the others say of what they share."""
    common: Common
    """What is shared, and whether the recordings agree on it."""


def diagnose_together(
    tasks: Sequence[Task], report: Report = lambda stage: None, apply: Apply = serially
) -> JointDiagnosis:
    """Diagnose several recordings with what their rigs share.

    Parameters
    ----------
    report : hears the name of every stage as it begins, those of each recording first.
    apply : applies a function to many tasks, in worker processes for instance.

    Raises
    ------
    RecordingError
        If nothing near a nominal manipulator is in balance under its recorded loads.
    """
    found = []
    for task in tasks:
        report(f"set-up of {task.recording.name}")
        try:
            found.append(without_blunders(task, report, apply))
        except ValueError as error:
            raise RecordingError(Problem(task.recording.name, str(error))) from None
    report("together")
    groups = groups_of([searched.tested.doubted.recording for searched, _ in found])
    alone = [Alone(searched.choice, searched.tested.doubted.search) for searched, _ in found]
    together = choose_together(alone, groups)
    diagnoses = []
    for (searched, blunders), each in zip(found, together.each, strict=True):
        doubted = replace(searched.tested.doubted, search=each.search)
        report(f"check of {doubted.recording.name}")
        investigation = check(Searched(replace(searched.tested, doubted=doubted), each.choice))
        if blunders:
            investigation = replace(investigation, verdict="set-up", blunders=blunders)
        diagnoses.append(tell(investigation))
    report("tell")
    return JointDiagnosis(tuple(diagnoses), common_of(together, [diagnosis.name for diagnosis in diagnoses]))
