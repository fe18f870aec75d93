"""Run a study: cases to workers, parts to tables, everything that varies to the manifest.

A run resumes by content: parts are kept under the hash of what they were computed from (cases, metrics, what is
kept, and the program text of the engine), so an unchanged study is a no-op and an interrupted one goes on.
"""

import json
import time
from collections.abc import Mapping
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
from prb3r.study.cases import Case, resolve
from prb3r.study.columns import check_columns, described
from prb3r.study.compare import fitted_lines, with_comparisons
from prb3r.study.manifest import changes, timing
from prb3r.study.spec import Study, load_study
from prb3r.study.work import CASE_CRASHED, CASE_FAILED, Chunk, blank_row, solve_chunk


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
    cases: list[Case]
    folder: Path

    @cached_property
    def chunks(self) -> list[Chunk]:
        """Bounds depend on the spec alone, never on the workers."""
        study, size = self.study, self.study.chunk
        cables = tuple(self.cases[0].manipulator().cable_names)
        disks = tuple(study.state_disks) if study.state_disks is not None else None
        metrics = tuple(study.metric)
        return [
            Chunk(tuple(self.cases[start : start + size]), metrics, study.states, disks, cables)
            for start in range(0, len(self.cases), size)
        ]

    @cached_property
    def key(self) -> str:
        """Hash of everything that the tables depend on."""
        return content_hash([fingerprint(), [self.chunk_key(chunk) for chunk in self.chunks]])

    def chunk_key(self, chunk: Chunk) -> str:
        """Hash of all that the tables of a chunk depend on, but for the program."""
        metrics = [metric.model_dump() for metric in chunk.metrics]
        cases = [[case.number, case.factors, case.settings] for case in chunk.cases]
        return content_hash([cases, metrics, chunk.states, chunk.state_disks])

    @property
    def columns(self) -> set[str]:
        """All columns of cases and states that plots and comparisons may name."""
        fixed = set(blank_row(self.cases[0], tuple(self.study.metric), "", ""))
        compared = {comparison.name for comparison in self.study.comparison}
        cables = {f"cable_{name}_n" for name in self.chunks[0].cables}
        return fixed | compared | (cables | {"step"} if self.study.states != "none" else set())

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


def plan_study(path: str | Path, output: str | Path = "results") -> Plan:
    """Read and resolve a study.

    Raises
    ------
    SpecError
        With every problem of the study file, its manipulator and its cases.
    """
    study = load_study(path)
    cases = resolve(path, study)
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
    return execute(plan_study(path, options.output), options, progress)


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
    waiting = sum(len(chunk.cases) for chunk in todo.values())
    provenance = {"study": plan.study.name, "key": plan.key, "engine": fingerprint()}
    progress.begin(plan.study.name, len(plan.cases), len(plan.cases) - waiting)

    def keep(number: int, pieces: list[Piece]) -> None:
        tables, failed = tables_of(pieces, plan, provenance)
        parts.save(number, keys[number], tables)
        progress.advance(len(plan.chunks[number].cases), failed)

    try:
        run_tasks(solve_chunk, todo, keep, options.workers, split=Chunk.single)
    finally:
        progress.end()
    numbers = sorted(keys)
    if "states" in kinds:
        parts.join(numbers, "states")
    else:
        (plan.folder / "states.parquet").unlink(missing_ok=True)
    cases = pd.concat([parts.load(number, "cases").to_pandas() for number in numbers], ignore_index=True)
    cases = with_comparisons(cases, plan.study, straight_lengths(plan.cases))
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
        manifest["timing"] = timing(plan.cases) if plan.study.timing else []
    else:
        manifest |= {name: before[name] for name in ("run", "timing") if name in before}
    manifest["changed"] = changes(before, manifest) if before else []
    write_manifest(plan.folder, manifest)
    return Result(plan, cases, manifest, waiting)


def tables_of(pieces: list[Piece], plan: Plan, provenance: Mapping[str, Any]) -> tuple[dict[str, Any], int]:
    """A chunk's tables and how many of its cases have no converged equilibrium."""
    metrics, rows, states = tuple(plan.study.metric), [], []
    for piece in pieces:
        if piece.fate == "done":
            rows += piece.value[0]
            states += piece.value[1]
        else:
            outcome = CASE_CRASHED if piece.fate == "crashed" else CASE_FAILED
            rows += [blank_row(case, metrics, outcome, piece.reason) for case in piece.task.cases]
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    tables = {"cases": arrow_table(columns, plan.quantities, provenance)}
    if plan.study.states != "none":
        tables["states"] = arrow_table(_stacked(states, plan), plan.quantities, provenance)
    return tables, sum(row["outcome"] != "converged" for row in rows)


def _stacked(states: list[dict], plan: Plan) -> dict[str, Any]:
    names = ["case_id", "step", "disk", "x_m", "y_m", "angle_rad", *(f"cable_{c}_n" for c in plan.chunks[0].cables)]
    empty = {name: np.zeros(0, np.int64 if name in ("case_id", "step", "disk") else float) for name in names}
    return {name: np.concatenate([empty[name], *(state[name] for state in states)]) for name in names}


def straight_lengths(cases: list[Case]) -> dict[int, float]:
    """Straight length of the manipulator of every case, m, by number of the case."""
    known: dict[str, float] = {}
    lengths = {}
    for case in cases:
        text = json.dumps(case.settings["manipulator"], sort_keys=True)
        if text not in known:
            known[text] = case.manipulator().chain().length
        lengths[case.number] = known[text]
    return lengths


def forecast(plan: Plan) -> tuple[float, int]:
    """Seconds of one core that are still to be spent, from a few cases solved here, and the number of stored cases."""
    kinds = ("cases",) if plan.study.states == "none" else ("cases", "states")
    parts = Parts(plan.folder, plan.key, kinds)
    waiting = [c for n, c in enumerate(plan.chunks) if not parts.has(n, plan.chunk_key(c))]
    cases = [single for chunk in waiting for single in chunk.single()]
    if not cases:
        return 0.0, len(plan.cases)
    solve_chunk(cases[0])  # compiles
    sample = cases[:: max(1, len(cases) // 3)][:4]
    begin = time.perf_counter()
    for single in sample:
        solve_chunk(single)
    return (time.perf_counter() - begin) / len(sample) * len(cases), len(plan.cases) - len(cases)
