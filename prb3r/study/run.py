"""Run a study: cases to workers, parts to tables, everything that varies to the manifest.

A run resumes by case: what is computed is kept under what it was computed from (the case, the metric, what is kept of
its states, and the program text of the engine), so that only what is new is computed, in an unchanged study nothing.
"""

import contextlib
import os
import time
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError
from prb3r.runs.engine import run_tasks
from prb3r.runs.files import clear_left_over, ensure_writable, sole_writer
from prb3r.runs.parts import Columns, Parts, States
from prb3r.runs.provenance import environment, read_manifest, write_manifest
from prb3r.runs.store import arrow_table, read_arrow, write_arrow
from prb3r.runs.tasks import Piece, Workers
from prb3r.study.axes import first_designs
from prb3r.study.cases import Family
from prb3r.study.compare import fitted_lines, with_comparisons
from prb3r.study.designs import designs_of
from prb3r.study.manifest import changes, timing
from prb3r.study.plan import Plan, Progress, Quiet, Silent, plan_study
from prb3r.study.resolve import resolve
from prb3r.study.rigs import Rigs, rigs_of, write_rigs
from prb3r.study.search import Judged, searched_designs
from prb3r.study.tables import cases_frame, write_states
from prb3r.study.work import CASE_CRASHED, CASE_FAILED, Chunk, blank_columns, reason_column, solve_chunk


@dataclass(frozen=True)
class Options:
    """How a study is run and where its results go; what is run says the study."""

    output: Path = Path("results")
    workers: Workers = field(default_factory=Workers)
    fresh: bool = False
    """Compute everything anew."""


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

    @cached_property
    def rigs(self) -> Rigs | None:
        """What the errors of the study do, if it has any."""
        return rigs_of(self.plan.study, self.cases) if self.plan.study.errors else None

    def states(self) -> pd.DataFrame | None:
        """The table of states, if the spec keeps any."""
        path = self.folder / "states.parquet"
        return read_arrow(path).to_pandas() if self.plan.study.states != "none" else None


def solve_study(path: str | Path, options: Options | None = None, progress: Progress | None = None) -> Result:
    """Run one study file; tables and manifest are in `<output>/<name>` when it returns.

    Raises
    ------
    SpecError
        Before any work, for anything wrong with the input.
    EngineError
        If workers or disk fail; what is already computed stays and the next run goes on from there.
    """
    options, progress = options or Options(), progress or Silent()
    plan = plan_study(path, options.output, progress)
    with writing(plan):
        return execute(plan, options, progress)


@contextlib.contextmanager
def writing(plan: Plan) -> Iterator[None]:
    """Keep the folder of a study to this process.

    Raises
    ------
    SpecError
        If nothing can be written there, or if it holds the results of another study file of the same name.
    EngineError
        If another process is writing there.
    """
    ensure_writable(plan.folder)
    with sole_writer(plan.folder):
        clear_left_over(plan.folder)
        refuse_other_spec(plan)
        yield


def refuse_other_spec(plan: Plan) -> None:
    """Raise SpecError if the folder holds the results of another study file that has the same name still."""
    before = read_manifest(plan.folder) or {}
    if not isinstance(before.get("file"), str):
        return
    other = plan.folder / before["file"]
    with contextlib.suppress(OSError, ValueError):
        if not other.samefile(plan.path) and tomllib.loads(other.read_text("utf-8-sig")).get("name") == plan.study.name:
            what = (
                f"{other.resolve()} is named {plan.study.name!r} too, and its results are in {plan.folder}; rename one"
            )
            raise SpecError(Problem(str(plan.path), what))


def execute(plan: Plan, options: Options, progress: Progress) -> Result:
    """Run a resolved study in a folder that is kept to this process; see :func:`solve_study`."""
    started = time.perf_counter()
    before = read_manifest(plan.folder)
    parts = Parts(plan.folder)
    if options.fresh:
        parts.discard()
    if plan.study.search is None:
        computed = brought(plan, parts, options.workers, progress)
    else:
        plan, computed = explored(plan, parts, options.workers, progress)
    provenance = {"study": plan.study.name, "key": plan.key, "engine": plan.engine}
    if plan.states_item:
        write_states(plan, parts, plan.folder / "states.parquet", provenance)
    else:
        (plan.folder / "states.parquet").unlink(missing_ok=True)
    cases = tabulated(plan, parts)
    columns = {
        name: cases[name].to_numpy() if cases[name].dtype.kind in "fib" else cases[name].tolist() for name in cases
    }
    write_arrow(arrow_table(columns, plan.quantities, provenance), plan.folder / "cases.parquet")
    parts.clear(lambda item: not item.startswith(plan.engine))
    manifest = {
        "study": plan.study.model_dump(exclude_none=True, by_alias=True),
        "manipulator": plan.cases[0].settings["manipulator"],
        "key": plan.key,
        "engine": plan.engine,
        "cases": len(plan.cases),
        "outcomes": cases["outcome"].value_counts().to_dict(),
        "fits": fitted_lines(cases, plan.study),
        "file": os.path.relpath(plan.path, plan.folder),
        **environment(plan.path),
    }
    if computed or before is None or before.get("key") != plan.key:
        manifest["run"] = {"cases_computed": computed, "seconds": round(time.perf_counter() - started, 3)}
        manifest["timing"] = timing(plan.cases[:]) if plan.study.timing else []
    else:
        manifest |= {name: before[name] for name in ("run", "timing") if name in before}
    manifest["changed"] = changes(before, manifest) if before else []
    write_manifest(plan.folder, manifest)
    result = Result(plan, cases, manifest, computed)
    write_rigs(result.rigs, plan.folder, provenance)
    return result


def tabulated(plan: Plan, parts: Parts) -> pd.DataFrame:
    """The table of cases, all of which are among the parts, with comparisons."""
    relative = any(comparison.relative_to_length for comparison in plan.study.comparison)
    lengths = straight_lengths(plan.cases.families) if relative else {}
    return with_comparisons(cases_frame(plan, parts), plan.study, lengths)


def explored(plan: Plan, parts: Parts, workers: Workers, progress: Progress) -> tuple[Plan, int]:
    """The plan with every design that a search tries, generation by generation, and the number of computed cases.

    The search is the same every time: where designs are known already it goes through them again without computing.
    """
    study, counted = plan.study, []
    assert study.search is not None

    def judged(designs: np.ndarray) -> Judged:
        asked = replace(plan, cases=resolve(plan.path, study, designs=designs))
        counted.append(brought(asked, parts, workers, Quiet(progress)))
        cases = designs_of(study, tabulated(asked, parts))
        bounded, wanted = (cases.values(wishes, cases.frame) for wishes in (study.requirement, study.preference))
        margins = [[r.margin(v) for r, v in zip(study.requirement, row, strict=True)] for row in bounded]
        scores = wanted * [preference.sign for preference in study.preference]
        return Judged(np.array(margins, float).reshape(bounded.shape), np.nan_to_num(scores, nan=-np.inf))

    each = len(plan.cases) // len(first_designs(study))
    progress.begin(study.name, study.search.designs * each, 0)
    try:
        designs = searched_designs(study, judged)
    finally:
        progress.end()
    return replace(plan, cases=resolve(plan.path, study, designs=designs)), sum(counted)


def brought(plan: Plan, parts: Parts, workers: Workers, progress: Progress) -> int:
    """Bring all cases of a plan among the parts, from other studies or computed; the number of the latter."""
    adopt(plan, parts)
    return compute(plan, parts, workers, progress)


def adopt(plan: Plan, parts: Parts) -> None:
    """Take what other studies in the same folder have computed of the cases."""
    missing = plan.missing(parts)
    lacking = zip(plan.items, missing.T, strict=True)
    if missing.any():
        parts.adopt({item: {plan.keys[number] for number in np.flatnonzero(lacks)} for item, lacks in lacking})


def compute(plan: Plan, parts: Parts, workers: Workers, progress: Progress) -> int:
    """Compute what is not among the parts and add it to them; the number of cases that lacked something."""
    missing = plan.missing(parts)
    chunks, waiting = plan.chunks(missing), int(missing.any(1).sum())
    progress.begin(plan.study.name, len(plan.cases), len(plan.cases) - waiting)

    def keep(number: int, pieces: list[Piece]) -> None:
        chunk = chunks[number]
        cases, states = computed_columns(pieces, chunk)
        keep_chunk(plan, parts, chunk, cases, states)
        failed = cases["outcome"] != "converged"
        for metric in chunk.metrics:
            failed |= cases[reason_column(metric)] != ""
        progress.advance(len(failed), int(failed.sum()))

    try:
        run_tasks(solve_chunk, dict(enumerate(chunks)), keep, workers, split=Chunk.single)
    finally:
        progress.end()
    return waiting


def computed_columns(pieces: list[Piece], chunk: Chunk) -> tuple[Columns, Columns | None]:
    """Columns of a chunk's cases and, if they are kept, of their states, from the pieces that it was computed in."""
    cases, states = [], []
    for piece in pieces:
        if piece.fate == "done":
            cases.append(piece.value[0])
            states.append(piece.value[1])
        else:
            outcome = CASE_CRASHED if piece.fate == "crashed" else CASE_FAILED
            cases.append(blank_columns(piece.task.numbers, chunk.metrics, outcome, piece.reason))
    return _stacked(cases), _stacked(states) if states and chunk.states != "none" else None


def keep_chunk(plan: Plan, parts: Parts, chunk: Chunk, cases: Columns, states: Columns | None) -> None:
    """Add the items that a chunk was computed for to the parts."""
    numbers, names = cases["case_id"], {}
    if plan.items[0] in chunk.items:
        outcome = blank_columns(numbers[:0], (), "", "")
        names = {name: plan.items[0] for name in outcome if name != "case_id"}
    for metric, item in plan.metric_items:
        if item in chunk.items:
            columns = [*(quantity.name for quantity in metric.quantities()), reason_column(metric)]
            names |= dict.fromkeys(columns, item)
    kept = None
    if chunk.states != "none" and plan.states_item:
        states = states or {"case_id": np.zeros(0, np.int64)}
        count = np.bincount(np.searchsorted(numbers, states["case_id"]), minlength=len(numbers))
        kept = States(plan.states_item, count, {name: states[name] for name in states if name != "case_id"})
    parts.add([plan.keys[number] for number in numbers], cases, names, kept)


def _stacked(tables: Sequence[Columns]) -> Columns:
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def straight_lengths(families: Sequence[Family]) -> dict[int, float]:
    """Straight length of the manipulator of every case, m, by number of the case."""
    lengths: dict[int, float] = {}
    for family in families:
        lengths |= dict.fromkeys(family.numbers.tolist(), family.manipulator().chain().length)
    return lengths


def forecast(plan: Plan) -> tuple[float, int]:
    """Seconds of one core that are still to be spent, from a few cases solved here, and the number of stored cases."""
    missing = plan.missing(Parts(plan.folder))
    chunks, count = plan.chunks(missing), int(missing.any(1).sum())
    if not count:
        return 0.0, len(plan.cases)
    cases = [chunk.single()[0] for chunk in chunks[:: max(1, len(chunks) // 3)][:4]]
    solve_chunk(cases[0])  # compiles
    begin = time.perf_counter()
    for case in cases:
        solve_chunk(case)
    return (time.perf_counter() - begin) / len(cases) * count, len(plan.cases) - count
