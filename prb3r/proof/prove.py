"""The benchmark: draw and seal, record, diagnose, open, score."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from prb3r.proof.concealed.composition import drawn_design, flavours, labels_of, requests
from prb3r.proof.concealed.designs import Design, Steps
from prb3r.proof.concealed.labels import Label
from prb3r.proof.concealed.recordings import bias_of, recording_of
from prb3r.proof.concealed.sealing import Seal
from prb3r.proof.judging.intervals import Score, share_of
from prb3r.proof.judging.methods import METHODS, Task, Verdict, judged
from prb3r.proof.judging.opened import Judged
from prb3r.proof.judging.scores import FOLLOWED, GOALS, INFORMATION, Goal, resolved, tested, worth
from prb3r.recording.recording import Recording
from prb3r.runs.engine import run_tasks
from prb3r.runs.journal import Journal
from prb3r.runs.provenance import environment, fingerprint
from prb3r.runs.tasks import Piece, Workers

MAIN = "diagnose"
COMPARED = 10
"""One of so many recordings is judged by the other methods too."""

Say = Callable[[str], None]
T = TypeVar("T")


@dataclass(frozen=True)
class Play:
    """A recording to be made by the bench."""

    design: Design
    label: Label
    extra: Steps = ()


class Asked(NamedTuple):
    """A recording, or why there is none, and who is to judge it."""

    case: int
    recording: Recording | str
    without: frozenset[str]
    method: str
    seed: int


@dataclass(frozen=True)
class Proof:
    """All that a run has to show."""

    seed: int
    digest: str
    designs: tuple[Design, ...]
    bias: tuple[float, ...]
    """Whitened norm of engine less rig, of each design."""
    cases: Mapping[str, tuple[Judged, ...]]
    """By method."""
    followed: tuple[tuple[Judged, Verdict], ...]
    """Ambiguous verdicts and those after the proposed experiment."""
    seconds: float
    environment: Mapping[str, Any]

    @property
    def main(self) -> tuple[Judged, ...]:
        return self.cases[MAIN]

    def scores(self, method: str = MAIN) -> list[tuple[Goal, Score]]:
        """Every line of the table."""
        measured = [(goal, goal.measure(self.cases[method])) for goal in (*GOALS, *INFORMATION)]
        after = share_of([resolved(*pair) for pair in self.followed if tested(pair[0])] if method == MAIN else [])
        return [*measured[: len(GOALS)], (FOLLOWED, after), *measured[len(GOALS) :]]


def prove(cases: int, seed: int, jobs: int, say: Say = lambda text: None, kept: Path | None = None) -> Proof:
    """Run the benchmark.

    Parameters
    ----------
    cases : recordings of a run.
    seed : of everything; the same seed, the same scores.
    say : hears what is under way, the hash of the labels among it.
    kept : file of what is there already if the run was interrupted; removed at the end.

    Raises
    ------
    EngineError
        If `kept` cannot be written.
    """
    journal = Journal(kept, f"{fingerprint('recording', 'diagnosis', 'proof')} {cases} {seed}")
    work = partial(_all, jobs=jobs, say=say, journal=journal)
    numbered = [(seed, k, flavour) for k, flavour in enumerate(flavours(cases))]
    say(f"{len(numbered)} designs")
    designs = work("designs", drawn_design, numbered)
    asked = requests(seed, cases, designs)
    own = [(design, [each for each in asked if each.design == k]) for k, design in enumerate(designs)]
    say(f"{cases} labels; what can be told apart is computed by the bench")
    labels = sorted((label for part in work("labels", labels_of, own) for label in part), key=lambda each: each.case)
    seal = Seal(labels)
    say(f"labels sealed, SHA-256 {seal.digest}")
    bias = work("bias", bias_of, designs)
    say("recordings")
    plays = [Play(designs[label.design], label) for label in labels]
    recordings = work("recordings", recorded, plays)
    say("verdicts")
    tasks = [
        Asked(label.case, recording, frozenset(label.without), method, seed)
        for label, recording in zip(labels, recordings, strict=True)
        for method in (METHODS if label.case % COMPARED == 0 else (MAIN,))
    ]
    verdicts = work("verdicts", answered, tasks)
    again = [
        (each.case, _on(plays[each.case].design, proposal.steps))
        for each in verdicts
        if each.method == MAIN and (proposal := worth(each)) is not None
    ]
    say(f"{len(again)} proposed experiments")
    repeated = work("experiments", recorded, [replace(plays[case], extra=steps) for case, steps in again])
    more = [
        Asked(case, each, frozenset(labels[case].without), MAIN, seed)
        for (case, _), each in zip(again, repeated, strict=True)
    ]
    second = work("answers", answered, more)
    opened = {label.case: label for label in seal.opened({each.case for each in verdicts})}
    found = {
        method: tuple(
            Judged(opened[v.case], v, _friction(designs, opened[v.case])) for v in verdicts if v.method == method
        )
        for method in METHODS
    }
    first = {case.label.case: case for case in found[MAIN]}
    proof = Proof(
        seed,
        seal.digest,
        tuple(designs),
        tuple(bias),
        found,
        tuple((first[each.case], each) for each in second),
        journal.seconds,
        environment(Path("proof")),
    )
    journal.discard()
    return proof


def recorded(play: Play) -> Recording | str:
    """A recording, or why there is none."""
    try:
        return recording_of(play.design, play.label, play.extra)
    except ValueError as error:
        return str(error)


def answered(asked: Asked) -> Verdict:
    """The verdict on a recording; on none, a failure."""
    case, recording, without, method, seed = asked
    if isinstance(recording, str):
        return Verdict(case, method, "failed", reason=f"not recorded: {recording}")
    return judged(Task(case, recording, without, method, seed))


def _on(design: Design, steps: Sequence[Mapping[str, float]]) -> Steps:
    """Proposed steps with the load columns of a design."""
    tip = {"tip_x_n": 0.0, "tip_y_n": 0.0} if "tip_x_n" in design.program[0][0] else {}
    return tuple({**tip, **step} for step in steps)


def _friction(designs: Sequence[Design], label: Label) -> float:
    return designs[label.design].friction * float(np.exp(label.constants[1]))


def _all(
    stage: str, function: Callable[[Any], T], tasks: Sequence[Any], *, jobs: int, say: Say, journal: Journal
) -> list[T]:
    """Results in the order of the tasks; those that are there already are not made again.

    Raises
    ------
    RuntimeError
        If one has none.
    """
    out: dict[int, T] = journal.known(stage)
    told = time.monotonic()

    def keep(number: int, pieces: list[Piece]) -> None:
        nonlocal told
        if pieces[0].fate != "done":
            raise RuntimeError(f"task {number}: {pieces[0].reason}")
        out[number] = pieces[0].value
        journal.add(stage, number, pieces[0].value)
        if time.monotonic() - told > 20:
            told = time.monotonic()
            say(f"{len(out)} of {len(tasks)}")

    run_tasks(function, {k: task for k, task in enumerate(tasks) if k not in out}, keep, Workers(jobs=jobs))
    return [out[k] for k in range(len(tasks))]
