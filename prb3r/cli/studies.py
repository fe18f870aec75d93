"""Commands on studies and their results: run, compare, report."""

import os
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from prb3r.cli.group import TRACEBACK, ExitCode
from prb3r.cli.shared import JOBS, existing, say_what_is_compiled
from prb3r.errors import Prb3rError, Problem, SpecError

if TYPE_CHECKING:
    from prb3r.present.study.current import Ended
    from prb3r.study.plan import Plan
    from prb3r.study.run import Result


@click.command("run")
@click.argument("studies", nargs=-1, required=True, metavar="STUDY.toml...", callback=existing)
@click.option("-o", "--output", default="results", show_default=True, help="Folder that receives one folder a study.")
@JOBS
@click.option("--fresh", is_flag=True, help="Compute everything anew instead of resuming.")
@click.option("--dry-run", is_flag=True, help="Say how many cases, what they cost and where they go.")
@click.option(
    "--backend", type=click.Choice(["loky", "dask"]), default="loky", show_default=True, help="loky: this machine."
)
@click.option("--scheduler", default=None, metavar="ADDRESS", help="Dask scheduler, tcp://host:port.")
@click.pass_context
def run_command(ctx, studies, output, jobs, fresh, dry_run, backend, scheduler) -> None:
    """Run studies: tables, figures and a report each.  An interrupted or unchanged study goes on from what is there."""
    from prb3r.present.study.current import still_standing

    if scheduler and backend != "dask":
        raise SpecError(Problem("--scheduler", "goes with --backend dask"))
    if backend == "dask" and not (scheduler and re.fullmatch(r".+:\d+", scheduler)):
        raise SpecError(Problem("--scheduler", "--backend dask needs the address of one, such as tcp://host:8786"))
    before = [] if fresh or dry_run or backend != "loky" else [still_standing(path, output) for path in studies]
    if before and len(set(studies)) == len(studies) and all(before):
        _close(ctx, [ended for ended in before if ended])
    from prb3r.progress import reporter
    from prb3r.runs.backends.aside import Aside
    from prb3r.runs.tasks import Workers
    from prb3r.study.run import Options, execute, writing

    plans = _planned(studies, output)
    say_what_is_compiled()
    if dry_run:
        for plan in plans:
            click.echo(_forecast(plan, jobs))
        return
    options = Options(Path(output), Workers(backend, jobs, scheduler), fresh)
    with reporter() as progress, Aside(_presented, apart=jobs > 1 and len(plans) > 1) as aside:
        for plan in plans:
            with ExitStack() as held:
                held.enter_context(writing(plan))
                result = execute(plan, options, progress)
                aside.begin(result, held.pop_all())
            for change in result.manifest["changed"]:
                click.echo(f"{plan.study.name}: changed since the last run: {change}", err=True)
    _close(ctx, aside.done)


def _presented(result: "Result") -> "Ended":
    """Draw the figures and write the report of a study, and record how its run ended, for :func:`still_standing`.

    An unchanged study that is run again says what the record has, where nothing was computed.  An error of the program
    is no reason to leave other studies undone: it is told at the end.
    """
    from prb3r.model.files.cells import count
    from prb3r.present.study.current import Ended, publish_what_changed, record_end

    try:
        publish_what_changed(result)
        answers = _answers(result)
    except Prb3rError:
        raise
    except Exception as error:
        if os.environ.get("PRB3R_DEBUG"):
            raise
        cases = count(len(result.cases), "case")
        kept = f"{result.plan.study.name}: {cases} in {result.folder / 'cases.parquet'}"
        said = f"{kept}, but no page: internal error: {type(error).__name__}: {error} ({TRACEBACK})"
        return Ended(said, failed=True, broken=True)
    ended = Ended(_outcome(result, result.computed) + answers, result.failed > 0)
    record_end(result, replace(ended, said=_outcome(result, 0) + answers))
    return ended


def _close(ctx: click.Context, ended: Sequence["Ended"]) -> NoReturn:
    """Print how studies ended, and exit: with 3 if the page of any could not be made, 1 if a case of any failed, else
    0."""
    whole, broken = ([study for study in ended if study.broken == lost] for lost in (False, True))
    if whole:
        click.echo("\n".join(study.said for study in whole))
    for study in broken:
        click.echo(f"prb3r: {study.said}", err=True)
    if broken:
        ctx.exit(ExitCode.INTERNAL)
    ctx.exit(ExitCode.SOME_FAILED if any(study.failed for study in ended) else ExitCode.DONE)


def _planned(studies: tuple[str, ...], output: str) -> list["Plan"]:
    """The plan of each study file.

    Raises
    ------
    SpecError
        With every problem of all files, and with studies of equal names, which would write into one folder.
    """
    from prb3r.progress import reporter
    from prb3r.study.plan import plan_study

    plans: list[Plan] = []
    problems: list[Problem] = []
    with reporter() as progress:
        for path in studies:
            try:
                plans.append(plan_study(path, output, progress))
            except SpecError as error:
                problems += error.problems
    names = [plan.study.name for plan in plans]
    for plan in plans:
        if names.count(plan.study.name) > 1:
            problems.append(Problem(str(plan.path), f"another study of this run is named {plan.study.name!r} too"))
    if problems:
        raise SpecError(*dict.fromkeys(problems))
    return plans


def _forecast(plan: "Plan", jobs: int) -> str:
    """One line: the number of cases of a study, the seconds that they take with `jobs` workers, and their folder.

    The cases of a search are those that it may take: the ones after the first generation are not known before.
    """
    from prb3r.model.files.cells import count
    from prb3r.study.run import forecast

    seconds, stored = forecast(plan)
    more = plan.most_cases / len(plan.cases)
    cost = f"about {more * seconds / jobs:.2g} s with {count(jobs, 'job')}" if seconds else "nothing to compute"
    if plan.study.search is not None:
        cases = f"at most {count(plan.most_cases, 'case')} of {count(plan.study.search.designs, 'design')}"
        first = f"of the first {len(plan.cases)} {stored} stored"
        whole = f"{cost} and more, as generations wait for each other" if seconds else f"{cost} of these"
        return f"{plan.study.name}: {cases}, {first}, {whole}, into {plan.folder}"
    return f"{plan.study.name}: {count(len(plan.cases), 'case')}, {stored} of them stored, {cost}, into {plan.folder}"


def _outcome(result: "Result", computed: int) -> str:
    """The closing line of a run: how many cases were computed, and the first that failed."""
    from prb3r.model.files.cells import count

    plan, cases = result.plan, len(result.cases)
    what = f"{computed} computed, {cases - computed} from earlier runs" if computed else "unchanged"
    text = f"{plan.study.name}: {count(cases, 'case')} ({what}), the page to read is {result.folder / 'report.html'}"
    if result.failed:
        from prb3r.study.phrases import failures_in_words

        first = result.cases[result.cases["outcome"] != "converged"].iloc[0]
        failed = failures_in_words(result.cases["outcome"].value_counts().to_dict())
        text += f"; {failed}, first case {first['case_id']}: {first['reason']}"
    return text


def _answers(result: "Result") -> str:
    """Lines on what a study answers, each after a line break; empty where it decides nothing and all is sure."""
    text = ""
    if result.plan.study.decides:
        from prb3r.study.decide import decide
        from prb3r.study.designs import read_designs
        from prb3r.study.recommend import recommendation
        from prb3r.study.settled import unsettled

        decision = decide(read_designs([result.folder]))
        text += f"\n  {recommendation(decision).replace('**', '')}"
        if result.plan.study.search is not None and (moving := unsettled(decision)):
            text += f"\n  {moving}"
    if result.rigs is not None:
        from prb3r.study.rigs import share_sentences

        text += "".join(f"\n  {sentence}" for sentence in share_sentences(result.rigs))
    if not {"safety_factor", "reached_share"}.isdisjoint(result.cases):
        from prb3r.study.unasked import unasked_warnings

        text += "".join(f"\n  {warning}" for warning in unasked_warnings(result.cases, result.plan.study))
    if "workspace_half_share" in result.cases:
        from prb3r.study.converged import workspace_warnings

        text += "".join(f"\n  {warning}" for warning in workspace_warnings(result.cases, result.plan.study))
    return text


@click.command("compare")
@click.argument("results", nargs=-1, required=True, metavar="RESULT...", callback=existing)
@click.option("-o", "--output", metavar="DIR", help="Also write comparison.md, comparison.parquet and figures.")
@click.option("--requirements", metavar="FILE", help="[[requirement]] and [[preference]], instead of the study's.")
@click.pass_context
def compare_command(ctx, results, output, requirements) -> None:
    """Designs side by side: which keep the requirements, the Pareto front, and which to build.

    Exit code 1 if no design keeps every requirement.
    """
    from prb3r.present.study.comparison import advice_on, publish_comparison
    from prb3r.study.designs import read_designs

    counsel = advice_on(read_designs([Path(result) for result in results], requirements))
    click.echo(counsel.markdown)
    if output:
        files = publish_comparison(counsel, Path(output))
        click.echo(f"\n{', '.join(files)} in {output}")
    ctx.exit(ExitCode.DONE if counsel.decision.winner else ExitCode.SOME_FAILED)


@click.command("report")
@click.argument("folder", metavar="FOLDER")
def report_command(folder) -> None:
    """An index page over everything in a folder: studies, comparisons, diagnoses and proofs, each with its answer."""
    from prb3r.model.files.cells import count
    from prb3r.present.index import write_index

    page, results = write_index(Path(folder))
    click.echo(f"{count(results, 'result')} in {page}")
