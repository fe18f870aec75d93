"""Several recordings diagnosed together.

Each is searched alone, then all are fitted with the parameters that their rigs share, then each is checked with what
the others say of these.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from prb3r.diagnosis.blunders import SetUp, without_blunders
from prb3r.diagnosis.check import check
from prb3r.diagnosis.fit.calibrate import OutOfBalance
from prb3r.diagnosis.investigate import STAGES
from prb3r.diagnosis.known import Searched, Task
from prb3r.diagnosis.library.groups import groups_of
from prb3r.diagnosis.result.common import Common, common_of, own_sizes_of
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search.apply import Apply, serially
from prb3r.diagnosis.search.together import Alone, choose_together
from prb3r.diagnosis.stages import Report, coarsened_if_unexplained, framed
from prb3r.errors import Problem, RecordingError
from prb3r.markdown import listed, quoted


@dataclass(frozen=True, eq=False)
class JointDiagnosis:
    """The diagnoses of several recordings, made together."""

    diagnoses: tuple[Diagnosis, ...]
    """One for each recording, in their order; each includes what the others say of shared parameters."""
    common: Common
    """The shared parameters, and whether the recordings agree on them."""


def joint_steps(recordings: Sequence[str]) -> list[str]:
    """The steps that :func:`diagnose_together` reports for recordings of these names, in order."""
    before, after = STAGES[: STAGES.index("check")], STAGES[STAGES.index("check") + 1 :]
    singly = [f"{stage} of {name}" for name in recordings for stage in before]
    return [*singly, "together", *(f"check of {name}" for name in recordings), *after]


def diagnose_together(
    tasks: Sequence[Task], report: Report = lambda stage: None, apply: Apply = serially
) -> JointDiagnosis:
    """Diagnose several recordings with what their rigs share.

    Parameters
    ----------
    report : called with every step of `joint_steps` as it begins.
    apply : applies a function to many tasks, in worker processes for instance.

    Raises
    ------
    RecordingError
        If nothing near a nominal manipulator is in balance under its recorded loads.
    """
    searches = [_alone(task, report, apply) for task in tasks]
    report("together")
    groups = groups_of([alone.searched.tested.doubted.recording for alone in searches])
    alone = [
        Alone(
            coarsened_if_unexplained(searched).choice,
            searched.tested.doubted.search,
            searched.choice.survivors[0].fitted,
        )
        for searched, *_ in searches
    ]
    together = choose_together(alone, groups)
    names = [searched.tested.doubted.recording.name for searched, *_ in searches]
    common, investigations = common_of(together, names), []
    for (searched, blunders, rival, _), joined, name in zip(searches, together.joined, names, strict=True):
        report(f"check of {name}")
        recording = replace(
            searched.tested.doubted.recording,
            modulus_of_several=joined.choice.fitted.model.recording.modulus_of_several,
        )
        doubted = replace(searched.tested.doubted, search=joined.search, recording=recording)
        checked = check(Searched(replace(searched.tested, doubted=doubted), joined.choice), rival)
        said = f"diagnosed together with {listed(quoted([other for other in names if other != name]))}"
        shares = any(name in parameter.recordings for parameter in common.shared)
        said += (
            ": what they share is fitted to all of them" if shares else ", with which it shares nothing that was found"
        )
        checked = replace(checked, remarks=(*checked.remarks, said))
        investigations.append(replace(checked, verdict="set-up", blunders=blunders) if blunders else checked)
    report("tell")
    diagnoses = tuple(map(tell, investigations))
    unexplained = tuple(diagnosis.name for diagnosis in diagnoses if diagnosis.why)
    common = replace(common, unexplained=unexplained, own_sizes=own_sizes_of(common, diagnoses))
    return JointDiagnosis(diagnoses, common)


def _alone(task: Task, report: Report, apply: Apply) -> SetUp:
    """One recording searched by itself, with the blunders of its set-up mended.

    Raises RecordingError as :func:`diagnose_together` does.
    """
    name = task.recording.name
    report(f"set-up of {name}")
    try:
        return without_blunders(framed(task), lambda stage: report(f"{stage} of {name}"), apply)
    except OutOfBalance as error:
        raise RecordingError(Problem(name, str(error))) from None
