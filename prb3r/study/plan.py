"""The plan of a study: its checked cases, the keys and items of their results, and the folder that these go to."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from prb3r.errors import Problem, SpecError
from prb3r.model.files.rest import Rest, rest_of
from prb3r.model.files.toml import place_of
from prb3r.model.files.toml_lines import Keys
from prb3r.model.manipulator import load_manipulator
from prb3r.quantities import Quantity
from prb3r.runs.part import KEY_TYPE, first_of_each
from prb3r.runs.parts import Kept, Parts
from prb3r.runs.provenance import fingerprint
from prb3r.runs.store import bytes_hash, content_hash
from prb3r.study.axes import corners, count_cases, first_designs
from prb3r.study.cases import Cases, Family
from prb3r.study.chunk import Chunk
from prb3r.study.columns import column_problems, described, known_columns
from prb3r.study.factors import MAX_CASES
from prb3r.study.metrics.base import Metric
from prb3r.study.resolve import resolve
from prb3r.study.selections import closed_loop_problems, far_bound_problems, lacking_problems, selection_problems
from prb3r.study.spec import Study, load_study

SMALLEST_CHUNK, MOST_CHUNKS = 32, 64
"""Smallest size of a full chunk, cases, and number of chunks above which they grow, as each part costs disk."""
MOST_CORNERED = 8
"""Largest number of searched factors for which all corners of their ranges are checked before a search begins."""
LONG_CHECK = 1000
"""Number of cases from which on progress of checking them is reported."""
MAKE_COLUMNS = ("factor", "metric", "comparison")
"""Parts of a study that make the columns which others name."""
NOT_OF_CASES = (*MAKE_COLUMNS, "fit", "plot", "designs", "requirement", "preference", "title", "question", "timing")
"""Parts of a study without which loads and manipulators of the other cases are what they were."""


class Progress(Protocol):
    """A listener to the progress of a study, counted in cases or, where the cases have clouds, in their loads."""

    def begin(self, name: str, cases: int, done: int, what: str = "cases") -> None:
        """A study starts; of its `cases`, `done` are stored already.  `what` names what is counted: cases or loads."""

    def advance(self, cases: int, failed: int) -> None:
        """`cases` more are done, `failed` of them without a stable equilibrium or with a failed metric."""

    def end(self) -> None:
        """The study has ended, whether or not it was completed."""


class Silent:
    """A listener that does nothing."""

    def begin(self, name: str, cases: int, done: int, what: str = "cases") -> None: ...

    def advance(self, cases: int, failed: int) -> None: ...

    def end(self) -> None: ...


@dataclass(frozen=True)
class Quiet:
    """A listener to one of several runs that are reported as one: it passes on counts, but no beginning and no end."""

    whole: Progress
    """The listener to all runs together."""

    def begin(self, name: str, cases: int, done: int, what: str = "cases") -> None:
        self.whole.advance(done, 0)

    def advance(self, cases: int, failed: int) -> None:
        self.whole.advance(cases, failed)

    def end(self) -> None: ...


@dataclass(frozen=True)
class Plan:
    """A resolved study: its cases, the items to be computed for each, and the folder of the results."""

    path: Path
    """The study file."""
    study: Study
    cases: Cases
    folder: Path
    """Folder of the results."""
    engine: str = field(default_factory=fingerprint)
    """Hash of the program text, see `fingerprint`; results of another engine are computed anew."""

    @property
    def cables(self) -> tuple[str, ...]:
        """Names of the cables in the table of states."""
        return self.cases.cables

    @cached_property
    def keys(self) -> np.ndarray:
        """(cases,) the key of each case in the parts: 16 bytes, a hash of the settings of a case."""
        keys = np.empty(len(self.cases), KEY_TYPE)
        for family in self.cases.families:
            keys[family.numbers] = family.keys()
        return keys

    @cached_property
    def items(self) -> list[str]:
        """Names of what is computed for every case: outcome, each metric, and last the states if they are kept.

        An item is the engine and a hash of the settings that its columns depend on.
        """
        study = self.study
        wanted: list[Any] = ["outcome", *(metric.model_dump() for metric in study.metric)]
        if study.states != "none":
            wanted.append([study.states, study.state_disks, self.cables])
        return [f"{self.engine} {content_hash(what)[:16]}" for what in wanted]

    @cached_property
    def key(self) -> str:
        """Hash of everything that the tables of cases and states depend on."""
        factors = {
            name: bytes_hash(values) if values.dtype == float else values.tolist()
            for name, values in self.cases.factors.items()
        }
        compared = [comparison.model_dump() for comparison in self.study.comparison]
        return content_hash([self.engine, self.items, factors, compared, bytes_hash(self.keys)])

    @cached_property
    def first_of_its_key(self) -> np.ndarray:
        """(cases,) whether a case is the first one with its key.  Cases of equal settings are computed once for all."""
        return first_of_each(self.keys)

    def missing(self, parts: Parts) -> np.ndarray:
        """(cases, items) whether no part holds an item of a case."""
        return ~np.stack([place.known for place in self.places(parts)], axis=1)

    def places(self, parts: Parts) -> list[Kept]:
        """Where each item of the cases is stored among the parts."""
        return parts.places(self.items, self.keys)

    @property
    def most_cases(self) -> int:
        """Number of its cases; of a search, whose plan has those of the first designs, of all that it may try."""
        search = self.study.search
        if search is None:
            return len(self.cases)
        return len(self.cases) // len(first_designs(self.study)) * search.designs

    def loads(self, wanted: Any = None) -> int:
        """Number of cases, or of the loads of their clouds; of all cases, or of those in the mask `wanted` (cases,)."""
        every = [np.full(len(family), family.loads // len(family)) for family in self.cases.families]
        rows = np.concatenate([family.numbers for family in self.cases.families])
        counts = np.concatenate(every)
        return int(counts.sum() if wanted is None else counts[wanted[rows]].sum())

    def chunks(self, missing: np.ndarray) -> list[Chunk]:
        """Chunks of cases that together compute all missing items; cases of one family stay together where possible.

        The cases of a chunk lack the same items.  Its bounds depend on the cases alone, never on the number of workers.

        Parameters
        ----------
        missing : (cases, items) which items to compute.
        """
        count = int(missing.any(1).sum())
        size = self.study.chunk or max(SMALLEST_CHUNK, -(-count // MOST_CHUNKS))
        disks = None if self.study.state_disks is None else tuple(self.study.state_disks)
        chunks = []
        for lacks, alike in _alike(missing):
            metrics = tuple(m for m, absent in zip(self.study.metric, lacks[1:], strict=False) if absent)
            states = self.study.states if len(lacks) > 1 + len(self.study.metric) and lacks[-1] else "none"
            items = tuple(item for item, absent in zip(self.items, lacks, strict=True) if absent)
            for families in _grouped(self.cases.families, alike, size):
                chunks.append(Chunk(families, metrics, states, disks, self.cables, items))
        return chunks

    @property
    def metric_items(self) -> Iterator[tuple[Metric, str]]:
        """Each metric with the item of its columns."""
        return zip(self.study.metric, self.items[1:], strict=False)

    @property
    def states_item(self) -> str | None:
        """The item of the states; None if the study keeps none."""
        return self.items[-1] if self.study.states != "none" else None

    @property
    def columns(self) -> set[str]:
        """Names of all columns of cases and states that plots, comparisons and wishes may name."""
        return known_columns(self.study, self.cables)

    @property
    def quantities(self) -> list[Quantity]:
        """Unit and meaning of the columns of factors, metrics and comparisons."""
        return described(self.study)


def plan_study(path: str | Path, output: str | Path = "results", progress: Progress | None = None) -> Plan:
    """Read a study file and resolve it to a plan.

    Parameters
    ----------
    output : folder within which the results get a folder named after the study.
    progress : hears of the checking of cases, if there are at least `LONG_CHECK` of them.

    Raises
    ------
    SpecError
        With every problem of the study file, its manipulator and its cases.
    """
    try:
        study, progress = load_study(path), progress or Silent()
    except SpecError as error:
        raise SpecError(*dict.fromkeys([*error.problems, *_problems_of_rest(Path(path))])) from None
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


def _problems_of_rest(path: Path) -> list[Problem]:
    """Problems of the cases of a study file that is refused, as far as its parts that are in order show them.

    Nothing comes back where loads may be wrong, as most problems of cases would then follow from that.
    """
    rest = rest_of(path, Study)
    if rest is None or not rest.left_out <= set(NOT_OF_CASES) or ("factor" in rest.left_out and not _is_loaded(rest)):
        return []
    study, problems, cases = rest.instance, list[Problem](), None
    try:
        cases = resolve(path, study, in_file=rest.in_file)
    except SpecError as error:
        problems += error.problems
    if not rest.left_out & set(MAKE_COLUMNS):
        problems += _problems_of_asked(path, study, cases, rest.in_file)
    return problems


def _is_loaded(rest: Rest[Study]) -> bool:
    """Whether a study gives loads by itself, not by its factors alone."""
    study = rest.instance
    return bool(study.initial or study.step or study.sweep or study.cloud or study.reach)


def _problems_of_asked(
    path: Path, study: Study, cases: Cases | None, in_file: Callable[[Keys], Keys] = lambda keys: keys
) -> Iterator[Problem]:
    """Problems of plots, fits, comparisons and wishes, with lines; `cases` is None where the cases have problems.

    `in_file` is that of `resolve`.
    """
    try:
        cables = cases.cables if cases else load_manipulator(path.parent / study.manipulator).cable_names
    except SpecError:
        return  # it is told as a problem of the cases
    wrong = list(column_problems(study, known_columns(study, cables)))
    if cases is not None:
        checks = (selection_problems, lacking_problems, far_bound_problems, closed_loop_problems)
        wrong += [problem for check in checks for problem in check(study, cases)]
    for keys, what in wrong:
        yield Problem(place_of(path, in_file(keys)), what)


def _alike(missing: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Masks (items,) of what cases lack, each with the mask (cases,) of the cases that lack just that."""
    left = missing.any(1)
    while left.any():
        lacks = missing[left.argmax()]
        alike = (missing == lacks).all(1)
        left &= ~alike
        yield lacks, alike


def _grouped(families: Sequence[Family], wanted: np.ndarray, size: int) -> Iterator[tuple[Family, ...]]:
    """The cases in the mask `wanted` (cases,), in groups of `size` cases; the last group has the rest.

    A family that does not fit into a group is cut.
    """
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
