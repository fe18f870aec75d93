"""Runs a study: workers compute cases into parts, parts become tables, and the manifest holds what varies between runs.

A run resumes by case: results are stored under a hash of what they depend on (the case, the metric, which states are
kept, and the program text of the engine), so that only new ones are computed, and nothing in an unchanged study.
"""

import contextlib
import os
import time
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from prb3r.errors import Problem, SpecError
from prb3r.runs.files import clear_left_over, ensure_writable, sole_writer
from prb3r.runs.parts import Parts
from prb3r.runs.provenance import environment, read_manifest, write_manifest
from prb3r.runs.store import arrow_table, read_arrow, write_arrow
from prb3r.runs.tasks import Workers
from prb3r.study.compare import fitted_lines
from prb3r.study.compute import obtain_results
from prb3r.study.explore import explored
from prb3r.study.manifest import changes, timing
from prb3r.study.plan import Plan, Progress, Silent, plan_study
from prb3r.study.rigs import Rigs, rigs_of, write_rigs
from prb3r.study.tables import tabulated, write_states
from prb3r.study.work import solve_task, tasks_of


@dataclass(frozen=True)
class Options:
    """How a study is run and where its results go."""

    output: Path = Path("results")
    """Folder in which each study has a folder of its own."""
    workers: Workers = field(default_factory=Workers)
    fresh: bool = False
    """Compute everything anew, without stored results."""


@dataclass(frozen=True)
class Result:
    """A finished study: its plan, its table of cases, and its manifest."""

    plan: Plan
    cases: pd.DataFrame
    manifest: dict[str, Any]
    computed: int
    """Number of cases computed in this run; the others were stored already."""

    @property
    def folder(self) -> Path:
        """Folder of the study's results: tables, manifest, figures and report."""
        return self.plan.folder

    @property
    def failed(self) -> int:
        """Number of cases whose outcome is not `converged`: no stable equilibrium, failed metric, dead worker."""
        return int((self.cases["outcome"] != "converged").sum())

    @cached_property
    def rigs(self) -> Rigs | None:
        """Effects of the errors on the rigs that are built, with Sobol's indices of all that is sampled; None without
        drawn errors and without such indices."""
        study = self.plan.study
        asked = study.errors or (study.sampling is not None and study.sampling.method == "saltelli")
        return rigs_of(study, self.cases) if asked else None

    def states(self) -> pd.DataFrame | None:
        """The table of states, read from disk; None if the study keeps none."""
        path = self.folder / "states.parquet"
        return read_arrow(path).to_pandas() if self.plan.study.states != "none" else None


def solve_study(path: str | Path, options: Options | None = None, progress: Progress | None = None) -> Result:
    """Run one study file and write its tables and manifest into `<output>/<name>`.

    Raises
    ------
    SpecError
        Before any work, for anything wrong with the input.
    EngineError
        If workers or disk fail; results computed so far stay, and the next run goes on from there.
    """
    options, progress = options or Options(), progress or Silent()
    plan = plan_study(path, options.output, progress)
    with writing(plan):
        return execute(plan, options, progress)


@contextlib.contextmanager
def writing(plan: Plan) -> Iterator[None]:
    """Lock the results folder of a study for this process, and clear temporary files that killed runs have left.

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
    """Raise SpecError if the folder holds results of another study file, which exists and still has the same name."""
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
    """Run a resolved study whose folder this process has locked by :func:`writing`; see :func:`solve_study`."""
    started = time.perf_counter()
    before = read_manifest(plan.folder)
    parts = Parts(plan.folder)
    if options.fresh:
        parts.discard()
    if plan.study.search is None:
        computed = obtain_results(plan, parts, options.workers, progress, options.fresh)
    else:
        plan, computed = explored(plan, parts, options.workers, progress, options.fresh)
    places = plan.places(parts)
    provenance = {"study": plan.study.name, "key": plan.key, "engine": plan.engine}
    if plan.states_item:
        write_states(plan, places[-1], plan.folder / "states.parquet", provenance)
    else:
        (plan.folder / "states.parquet").unlink(missing_ok=True)
    cases = tabulated(plan, places)
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


def forecast(plan: Plan) -> tuple[float, int]:
    """Estimate of the computing time still to be spent, s on one core, and the number of cases that are stored.

    The estimate comes from up to four cases or blocks of a cloud, solved in this process.
    """
    missing = plan.missing(Parts(plan.folder))
    waiting = missing.any(1)
    if not waiting.any():
        return 0.0, len(plan.cases)
    tasks = [task for chunk in plan.chunks(missing) for task in tasks_of(chunk)]
    tried = [task.single()[0] for task in tasks[:: max(1, len(tasks) // 3)][:4]]
    solve_task(tried[0])  # compiles
    begin = time.perf_counter()
    for task in tried:
        solve_task(task)
    seconds = (time.perf_counter() - begin) / sum(task.loads for task in tried)
    return seconds * plan.loads(waiting), int((~waiting).sum())
