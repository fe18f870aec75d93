"""Run a study: cases to workers, parts to tables, everything that varies to the manifest.

A run resumes by content: parts are kept under the hash of what they were computed from (cases, metrics, what is
kept, and the program text of the engine), so an unchanged study is a no-op and an interrupted one goes on.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd

from prb3r.quantities import Quantity
from prb3r.runs.engine import run_tasks
from prb3r.runs.files import ensure_writable
from prb3r.runs.parts import Parts
from prb3r.runs.provenance import environment, fingerprint, read_manifest, write_manifest
from prb3r.runs.store import arrow_table, content_hash, read_arrow, write_arrow
from prb3r.runs.tasks import Piece, Workers
from prb3r.study.axes import count_cases
from prb3r.study.cases import Cases, Family
from prb3r.study.columns import check_columns, described
from prb3r.study.compare import fitted_lines, with_comparisons
from prb3r.study.manifest import changes, timing
from prb3r.study.resolve import resolve
from prb3r.study.spec import MAX_CASES, Study, load_study
from prb3r.study.work import CASE_CRASHED, CASE_FAILED, Chunk, blank_columns, solve_chunk, state_columns

SMALLEST_CHUNK, MOST_CHUNKS = 32, 64
"""Cases of a task at least; tasks of a study at most, so that what a part costs on disk does not count."""
LONG_CHECK = 1000
"""Cases from which on progress tells how far checking them is."""


class Progress(Protocol):
    """Something that hears how a run of a study goes."""

    def begin(self, name: str, cases: int, done: int) -> None:
        """A study starts with `done` of its `cases` stored by an earlier run."""

    def advance(self, cases: int, failed: int) -> None:
        """So many more cases are stored, `failed` of them without a converged equilibrium."""

    def end(self) -> None:
        """The study is over, whether or not it got to its end."""


class Silent:
    """A listener that tells nobody."""

    def begin(self, name: str, cases: int, done: int) -> None: ...

    def advance(self, cases: int, failed: int) -> None: ...

    def end(self) -> None: ...


@dataclass(frozen=True)
class Options:
    """How a study is run and where its results go; what is run says the study."""

    output: Path = Path("results")
    workers: Workers = field(default_factory=Workers)
    fresh: bool = False
    """Compute everything anew."""


@dataclass(frozen=True)
class Plan:
    """A study as resolved: what will be computed and where it goes."""

    path: Path
    study: Study
    cases: Cases
    folder: Path

    @cached_property
    def chunks(self) -> list[Chunk]:
        """Bounds depend on the spec alone, never on the workers."""
        study, count = self.study, len(self.cases)
        size = study.chunk or max(SMALLEST_CHUNK, -(-count // MOST_CHUNKS))
        disks = tuple(study.state_disks) if study.state_disks is not None else None
        cables, metrics = self.cables, tuple(study.metric)
        return [
            Chunk(self.cases.between(start, min(start + size, count)), metrics, study.states, disks, cables)
            for start in range(0, count, size)
        ]

    @cached_property
    def cables(self) -> tuple[str, ...]:
        """Names of the cables in the table of states."""
        return tuple(self.cases[0].manipulator().cable_names)

    @cached_property
    def key(self) -> str:
        """Hash of everything that the tables depend on."""
        study = self.study.model_dump(include={"metric", "states", "state_disks", "comparison"})
        columns = {name: values.tolist() for name, values in self.cases.factors.items()}
        families = [[family.numbers.tolist(), b"".join(family.keys()).hex()] for family in self.cases.families]
        return content_hash([fingerprint(), study, columns, families])

    def chunk_key(self, chunk: Chunk) -> str:
        """Hash of all that the tables of a chunk depend on, but for the program."""
        metrics = [metric.model_dump() for metric in chunk.metrics]
        cases = [[family.numbers.tolist(), b"".join(family.keys()).hex()] for family in chunk.families]
        return content_hash([cases, metrics, chunk.states, chunk.state_disks])

    @property
    def columns(self) -> set[str]:
        """All columns of cases and states that plots and comparisons may name."""
        fixed = {*blank_columns(np.zeros(0, np.int64), self.study.metric, "", ""), *self.cases.factors, "broken_cables"}
        compared = {comparison.name for comparison in self.study.comparison}
        states = {f"cable_{name}_n" for name in self.cables} | {"step"}
        return fixed | compared | (states if self.study.states != "none" else set())

    @property
    def quantities(self) -> list[Quantity]:
        """What the columns mean beyond the nomenclature: factors, metrics, comparisons."""
        return described(self.study)


@dataclass(frozen=True)
class Result:
    """A finished study: its table of cases, and what its manifest says."""

    plan: Plan
    cases: pd.DataFrame
    manifest: dict[str, Any]
    computed: int
    """Cases computed in this run; the others were there already."""

    @property
    def folder(self) -> Path:
        """Where tables, manifest, figures and report are."""
        return self.plan.folder

    @property
    def failed(self) -> int:
        """Number of cases without a converged equilibrium."""
        return int((self.cases["outcome"] != "converged").sum())

    def states(self) -> pd.DataFrame | None:
        """The table of states, if the spec keeps any."""
        path = self.folder / "states.parquet"
        return read_arrow(path).to_pandas() if self.plan.study.states != "none" else None


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
    try:
        cases = resolve(path, study, lambda more: progress.advance(more, 0))
    finally:
        progress.end()
    plan = Plan(Path(path), study, cases, Path(output) / study.name)
    check_columns(plan.path, study, plan.columns, plan.quantities)
    return plan


def run_study(path: str | Path, options: Options | None = None, progress: Progress | None = None) -> Result:
    """Run one study file; tables and manifest are in `<output>/<name>` when it returns.

    Raises
    ------
    SpecError
        Before any work, for anything wrong with the input.
    EngineError
        If workers or disk fail; what is already computed stays and the next run goes on from there.
    """
    options, progress = options or Options(), progress or Silent()
    return execute(plan_study(path, options.output, progress), options, progress)


def execute(plan: Plan, options: Options, progress: Progress) -> Result:
    """Run a resolved study; see :func:`run_study`."""
    started = time.perf_counter()
    ensure_writable(plan.folder)
    before = read_manifest(plan.folder)
    kinds = ("cases",) if plan.study.states == "none" else ("cases", "states")
    parts = Parts(plan.folder, plan.key, kinds)
    if options.fresh:
        parts.discard()
    keys = {number: plan.chunk_key(chunk) for number, chunk in enumerate(plan.chunks)}
    todo = {number: chunk for number, chunk in enumerate(plan.chunks) if not parts.has(number, keys[number])}
    waiting = sum(len(chunk.numbers) for chunk in todo.values())
    provenance = {"study": plan.study.name, "key": plan.key, "engine": fingerprint()}
    progress.begin(plan.study.name, len(plan.cases), len(plan.cases) - waiting)

    def keep(number: int, pieces: list[Piece]) -> None:
        tables, failed = tables_of(pieces, plan, provenance)
        parts.save(number, keys[number], tables)
        progress.advance(len(plan.chunks[number].numbers), failed)

    try:
        run_tasks(solve_chunk, todo, keep, options.workers, split=Chunk.single)
    finally:
        progress.end()
    numbers = sorted(keys)
    if "states" in kinds:
        parts.join(numbers, "states")
    else:
        (plan.folder / "states.parquet").unlink(missing_ok=True)
    cases = labelled(plan.cases, pd.concat([parts.load(number, "cases").to_pandas() for number in numbers]))
    relative = any(comparison.relative_to_length for comparison in plan.study.comparison)
    cases = with_comparisons(cases, plan.study, straight_lengths(plan.cases.families) if relative else {})
    columns = {
        name: cases[name].to_numpy() if cases[name].dtype.kind in "fib" else cases[name].tolist() for name in cases
    }
    write_arrow(arrow_table(columns, plan.quantities, provenance), plan.folder / "cases.parquet")
    manifest = {
        "study": plan.study.model_dump(exclude_none=True, by_alias=True),
        "manipulator": plan.cases[0].settings["manipulator"],
        "key": plan.key,
        "engine": fingerprint(),
        "cases": len(plan.cases),
        "outcomes": cases["outcome"].value_counts().to_dict(),
        "fits": fitted_lines(cases, plan.study),
        **environment(plan.path),
    }
    if waiting or before is None or before.get("key") != plan.key:
        manifest["run"] = {"cases_computed": waiting, "seconds": round(time.perf_counter() - started, 3)}
        manifest["timing"] = timing(plan.cases[:]) if plan.study.timing else []
    else:
        manifest |= {name: before[name] for name in ("run", "timing") if name in before}
    manifest["changed"] = changes(before, manifest) if before else []
    write_manifest(plan.folder, manifest)
    return Result(plan, cases, manifest, waiting)


def labelled(cases: Cases, computed: pd.DataFrame) -> pd.DataFrame:
    """Computed columns with those that tell a case from the others: number, factors, broken cables."""
    broken = np.empty(len(cases), object)
    for family in cases.families:
        broken[family.numbers] = ",".join(family.settings["broken"])
    rows = computed["case_id"].to_numpy()
    labels = {name: values[rows] for name, values in cases.factors.items()}
    measured = {name: computed[name].to_numpy() for name in computed if name != "case_id"}
    return pd.DataFrame({"case_id": rows, **labels, "broken_cables": broken[rows], **measured})


def tables_of(pieces: list[Piece], plan: Plan, provenance: Mapping[str, Any]) -> tuple[dict[str, Any], int]:
    """A chunk's tables and how many of its cases have no converged equilibrium."""
    cases, states = [], [state_columns(plan.cables)]
    for piece in pieces:
        if piece.fate == "done":
            cases.append(piece.value[0])
            states.append(piece.value[1])
        else:
            outcome = CASE_CRASHED if piece.fate == "crashed" else CASE_FAILED
            cases.append(blank_columns(piece.task.numbers, plan.study.metric, outcome, piece.reason))
    columns = _stacked(cases)
    tables = {"cases": arrow_table(columns, plan.quantities, provenance)}
    if plan.study.states != "none":
        tables["states"] = arrow_table(_stacked(states), plan.quantities, provenance)
    return tables, int((columns["outcome"] != "converged").sum())


def _stacked(tables: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def straight_lengths(families: Sequence[Family]) -> dict[int, float]:
    """Straight length of the manipulator of every case, m, by number of the case."""
    lengths = {}
    for family in families:
        lengths |= dict.fromkeys(family.numbers.tolist(), family.manipulator().chain().length)
    return lengths


def forecast(plan: Plan) -> tuple[float, int]:
    """Seconds of one core that are still to be spent, from a few cases solved here, and the number of stored cases."""
    kinds = ("cases",) if plan.study.states == "none" else ("cases", "states")
    parts = Parts(plan.folder, plan.key, kinds)
    waiting = [c for n, c in enumerate(plan.chunks) if not parts.has(n, plan.chunk_key(c))]
    count = sum(len(chunk.numbers) for chunk in waiting)
    if not count:
        return 0.0, len(plan.cases)
    cases = [chunk.single()[0] for chunk in waiting[:: max(1, len(waiting) // 3)][:4]]
    solve_chunk(cases[0])  # compiles
    begin = time.perf_counter()
    for case in cases:
        solve_chunk(case)
    return (time.perf_counter() - begin) / len(cases) * count, len(plan.cases) - count
