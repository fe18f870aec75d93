"""A study as resolved: what will be computed, under which keys, and where it goes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from prb3r.errors import Problem, SpecError
from prb3r.model.files.toml import place_of
from prb3r.model.manipulator import load_manipulator
from prb3r.quantities import Quantity
from prb3r.runs.parts import Parts
from prb3r.runs.provenance import fingerprint
from prb3r.runs.store import content_hash
from prb3r.study.axes import corners, count_cases
from prb3r.study.cases import Cases, Family
from prb3r.study.chunk import Chunk
from prb3r.study.columns import column_problems, described, known_columns
from prb3r.study.factors import MAX_CASES
from prb3r.study.metrics.base import Metric
from prb3r.study.resolve import resolve
from prb3r.study.selections import selection_problems
from prb3r.study.spec import Study, load_study

SMALLEST_CHUNK, MOST_CHUNKS = 32, 64
"""Cases of a task at least; tasks of a study at most, so that what a part costs on disk does not count."""
MOST_CORNERED = 8
"""Up to so many searched factors, all corners of their ranges are checked before a search begins."""
LONG_CHECK = 1000
"""Cases from which on progress tells how far checking them is."""


class Progress(Protocol):
    """Something that hears how a run of a study goes: cases, or the loads of clouds, each of which counts as one."""

    def begin(self, name: str, cases: int, done: int, what: str = "cases") -> None:
        """A study starts with `done` of its `cases` stored by an earlier run; `what` they are: cases or loads."""

    def advance(self, cases: int, failed: int) -> None:
        """So many more cases are computed, `failed` of them without a converged equilibrium."""

    def end(self) -> None:
        """The study is over, whether or not it got to its end."""


class Silent:
    """A listener that tells nobody."""

    def begin(self, name: str, cases: int, done: int, what: str = "cases") -> None: ...

    def advance(self, cases: int, failed: int) -> None: ...

    def end(self) -> None: ...


@dataclass(frozen=True)
class Quiet:
    """Passes on how many cases are stored, of several runs that are told as one."""

    whole: Progress

    def begin(self, name: str, cases: int, done: int, what: str = "cases") -> None:
        self.whole.advance(done, 0)

    def advance(self, cases: int, failed: int) -> None:
        self.whole.advance(cases, failed)

    def end(self) -> None: ...


@dataclass(frozen=True)
class Plan:
    """A study as resolved: what will be computed and where it goes."""

    path: Path
    study: Study
    cases: Cases
    folder: Path
    engine: str = field(default_factory=fingerprint)
    """Hash of the program text that the tables depend on."""

    @cached_property
    def cables(self) -> tuple[str, ...]:
        """Names of the cables in the table of states."""
        return tuple(self.cases[0].manipulator().cable_names)

    @cached_property
    def keys(self) -> list[bytes]:
        """Of each case, in their order, the 16 bytes by which parts know it; they follow from its settings alone."""
        keys = [b""] * len(self.cases)
        for family in self.cases.families:
            for number, key in zip(family.numbers.tolist(), family.keys(), strict=True):
                keys[number] = key
        return keys

    @cached_property
    def items(self) -> list[str]:
        """What is computed of every case: how its solution went, every metric, and the states if they are kept."""
        study = self.study
        wanted: list[Any] = ["outcome", *(metric.model_dump() for metric in study.metric)]
        if study.states != "none":
            wanted.append([study.states, study.state_disks, self.cables])
        return [f"{self.engine} {content_hash(what)[:16]}" for what in wanted]

    @cached_property
    def key(self) -> str:
        """Hash of everything that the tables depend on."""
        factors = {
            name: values.tobytes().hex() if values.dtype == float else values.tolist()
            for name, values in self.cases.factors.items()
        }
        compared = [comparison.model_dump() for comparison in self.study.comparison]
        return content_hash([self.engine, self.items, factors, compared, b"".join(self.keys).hex()])

    @cached_property
    def first_of_its_key(self) -> np.ndarray:
        """(cases,) whether no case before is the same but for its label: one of them is computed for all."""
        numbers = dict[bytes, int]()
        for number, key in enumerate(self.keys):
            numbers.setdefault(key, number)
        first = np.zeros(len(self.keys), bool)
        first[list(numbers.values())] = True
        return first

    def missing(self, parts: Parts) -> np.ndarray:
        """(cases, items) whether an item of a case is not among the parts."""
        known = [parts.place(item, self.keys).known for item in self.items]
        return ~np.stack(known, axis=1)

    def loads(self, wanted: Any = None) -> int:
        """Number of what is to be solved: cases, or the loads of their clouds; of all cases or where a mask holds."""
        every = [np.full(len(family), family.loads // len(family)) for family in self.cases.families]
        rows = np.concatenate([family.numbers for family in self.cases.families])
        counts = np.concatenate(every)
        return int(counts.sum() if wanted is None else counts[wanted[rows]].sum())

    def chunks(self, missing: np.ndarray) -> list[Chunk]:
        """Tasks for the items that are missing; cases of one family stay together as far as they can.

        Bounds depend on the cases alone, never on the workers.
        """
        count = int(missing.any(1).sum())
        size = self.study.chunk or max(SMALLEST_CHUNK, -(-count // MOST_CHUNKS))
        disks = None if self.study.state_disks is None else tuple(self.study.state_disks)
        chunks = []
        for lacks in np.unique(missing[missing.any(1)], axis=0):
            metrics = tuple(m for m, absent in zip(self.study.metric, lacks[1:], strict=False) if absent)
            states = self.study.states if len(lacks) > 1 + len(self.study.metric) and lacks[-1] else "none"
            items = tuple(item for item, absent in zip(self.items, lacks, strict=True) if absent)
            for families in _grouped(self.cases.families, (missing == lacks).all(1), size):
                chunks.append(Chunk(families, metrics, states, disks, self.cables, items))
        return chunks

    @property
    def metric_items(self) -> Iterator[tuple[Metric, str]]:
        """Each metric with the item that its columns belong to."""
        return zip(self.study.metric, self.items[1:], strict=False)

    @property
    def states_item(self) -> str | None:
        """The item of the states, if they are kept."""
        return self.items[-1] if self.study.states != "none" else None

    @property
    def columns(self) -> set[str]:
        """All columns of cases and states that plots and comparisons may name."""
        return known_columns(self.study, self.cables)

    @property
    def quantities(self) -> list[Quantity]:
        """What the columns mean beyond the nomenclature: factors, metrics, comparisons."""
        return described(self.study)


def plan_study(path: str | Path, output: str | Path = "results", progress: Progress | None = None) -> Plan:
    """Read and resolve a study.

    Raises
    ------
    SpecError
        With every problem of the study file, its manipulator and its cases.
    """
    study, progress = load_study(path), progress or Silent()
    if (count := count_cases(study)) < LONG_CHECK:
        progress = Silent()
    progress.begin(f"{study.name}, checking", int(min(count, MAX_CASES)), 0)
    problems: list[Problem] = []
    cases = None
    try:
        cases = resolve(path, study, lambda more: progress.advance(more, 0))
        if 0 < len(study.searched) <= MOST_CORNERED:
            resolve(path, study, designs=corners(study))
    except SpecError as error:
        problems += error.problems
    finally:
        progress.end()
    problems += _problems_of_asked(Path(path), study, cases)
    if problems or cases is None:
        raise SpecError(*dict.fromkeys(problems))
    return Plan(Path(path), study, cases, Path(output) / study.name)


def _problems_of_asked(path: Path, study: Study, cases: Cases | None) -> Iterator[Problem]:
    """What is wrong with plots, fits, comparisons and wishes, with its line, whether or not the cases are in order."""
    try:
        manipulator = cases[0].manipulator() if cases else load_manipulator(path.parent / study.manipulator)
    except SpecError:
        return  # it is told as a problem of the cases
    wrong = list(column_problems(study, known_columns(study, manipulator.cable_names)))
    if cases is not None:
        wrong += selection_problems(study, cases)
    for keys, what in wrong:
        yield Problem(place_of(path, keys), what)


def _grouped(families: Sequence[Family], wanted: np.ndarray, size: int) -> Iterator[tuple[Family, ...]]:
    """The cases that `wanted` (cases,) marks by number, in groups of `size`, the last group with the rest; a family
    that does not fit is cut."""
    group: list[Family] = []
    room = size
    for family in families:
        rows = np.flatnonzero(wanted[family.numbers])
        while len(rows):
            group.append(family.part(rows[:room]))
            rows, room = rows[room:], room - len(group[-1])
            if not room:
                yield tuple(group)
                group, room = [], size
    if group:
        yield tuple(group)
