"""The benchmark: draws designs and labels, seals the labels, records, diagnoses, opens the labels and scores."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.model.files.cells import count
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
"""Name of the method whose scores are held against the goals: the diagnosis itself."""


@dataclass(frozen=True)
class Concealed:
    """Designs and recordings of a run, and their labels under seal."""

    seed: int
    designs: tuple[Design, ...]
    seal: Seal
    tasks: tuple[RecordingTask, ...]
    """Tasks by which the recordings were made, by case.  They hold the labels and are given to no method."""
    recordings: tuple[Recording | str, ...]
    """The recording of each case, or the reason why there is none."""

    def verdict_task(self, case: int, method: str) -> VerdictTask:
        """The task of a method to judge a case."""
        return VerdictTask(
            case, self.recordings[case], self._without(case), method, self.seed, targets=self._targets(case)
        )

    def is_real(self, case: int) -> bool:
        """Whether a case is of a real rig, one with imperfections."""
        return self.tasks[case].design.flavour.is_real

    def experiment(self, verdict: Verdict) -> RecordingTask | None:
        """The task to record a case again with the experiment that its verdict proposes.

        None if no proposal promises enough, and for real rigs.
        """
        if (proposal := promising(verdict)) is None:
            return None
        task = self.tasks[verdict.case]
        if task.design.flavour.is_real:
            return None
        return replace(task, extra=_with_tip_loads(task.design, proposal.steps))

    def second_task(self, case: int, recording: Recording | str) -> VerdictTask:
        """The task to diagnose a case once more, from a `recording` with the experiment that its first verdict proposed
        (or the reason why that could not be recorded)."""
        return VerdictTask(case, recording, self._without(case), MAIN, self.seed)

    def _targets(self, case: int) -> tuple[Mapping[str, Any], ...]:
        """Other loads and another design to predict, without the truth about them; none where a blunder was made."""
        label = self.tasks[case].label
        return () if label.blunder else label.targets

    def _without(self, case: int) -> frozenset[str]:
        """Kinds of effect that are taken out of the library of the diagnosis for a case."""
        return frozenset(self.tasks[case].label.without)

    def opened(self, verdicts: Iterable[Verdict]) -> list[OpenedCase]:
        """Every verdict with its label and the errors of its predictions.

        Raises
        ------
        EngineError
            If there is a case without a verdict: the seal stays closed.
        """
        verdicts = list(verdicts)
        labels = {label.case: label for label in self.seal.opened({verdict.case for verdict in verdicts})}
        return [
            OpenedCase(label, v, self._friction(label), miss_of(self.designs[label.design], label, v))
            for v in verdicts
            for label in [labels[v.case]]
        ]

    def _friction(self, label: Label) -> float:
        """True friction coefficient of a recording's rig: the nominal one times the concealed factor."""
        return self.designs[label.design].friction * float(np.exp(label.constants[1]))


@dataclass(frozen=True)
class Proof:
    """The results of a run."""

    seed: int
    digest: str
    """Hash of the labels, known before the first verdict."""
    designs: tuple[Design, ...]
    bias: tuple[float, ...]
    """Whitened norm of the difference of engine and rig without effects, for each design of a bench rig."""
    cases: Mapping[str, tuple[OpenedCase, ...]]
    """Opened cases by method."""
    followed: tuple[tuple[OpenedCase, Verdict], ...]
    """Cases of which a promising experiment was carried out, each with the verdict after it."""
    seconds: float
    environment: Mapping[str, Any]

    @property
    def main(self) -> tuple[OpenedCase, ...]:
        """The opened cases of the method `MAIN`, on which goals are measured."""
        return self.cases[MAIN]

    def scores(self, method: str = MAIN) -> list[tuple[Goal, Score]]:
        """Every line of the table with the score of a method: goals and information of bench rigs, then real rigs."""
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
    cases : number of recordings.
    seed : seed of everything that is drawn: the same seed gives the same scores.
    jobs : number of worker processes.
    say : is called with messages on the progress, the hash of the labels among them.
    kept : file for the results so far, from which an interrupted run goes on; removed at the end.
    classes : classes of recordings; empty: all.

    Raises
    ------
    EngineError
        If `kept` cannot be written.
    SpecError
        If a class is unknown.
    """
    known = SETTINGS.population.shares
    if unknown := [name for name in classes if name not in known]:
        all_of_them = f"; the classes are {', '.join(known)}"
        problems = (Problem(n, f"is no class of recordings{did_you_mean(n, known) or all_of_them}") for n in unknown)
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
    """Stages of a run with its journal, so that they go on where an interrupted run of the same benchmark stopped.

    The arguments are those of :func:`run_proof`.
    """
    journal = Journal(kept, f"{fingerprint('recording', 'diagnosis', 'proof')} {cases} {seed} {sorted(classes)}")
    return Stages(journal, jobs, say)


def concealed_recordings(cases: int, seed: int, stages: Stages, classes: Sequence[str] = ()) -> Concealed:
    """Draw designs and labels, seal the labels and make the recordings; the labels' hash is announced before these."""
    numbered = [(seed, k, flavour) for k, flavour in enumerate(flavours(cases, classes))]
    stages.say(count(len(numbered), "design"))
    designs = stages.results("designs", drawn_design, numbered)
    asked = requests(seed, cases, designs, classes)
    by_design = [(design, [request for request in asked if request.design == k]) for k, design in enumerate(designs)]
    stages.say(f"{count(cases, 'label')}; what can be told apart is computed with the rig")
    labels = [label for part in stages.results("labels", labels_of, by_design) for label in part]
    labels.sort(key=lambda label: label.case)
    seal = Seal(labels)
    stages.say(f"labels sealed, SHA-256 {seal.digest}")
    stages.say("recordings")
    tasks = tuple(RecordingTask(designs[label.design], label) for label in labels)
    return Concealed(seed, tuple(designs), seal, tasks, tuple(stages.results("recordings", record, tasks)))


def _with_tip_loads(design: Design, steps: Sequence[Mapping[str, float]]) -> LoadSteps:
    """Proposed steps with zero tip loads where they have none and the design's table has columns for them."""
    tip = {"tip_x_n": 0.0, "tip_y_n": 0.0} if "tip_x_n" in design.program[0][0] else {}
    return tuple({**tip, **step} for step in steps)
