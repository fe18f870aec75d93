"""How the scores of the benchmark move when each number among the settings of the diagnosis moves.

The recordings are made once.  A variant of the settings judges those in whose diagnosis the number was read at all:
on the others it can change nothing.
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
    """Settings that note which of them are read.

    A changed copy (`replace`) reads all of them, so that nothing that was read is missed.
    """

    names: set[str] = field(default_factory=set)
    """What was read so far, of these and of copies."""

    def __getattribute__(self, name: str) -> Any:
        """The value, noted if it is a setting."""
        if name in Settings.__dataclass_fields__:
            object.__getattribute__(self, "names").add(name)
        return object.__getattribute__(self, name)

    def plain(self) -> dict[str, Any]:
        """As of the same settings that note nothing: to write all down is not to use them."""
        values = {entry.name: object.__getattribute__(self, entry.name) for entry in fields(Settings)}
        return asdict(Settings(**values))


class NotedVerdict(NamedTuple):
    """A verdict and the settings that it could depend on."""

    verdict: Verdict
    read: frozenset[str]


def noted_answer(task: VerdictTask) -> NotedVerdict:
    """The verdict with the settings as they are, and the names of those that were read on the way."""
    settings = NotingSettings()
    verdict = answer(task._replace(settings=settings))
    return NotedVerdict(verdict, frozenset(settings.names))


class Variant(NamedTuple):
    """Settings of which one number has moved."""

    field: str
    value: float
    """That it was moved to."""
    settings: Settings


@dataclass(frozen=True)
class VariantScores:
    """What a variant changes."""

    field: str
    value: float
    scores: tuple[tuple[Goal, Score], ...]
    changed: int
    """Recordings on which the verdict, or what is named, is another than with the settings as they are."""
    read: int
    """Recordings in whose diagnosis the setting was read."""


@dataclass(frozen=True)
class SettingsSweep:
    """All variants of the settings, judged on the same recordings."""

    seed: int
    digest: str
    """Hash of the labels, known before the first verdict."""
    cases: int
    settings: Settings
    scores: tuple[tuple[Goal, Score], ...]
    """With the settings as they are."""
    lower: tuple[VariantScores, ...]
    higher: tuple[VariantScores, ...]
    """Of the same fields, in the same order."""
    seconds: float


def numeric_settings(settings: Settings) -> dict[str, float]:
    """Names and values of the settings that are one number each; truth values do not count."""
    values = {field.name: getattr(settings, field.name) for field in fields(settings)}
    return {name: v for name, v in values.items() if isinstance(v, int | float) and not isinstance(v, bool)}


def moved(value: float, share: float) -> float:
    """A number moved by a share of itself, up or down.

    A whole number moves by one at least.  Of a share near one, which the move would carry beyond one, what is left to
    one moves the other way.
    """
    if isinstance(value, int):
        step = max(round(abs(share * value)), 1)
        return value + step if share > 0 else value - step
    if 0.5 < value < 1 <= value * (1 + abs(share)):
        return 1 - (1 - value) * (1 - share)
    return value * (1 + share)


def variants(settings: Settings, share: float, only: Collection[str] = ()) -> Iterator[Variant]:
    """Settings with each number (or those of `only`) moved by a share of itself."""
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
    only : fields that move; empty: all that are one number.

    The other parameters are those of :func:`prb3r.proof.prove.run_proof`.

    Raises
    ------
    SpecError
        If a field of `only` is none of the numbers.
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
    """What two verdicts must share to count as the same: the verdict, and kind and place of what it names."""
    return verdict.verdict, tuple((claim.kind, tuple(claim.place.items())) for claim in verdict.named)
