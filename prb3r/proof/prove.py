"""The benchmark: draw and seal, record, diagnose, open, score."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.proof.concealed.composition import drawn_design, flavours, labels_of, requests
from prb3r.proof.concealed.design import Design, LoadSteps
from prb3r.proof.concealed.labels import Label
from prb3r.proof.concealed.recordings import bias_of
from prb3r.proof.concealed.sealing import Seal
from prb3r.proof.judging.experiments import promising, resolved, tested
from prb3r.proof.judging.goals import Goal
from prb3r.proof.judging.intervals import Score, share_of
from prb3r.proof.judging.methods import METHODS
from prb3r.proof.judging.missed import miss_of
from prb3r.proof.judging.opened import OpenedCase
from prb3r.proof.judging.real_scores import REAL_GOALS, REAL_INFORMATION
from prb3r.proof.judging.scores import FOLLOWED, GOALS, INFORMATION
from prb3r.proof.judging.verdict import Verdict
from prb3r.proof.settings import SETTINGS
from prb3r.proof.tasks import RecordingTask, VerdictTask, answer, record
from prb3r.recording.recording import Recording
from prb3r.runs.journal import Journal, Stages
from prb3r.runs.provenance import environment, fingerprint

MAIN = "diagnose"
"""The method that is proved."""


@dataclass(frozen=True)
class Concealed:
    """Designs, recordings and the labels under seal."""

    seed: int
    designs: tuple[Design, ...]
    seal: Seal
    tasks: tuple[RecordingTask, ...]
    """By case.  They hold the truth: nothing of them but the recording reaches a method."""
    recordings: tuple[Recording | str, ...]
    """By case; why there is none."""

    def verdict_task(self, case: int, method: str) -> VerdictTask:
        """Of a case and the method that is to judge it."""
        return VerdictTask(
            case, self.recordings[case], self._without(case), method, self.seed, targets=self._targets(case)
        )

    def is_real(self, case: int) -> bool:
        """Whether a recording is of a rig with imperfections."""
        return self.tasks[case].design.flavour.is_real

    def experiment(self, verdict: Verdict) -> RecordingTask | None:
        """The recording again, with the experiment that a verdict proposes; None if it promises nothing."""
        if (proposal := promising(verdict)) is None:
            return None
        task = self.tasks[verdict.case]
        if task.design.flavour.is_real:
            return None
        return replace(task, extra=_with_tip_loads(task.design, proposal.steps))

    def second_task(self, case: int, recording: Recording | str) -> VerdictTask:
        """The diagnosis once more of a case, whose `recording` now holds the experiment that its first verdict proposed
        (or is the reason why that could not be recorded)."""
        return VerdictTask(case, recording, self._without(case), MAIN, self.seed)

    def _targets(self, case: int) -> tuple[Mapping[str, Any], ...]:
        """What is asked beyond the verdict: other loads and another design, without what is true there."""
        label = self.tasks[case].label
        return () if label.blunder else label.targets

    def _without(self, case: int) -> frozenset[str]:
        """Kinds taken out of the library of the diagnosis."""
        return frozenset(self.tasks[case].label.without)

    def opened(self, verdicts: Iterable[Verdict]) -> list[OpenedCase]:
        """Every verdict with its label.

        Raises
        ------
        EngineError
            If there is a case without a verdict.
        """
        verdicts = list(verdicts)
        labels = {label.case: label for label in self.seal.opened({verdict.case for verdict in verdicts})}
        return [
            OpenedCase(label, v, self._friction(label), miss_of(self.designs[label.design], label, v))
            for v in verdicts
            for label in [labels[v.case]]
        ]

    def _friction(self, label: Label) -> float:
        """Friction coefficient that a recording's rig has: the nominal one times the concealed factor."""
        return self.designs[label.design].friction * float(np.exp(label.constants[1]))


@dataclass(frozen=True)
class Proof:
    """All that a run has to show."""

    seed: int
    digest: str
    """Hash of the labels, known before the first verdict."""
    designs: tuple[Design, ...]
    bias: tuple[float, ...]
    """Whitened norm of engine less rig, of each design."""
    cases: Mapping[str, tuple[OpenedCase, ...]]
    """By method."""
    followed: tuple[tuple[OpenedCase, Verdict], ...]
    """Ambiguous verdicts and those after the proposed experiment."""
    seconds: float
    environment: Mapping[str, Any]

    @property
    def main(self) -> tuple[OpenedCase, ...]:
        """The opened cases of the diagnosis, none of its steps left out: those on which goals are measured."""
        return self.cases[MAIN]

    def scores(self, method: str = MAIN) -> list[tuple[Goal, Score]]:
        """Each goal of the table with the score of a method, then what is told for information."""
        measured = [(goal, goal.measure(self.cases[method])) for goal in (*GOALS, *INFORMATION)]
        after = share_of([resolved(*pair) for pair in self.followed if tested(pair[0])] if method == MAIN else [])
        real = [(goal, goal.measure(self.cases[method])) for goal in (*REAL_GOALS, *REAL_INFORMATION)]
        return [*measured[: len(GOALS)], (FOLLOWED, after), *measured[len(GOALS) :], *real]


def run_proof(
    cases: int,
    seed: int,
    jobs: int,
    say: Callable[[str], None] = lambda text: None,
    kept: Path | None = None,
    classes: Sequence[str] = (),
) -> Proof:
    """Run the benchmark.

    Parameters
    ----------
    cases : recordings of a run.
    seed : of everything; the same seed, the same scores.
    jobs : worker processes.
    say : hears what is under way, the hash of the labels among it.
    kept : file of what is there already if the run was interrupted; removed at the end.
    classes : of recordings; empty: all.

    Raises
    ------
    EngineError
        If `kept` cannot be written.
    SpecError
        If there is no such class.
    """
    known = SETTINGS.population.shares
    if unknown := [name for name in classes if name not in known]:
        problems = (Problem(name, f"is no class of recordings{did_you_mean(name, known)}") for name in unknown)
        raise SpecError(*problems)
    stages = stages_of(cases, seed, jobs, say, kept, classes)
    concealed = concealed_recordings(cases, seed, stages, classes)
    bench = [design for design in concealed.designs if not design.flavour.is_real]
    bias = stages.results("bias", bias_of, bench)
    say("verdicts")
    compared = SETTINGS.protocol.compared
    asked = [
        concealed.verdict_task(case, method)
        for case in range(cases)
        for method in (METHODS if case % compared == 0 and not concealed.is_real(case) else (MAIN,))
    ]
    verdicts = stages.results("verdicts", answer, asked)
    again = [(v.case, task) for v in verdicts if v.method == MAIN and (task := concealed.experiment(v)) is not None]
    say(f"{len(again)} proposed experiments")
    repeated = stages.results("experiments", record, [task for _, task in again])
    more = [concealed.second_task(case, recording) for (case, _), recording in zip(again, repeated, strict=True)]
    second = stages.results("answers", answer, more)
    opened = concealed.opened(verdicts)
    by_method = {method: tuple(case for case in opened if case.verdict.method == method) for method in METHODS}
    first = {case.label.case: case for case in by_method[MAIN]}
    proof = Proof(
        seed,
        concealed.seal.digest,
        concealed.designs,
        tuple(bias),
        by_method,
        tuple((first[verdict.case], verdict) for verdict in second),
        stages.journal.seconds,
        environment(Path("proof")),
    )
    stages.journal.discard()
    return proof


def stages_of(
    cases: int, seed: int, jobs: int, say: Callable[[str], None], kept: Path | None, classes: Sequence[str] = ()
) -> Stages:
    """Stages that go on where an interrupted run of the same benchmark stopped; arguments as of :func:`run_proof`."""
    journal = Journal(kept, f"{fingerprint('recording', 'diagnosis', 'proof')} {cases} {seed} {sorted(classes)}")
    return Stages(journal, jobs, say)


def concealed_recordings(cases: int, seed: int, stages: Stages, classes: Sequence[str] = ()) -> Concealed:
    """Draw designs and labels, seal the labels, and record; the hash of the labels is said before the recordings."""
    numbered = [(seed, k, flavour) for k, flavour in enumerate(flavours(cases, classes))]
    stages.say(f"{len(numbered)} designs")
    designs = stages.results("designs", drawn_design, numbered)
    asked = requests(seed, cases, designs, classes)
    by_design = [(design, [request for request in asked if request.design == k]) for k, design in enumerate(designs)]
    stages.say(f"{cases} labels; what can be told apart is computed with the rig")
    labels = [label for part in stages.results("labels", labels_of, by_design) for label in part]
    labels.sort(key=lambda label: label.case)
    seal = Seal(labels)
    stages.say(f"labels sealed, SHA-256 {seal.digest}")
    stages.say("recordings")
    tasks = tuple(RecordingTask(designs[label.design], label) for label in labels)
    return Concealed(seed, tuple(designs), seal, tasks, tuple(stages.results("recordings", record, tasks)))


def _with_tip_loads(design: Design, steps: Sequence[Mapping[str, float]]) -> LoadSteps:
    """Proposed steps with the load columns of a design."""
    tip = {"tip_x_n": 0.0, "tip_y_n": 0.0} if "tip_x_n" in design.program[0][0] else {}
    return tuple({**tip, **step} for step in steps)
