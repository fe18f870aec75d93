"""Sensitivity of the benchmark's scores to each number among the settings of the diagnosis.

The recordings are made once.  With a variant of the settings only those recordings are diagnosed again in whose first
diagnosis the number was read: on the others it can change nothing.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

from prb3r.diagnosis.settings import Settings
from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.proof.judging.goals import Goal
from prb3r.proof.judging.intervals import Score
from prb3r.proof.judging.opened import OpenedCase
from prb3r.proof.judging.real_scores import REAL_GOALS
from prb3r.proof.judging.scores import GOALS
from prb3r.proof.judging.verdict import Verdict
from prb3r.proof.prove import MAIN, answer, concealed_recordings, stages_of
from prb3r.proof.settings import SETTINGS
from prb3r.proof.tasks import VerdictTask


@dataclass(frozen=True, eq=False)
class NotingSettings(Settings):
    """Settings that note the names of those that are read.

    Making a changed copy (`replace`) counts as reading all of them, so that none that matters is missed.
    """

    names: set[str] = field(default_factory=set)
    """Names of the settings read so far, from this object and from copies of it."""

    def __getattribute__(self, name: str) -> Any:
        """The attribute; its name is noted if it is a setting."""
        if name in Settings.__dataclass_fields__:
            object.__getattribute__(self, "names").add(name)
        return object.__getattribute__(self, name)

    def plain(self) -> dict[str, Any]:
        """The settings as a dictionary; nothing is noted, since writing settings down does not use them."""
        values = {entry.name: object.__getattribute__(self, entry.name) for entry in fields(Settings)}
        return asdict(Settings(**values))


class NotedVerdict(NamedTuple):
    """A verdict and the names of the settings on which it could depend."""

    verdict: Verdict
    read: frozenset[str]


def noted_answer(task: VerdictTask) -> NotedVerdict:
    """The verdict on a task with the default settings, and the names of those that were read on the way."""
    settings = NotingSettings()
    verdict = answer(task._replace(settings=settings))
    return NotedVerdict(verdict, frozenset(settings.names))


class Variant(NamedTuple):
    """Settings of which one number has moved."""

    field: str
    """Name of the setting."""
    value: float
    """Value to which it was moved."""
    settings: Settings


@dataclass(frozen=True)
class VariantScores:
    """Scores with one variant of the settings."""

    field: str
    """Name of the setting that was moved, to `value`."""
    value: float
    scores: tuple[tuple[Goal, Score], ...]
    changed: int
    """Number of recordings on which the verdict, or what it names, differs from that with the default settings."""
    read: int
    """Number of recordings in whose diagnosis the setting was read."""


@dataclass(frozen=True)
class SettingsSweep:
    """All variants of the settings, judged on the same recordings."""

    seed: int
    digest: str
    """Hash of the labels, known before the first verdict."""
    cases: int
    """Number of recordings."""
    settings: Settings
    """The default settings."""
    scores: tuple[tuple[Goal, Score], ...]
    """Scores with the default settings."""
    lower: tuple[VariantScores, ...]
    """Scores with each setting moved down."""
    higher: tuple[VariantScores, ...]
    """Scores with each setting moved up, in the same order."""
    seconds: float


def numeric_settings(settings: Settings) -> dict[str, float]:
    """Names and values of the settings that are a single number; truth values are left out."""
    values = {field.name: getattr(settings, field.name) for field in fields(settings)}
    return {name: v for name, v in values.items() if isinstance(v, int | float) and not isinstance(v, bool)}


def moved(value: float, share: float) -> float:
    """A number moved by a share of itself, up or down.

    A whole number moves by one at least.  A value from 0.5 to 1 that the move up would carry to one or beyond moves by
    the same share of its distance to one, so that it stays below one.
    """
    if isinstance(value, int):
        step = max(round(abs(share * value)), 1)
        return value + step if share > 0 else value - step
    if 0.5 < value < 1 <= value * (1 + abs(share)):
        return 1 - (1 - value) * (1 - share)
    return value * (1 + share)


def variants(settings: Settings, share: float, only: Collection[str] = ()) -> Iterator[Variant]:
    """For each number among the settings (or each of `only`), the settings with it moved by a share of itself."""
    for name, value in numeric_settings(settings).items():
        if not only or name in only:
            to = moved(value, share)
            change: dict[str, Any] = {name: to}
            yield Variant(name, to, replace(settings, **change))


def run_sweep(
    cases: int,
    seed: int,
    jobs: int,
    say: Callable[[str], None] = lambda text: None,
    kept: Path | None = None,
    only: Sequence[str] = (),
) -> SettingsSweep:
    """Judge the same concealed recordings with every variant of the settings.

    Parameters
    ----------
    only : names of the settings that move; empty: all that are one number.

    The other parameters are those of :func:`prb3r.proof.prove.run_proof`.

    Raises
    ------
    SpecError
        If a name in `only` is no number among the settings.
    EngineError
        If `kept` cannot be written.
    """
    settings, share = Settings(), SETTINGS.protocol.sweep_share
    known = numeric_settings(settings)
    if unknown := [name for name in only if name not in known]:
        problems = (Problem(name, f"is no number among the settings{did_you_mean(name, known)}") for name in unknown)
        raise SpecError(*problems)
    stages = stages_of(cases, seed, jobs, say, kept)
    concealed = concealed_recordings(cases, seed, stages)
    tasks = [concealed.verdict_task(case, MAIN) for case in range(cases)]
    say("verdicts, and which settings they read")
    noted = stages.results("noted", noted_answer, tasks)
    moves = [variant for sign in (-1, 1) for variant in variants(settings, sign * share, only)]
    asked = [(k, case) for k, move in enumerate(moves) for case in range(cases) if move.field in noted[case].read]
    say(f"{len(moves)} variants of the settings, {len(asked)} verdicts")
    stage = " ".join(["moved", *sorted(only)])  # numbers of the tasks go by what moves
    answers = stages.results(stage, answer, [tasks[case]._replace(settings=moves[k].settings) for k, case in asked])
    by_move: list[dict[int, Verdict]] = [{} for _ in moves]
    for (k, case), verdict in zip(asked, answers, strict=True):
        by_move[k][case] = verdict
    base = [entry.verdict for entry in noted]

    def scored(variant: Variant, renewed: dict[int, Verdict]) -> VariantScores:
        """Scores of a variant, from its own verdicts and, on all other recordings, the default ones."""
        verdicts = [renewed.get(case, base[case]) for case in range(cases)]
        differing = sum(_said(a) != _said(b) for a, b in zip(base, verdicts, strict=True))
        scores = _scores(concealed.opened(verdicts))
        return VariantScores(variant.field, variant.value, scores, differing, len(renewed))

    every = tuple(map(scored, moves, by_move))
    lower, higher = every[: len(every) // 2], every[len(every) // 2 :]
    seconds = stages.journal.seconds
    stages.journal.discard()
    return SettingsSweep(
        seed, concealed.seal.digest, cases, settings, _scores(concealed.opened(base)), lower, higher, seconds
    )


def _scores(cases: Sequence[OpenedCase]) -> tuple[tuple[Goal, Score], ...]:
    return tuple((goal, goal.measure(cases)) for goal in (*GOALS, *REAL_GOALS))


def _said(verdict: Verdict) -> tuple:
    """The part of a verdict by which two count as equal: its word, and kind and place of every effect that it names."""
    return verdict.verdict, tuple((claim.kind, tuple(claim.place.items())) for claim in verdict.named)
