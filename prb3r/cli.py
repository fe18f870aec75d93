"""The command line: the only place that prints.  Progress goes to stderr, one closing summary to stdout."""

import contextlib
import json
import os
import signal
import sys
import threading
from collections.abc import Iterator
from enum import IntEnum
from functools import partial
from pathlib import Path

import click

from prb3r import __version__
from prb3r.errors import Prb3rError, Problem, SpecError


class ExitCode(IntEnum):
    """What a command tells the shell; input that is refused and failures of the engine carry theirs with them."""

    DONE = 0
    SOME_FAILED = 1
    """Cases without equilibrium, or a misfit that nothing explains."""
    INTERNAL = 3
    INTERRUPTED = 130


class Commands(click.Group):
    """Errors become messages and exit codes; no traceback reaches a user unless PRB3R_DEBUG is set."""

    def invoke(self, ctx: click.Context):
        """Run a command; its errors become messages on stderr and its exit code."""
        try:
            with _stoppable():
                return super().invoke(ctx)
        except Prb3rError as error:
            for problem in error.problems:
                click.echo(f"prb3r: {problem}", err=True)
            ctx.exit(error.exit_code)
        except KeyboardInterrupt:
            click.echo("prb3r: interrupted; what is computed is kept, run the same command to go on", err=True)
            ctx.exit(ExitCode.INTERRUPTED)
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            ctx.exit(ExitCode.DONE)
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except Exception as error:
            if os.environ.get("PRB3R_DEBUG"):
                raise
            click.echo(
                f"prb3r: internal error: {type(error).__name__}: {error} (set PRB3R_DEBUG=1 for the traceback)",
                err=True,
            )
            ctx.exit(ExitCode.INTERNAL)


@contextlib.contextmanager
def _stoppable() -> Iterator[None]:
    """SIGTERM and SIGHUP interrupt as SIGINT does, from the beginning on; under `nohup` SIGHUP stays ignored."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    heard = [
        number for number in (getattr(signal, name) for name in names) if signal.getsignal(number) != signal.SIG_IGN
    ]
    before = {number: signal.signal(number, stop) for number in heard}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def main() -> None:
    """Design studies for cable-driven continuum manipulators."""


def _existing(_ctx, _param, paths):
    problems = [Problem(str(path), "no such file or folder") for path in paths if not os.path.exists(path)]
    if problems:
        raise SpecError(*problems)
    return paths


STUDIES = click.argument("studies", nargs=-1, required=True, metavar="STUDY.toml...", callback=_existing)


@main.command("run")
@STUDIES
@click.option("-o", "--output", default="results", show_default=True, help="Folder that receives one folder a study.")
@click.option("-j", "--jobs", type=click.IntRange(1), default=None, help="Worker processes [default: all cores].")
@click.option("--fresh", is_flag=True, help="Compute everything anew instead of resuming.")
@click.option("--dry-run", is_flag=True, help="Say how many cases, what they cost and where they go.")
@click.option("--backend", default="loky", show_default=True, help="loky (this machine) or dask.")
@click.option("--scheduler", default=None, metavar="ADDRESS", help="Dask scheduler, tcp://host:port.")
@click.pass_context
def run_command(ctx, studies, output, jobs, fresh, dry_run, backend, scheduler) -> None:
    """Run studies: tables, figures and a report each.  An interrupted or unchanged study goes on from what is there."""
    from prb3r.progress import reporter
    from prb3r.runs.tasks import Workers
    from prb3r.study.plan import plan_study
    from prb3r.study.run import Options, execute, writing

    plans = []
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
        raise SpecError(*problems)
    jobs = jobs or os.cpu_count() or 1
    _say_what_is_prepared()
    if dry_run:
        for plan in plans:
            click.echo(_forecast(plan, jobs))
        return
    from prb3r.present.study.current import publish_what_changed

    options, failed, lines = Options(Path(output), Workers(backend, jobs, scheduler), fresh), 0, []
    with reporter() as progress:
        for plan in plans:
            with writing(plan):
                result = execute(plan, options, progress)
                files = publish_what_changed(result)
            for change in result.manifest["changed"]:
                click.echo(f"{plan.study.name}: changed since the last run: {change}", err=True)
            failed += result.failed
            lines.append(_closing(result, files))
    click.echo("\n".join(lines))
    ctx.exit(ExitCode.SOME_FAILED if failed else ExitCode.DONE)


def _forecast(plan, jobs: int) -> str:
    from prb3r.study.run import forecast

    seconds, stored = forecast(plan)
    cost = f"about {seconds / jobs:.2g} s with {jobs} jobs" if seconds else "nothing to compute"
    return f"{plan.study.name}: {len(plan.cases)} cases, {stored} of them stored, {cost}, into {plan.folder}"


def _closing(result, files: list[Path]) -> str:
    plan, cases = result.plan, len(result.cases)
    what = (
        f"{result.computed} computed, {cases - result.computed} from earlier runs" if result.computed else "unchanged"
    )
    text = f"{plan.study.name}: {cases} cases ({what}), {len(files)} files in {result.folder}"
    if plan.study.decides:
        from prb3r.study.advice import recommendation
        from prb3r.study.decide import decide
        from prb3r.study.designs import read_designs

        text += f"\n  {recommendation(decide(read_designs([result.folder]))).replace('**', '')}"
    if result.rigs is not None:
        from prb3r.study.rigs import share_sentences

        text += "".join(f"\n  {sentence}" for sentence in share_sentences(result.rigs))
    if result.failed:
        first = result.cases[result.cases["outcome"] != "converged"].iloc[0]
        text += f"; {result.failed} without a stable equilibrium, first case {first['case_id']}: {first['reason']}"
    return text


def _say_what_is_prepared() -> None:
    from prb3r.mechanics.kernel import is_prepared

    if not is_prepared():
        click.echo("prb3r: compiling the mechanics for its first use, up to half a minute; it is kept", err=True)


@main.command("solve")
@click.argument("manipulator", metavar="MANIPULATOR.toml")
@click.argument("steps", metavar="STEPS")
@click.option("--model", type=click.Choice(["prb3r", "elastica", "constant-curvature"]), help="Instead of the file's.")
@click.option("-o", "--output", metavar="MARKERS", help="A .csv or .parquet file instead of CSV on stdout.")
@click.option("--as-measured", is_flag=True, help="Positions as read with the observation effects of the file.")
@click.option("--image-centre", nargs=2, type=float, default=(0.0, 0.0), metavar="X Y", help="Of the camera, m.")
@click.pass_context
def solve_command(ctx, manipulator, steps, model, output, as_measured, image_centre) -> None:
    """Equilibria along each sequence of load steps: positions, angles and outcome of every disk as a table."""
    from prb3r.model.files.table import csv_text, write_table
    from prb3r.model.manipulator import load_manipulator
    from prb3r.model.solve import POSITION_COLUMNS
    from prb3r.model.solve import solve as solve_steps

    _say_what_is_prepared()
    table = solve_steps(load_manipulator(manipulator), steps, model, as_measured, image_centre)[POSITION_COLUMNS]
    last = table[table["disk"] == table["disk"].max()]
    failed, detours = (
        int((~last["outcome"].isin(["converged", "detour"])).sum()),
        int((last["outcome"] == "detour").sum()),
    )
    if output:
        write_table(table, output)
        click.echo(f"{len(last)} steps, {failed} without a stable equilibrium, in {output}")
    else:
        click.echo(csv_text(table), nl=False)
        if failed:
            click.echo(f"prb3r: {failed} of {len(last)} steps have no stable equilibrium", err=True)
        if detours:
            click.echo(f"prb3r: {detours} after them are reached by leaving them out", err=True)
    ctx.exit(ExitCode.SOME_FAILED if failed else ExitCode.DONE)


@main.command("reach")
@click.argument("manipulator", metavar="MANIPULATOR.toml")
@click.option("--disk", default="tip", show_default=True, metavar="K", help="Number of the disk, or tip.")
@click.option("--x", "x_m", type=float, metavar="M", help="Where its centre should be, m.")
@click.option("--y", "y_m", type=float, metavar="M")
@click.option("--angle", "angle_rad", type=float, metavar="RAD", help="Its angle, rad.")
@click.option("--path", metavar="TABLE", help="Instead: a table of x_m, y_m, angle_rad, one target after the other.")
@click.option("--most", type=float, metavar="N", help="Largest tension of a cable [default: bends by a whole turn].")
@click.option("--broken", multiple=True, metavar="CABLE", help="A cable that carries nothing; may be repeated.")
@click.option("-o", "--output", metavar="STEPS", help="A .csv or .parquet file instead of CSV on stdout.")
@click.pass_context
def reach_command(ctx, manipulator, disk, path, most, broken, output, **place) -> None:
    """Tensions of least sum that bring a disk to a place or an angle, as a table of steps that `solve` takes.

    Exit code 1, and the nearest it comes, where that cannot be.
    """
    from prb3r.inverse.reach import reach
    from prb3r.model.files.table import csv_text, write_table
    from prb3r.model.manipulator import load_manipulator

    wanted = {name: value for name, value in place.items() if value is not None}
    number = int(disk) if disk.isdigit() else disk
    _say_what_is_prepared()
    answer = reach(load_manipulator(manipulator), disk=number, path=path, most_n=most, broken=broken, **wanted)
    if output:
        write_table(answer.steps, output)
    else:
        click.echo(csv_text(answer.steps), nl=False)
    for sentence in answer.sentences:
        click.echo(sentence, err=not output)
    ctx.exit(ExitCode.DONE if answer.reached else ExitCode.SOME_FAILED)


@main.command("compare")
@click.argument("results", nargs=-1, required=True, metavar="RESULT...", callback=_existing)
@click.option("-o", "--output", metavar="DIR", help="Also write comparison.md, comparison.parquet and figures.")
@click.option("--requirements", metavar="FILE", help="[[requirement]] and [[preference]], instead of the study's.")
@click.pass_context
def compare_command(ctx, results, output, requirements) -> None:
    """Designs side by side: which keep the requirements, the Pareto front, and which to build.

    Exit code 1 if no design keeps every requirement.
    """
    from prb3r.present.study.comparison import advice_on, publish_comparison
    from prb3r.study.designs import read_designs
    from prb3r.study.wishes import load_wishes

    asked = load_wishes(requirements) if requirements else None
    counsel = advice_on(read_designs([Path(result) for result in results], asked))
    click.echo(counsel.markdown)
    if output:
        files = publish_comparison(counsel, Path(output))
        click.echo(f"\n{', '.join(files)} in {output}")
    ctx.exit(ExitCode.DONE if counsel.decision.winner else ExitCode.SOME_FAILED)


@main.command("report")
@click.argument("folder", metavar="FOLDER")
def report_command(folder) -> None:
    """An index page over everything in a folder: studies, comparisons, diagnoses and proofs, each with its answer."""
    from prb3r.present.index import write_index

    page, count = write_index(Path(folder))
    click.echo(f"{count} result{'s' * (count > 1)} in {page}")


@main.command("diagnose")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@click.option("-o", "--output", metavar="DIR", help="Folder for all files [default: results/diagnoses/<name>].")
@click.option("--together", is_flag=True, help="Several recordings of rigs that share material and friction.")
@click.option("--holdout", multiple=True, metavar="RECORDING", help="Judge on this recording; may be repeated.")
@click.option("--assume", metavar="MANIPULATOR", help="Effects found before, such as explained.toml; refitted.")
@click.option("--seed", default=0, show_default=True, help="Of thresholds and of the sequences that are set aside.")
@click.option("-j", "--jobs", type=click.IntRange(1), default=None, help="Worker processes [default: all cores].")
@click.pass_context
def diagnose_command(ctx, recordings, output, together, holdout, assume, seed, jobs) -> None:
    """Locate, name and model what simulation leaves out of a recording; show how much better it fits then.

    With --together of several recordings at once, which share what belongs to material and friction.
    """
    from prb3r.model.manipulator import load_manipulator
    from prb3r.recording.reading import load_recording

    if not together and len(recordings) > 1:
        raise SpecError(Problem("diagnose", "several recordings go with --together; else one at a time"))
    loaded = [load_recording(path) for path in recordings]
    asked = {
        "holdout": [load_recording(path) for path in holdout],
        "assume": load_manipulator(assume) if assume else None,
        "seed": seed,
        "jobs": jobs or os.cpu_count() or 1,
    }
    verdicts = _together(loaded, output, asked) if together else _alone(loaded[0], output, asked)
    ctx.exit(ExitCode.SOME_FAILED if {"unexplained", "set-up"} & set(verdicts) else ExitCode.DONE)


def _alone(loaded, output: str | None, asked: dict) -> list[str]:
    """Diagnose one recording, write and say it; the verdict."""
    from prb3r.diagnosis.result.files import default_folder
    from prb3r.diagnosis.result.projection import summary_lines
    from prb3r.diagnosis.stages import STAGES
    from prb3r.front import diagnose as diagnosed
    from prb3r.progress import stages
    from prb3r.runs.files import ensure_writable

    folder = Path(output) if output else default_folder(loaded.name)
    ensure_writable(folder)
    _say_what_is_prepared()
    with stages(loaded.name, (*STAGES, "write")) as report:
        diagnosis = diagnosed(loaded, report=report, **asked)
        report("write")
        files = diagnosis.report(folder)
    click.echo("\n".join(summary_lines(diagnosis)))
    click.echo(f"{len(files)} files in {folder}, the page to read is {folder / 'report.html'}")
    return [diagnosis.verdict]


def _together(loaded, output: str | None, asked: dict) -> list[str]:
    """Diagnose several recordings together, write and say it; the verdicts."""
    from prb3r.diagnosis.result.files import default_folder
    from prb3r.diagnosis.result.projection import summary_lines
    from prb3r.diagnosis.together import joint_steps
    from prb3r.front import diagnose as diagnosed
    from prb3r.progress import stages
    from prb3r.runs.files import ensure_writable

    names = [recording.name for recording in loaded]
    folder = Path(output) if output else default_folder("together-" + "-".join(names))
    ensure_writable(folder)
    with stages("together", (*joint_steps(names), "write")) as report:
        found = diagnosed(loaded, together=True, report=report, **asked)
        report("write")
        files = found.report(folder)
    for diagnosis in found.diagnoses:
        click.echo("\n".join([*summary_lines(diagnosis), ""]))
    click.echo("\n".join(["together:", *(f"- {sentence}" for sentence in found.common.sentences)]))
    click.echo(f"{len(files)} files in {folder}: together.json and a folder for each recording")
    return [diagnosis.verdict for diagnosis in found.diagnoses]


@main.command("predict")
@click.argument("diagnosis", metavar="DIAGNOSIS")
@click.argument("manipulator", metavar="MANIPULATOR.toml")
@click.argument("steps", metavar="[STEPS]", required=False)
@click.option("-o", "--output", metavar="FILE", help="A .toml or, with STEPS, a .csv or .parquet, instead of stdout.")
@click.option("--seed", default=0, show_default=True, help="Of the draws behind the bands.")
def predict_command(diagnosis, manipulator, steps, output, seed) -> None:
    """What a diagnosis teaches about another design: its manipulator file or, with STEPS, positions with 95 % bands."""
    from prb3r.diagnosis.result.design_prediction import predict_design
    from prb3r.model.files.table import csv_text, write_table
    from prb3r.runs.files import ensure_writable, write_whole

    if output and steps is None and Path(output).suffix != ".toml":
        raise SpecError(Problem(output, "without STEPS a manipulator is written: a .toml file"))
    _say_what_is_prepared()
    learnt = predict_design(diagnosis, manipulator, steps, seed=seed)
    if output and learnt.positions is not None:
        write_table(learnt.positions, output)
    elif output:
        ensure_writable(Path(output).parent)
        write_whole(Path(output), learnt.to_toml().encode())
    else:
        text = learnt.to_toml() if learnt.positions is None else csv_text(learnt.positions)
        click.echo(text, nl=False)
    for remark in (*(f"left behind: {reason}" for reason in learnt.left_behind), *learnt.remarks):
        click.echo(f"prb3r: {remark}", err=True)


@main.command("check")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
def check_command(files) -> None:
    """Validate studies, manipulators, recordings (folders) and step tables (with a manipulator beside them)."""
    from prb3r.check import check_file, only_manipulator

    problems: list[Problem] = []
    lines = []
    manipulator = only_manipulator(map(Path, files))
    for path in files:
        try:
            lines.append(f"{path}: {check_file(Path(path), manipulator)}")
        except Prb3rError as error:
            problems += error.problems
    if lines:
        click.echo("\n".join(lines))
    if problems:
        raise SpecError(*problems)


@main.command("schema")
@click.argument("what", type=click.Choice(["study", "manipulator", "recording"]))
def schema_command(what) -> None:
    """JSON Schema of a file format, for editors."""
    from prb3r.schema import schema_of

    click.echo(json.dumps(schema_of(what), indent=1))


@main.command("bench")
@click.option("--json", "as_json", is_flag=True, help="Numbers as JSON.")
@click.option("--diagnosis", type=click.IntRange(0), default=0, metavar="N", help="Also time N diagnoses of each kind.")
@click.option("-o", "--output", default="results/bench", show_default=True, help="Folder for the table.")
def bench_command(as_json, diagnosis, output) -> None:
    """Speed and accuracy against the seed's method and the integral model, measured in one run."""
    from prb3r.bench.measure import measure
    from prb3r.bench.tables import bench_json, bench_page
    from prb3r.runs.files import ensure_writable

    folder = Path(output)
    ensure_writable(folder)
    click.echo(f"prb3r: measuring, {'minutes a diagnosis' if diagnosis else 'less than a minute'}", err=True)
    result = measure(designs=diagnosis, say=lambda text: click.echo(f"prb3r: {text}", err=True))
    page, numbers = bench_page(result), bench_json(result)
    (folder / "bench.md").write_text(page)
    (folder / "bench.json").write_text(numbers)
    click.echo(numbers if as_json else f"{page}\nin {folder}")


@main.command("prove")
@click.option("-o", "--output", default="results/proof", show_default=True, help="Folder for tables and figures.")
@click.option("--cases", type=click.IntRange(1), default=None, help="Recordings [default: all of a full run].")
@click.option("--class", "classes", multiple=True, metavar="CLASS", help="Of these classes alone; may be repeated.")
@click.option("-j", "--jobs", type=click.IntRange(1), default=None, help="Worker processes [default: all cores].")
@click.option("--seed", type=click.IntRange(0), default=2, show_default=True, help="Of everything; 1 is for tuning.")
@click.option("--settings", is_flag=True, help="Instead: how scores move with each number among the settings.")
@click.option("--only", multiple=True, metavar="SETTING", help="Of these settings alone; may be repeated.")
def prove_command(output, cases, classes, jobs, seed, settings, only) -> None:
    """Benchmark of the diagnosis on concealed effects: labels are sealed, and opened after the last verdict.

    An interrupted run goes on where it stopped when it is started again.
    """
    from prb3r.proof.settings import SETTINGS
    from prb3r.runs.files import ensure_writable

    folder, jobs = Path(output), jobs or os.cpu_count() or 1
    ensure_writable(folder)
    say = partial(click.echo, err=True)
    if settings or only:
        from prb3r.present.proof.sweep import publish_sweep, sweep_table
        from prb3r.proof.sweep import run_sweep

        cases = cases or SETTINGS.protocol.sweep_cases
        sweep = run_sweep(cases, seed, jobs, say, folder / ".journal-settings", only)
        table, files = sweep_table(sweep), publish_sweep(sweep, folder)
    else:
        from prb3r.present.proof.report import publish_proof
        from prb3r.present.proof.scores import scores_table
        from prb3r.proof.prove import run_proof

        shares = SETTINGS.population.shares
        cases = cases or sum(share for name, share in shares.items() if not classes or name in classes)
        proof = run_proof(cases, seed, jobs, say, folder / ".journal", classes)
        table, files = scores_table(proof), publish_proof(proof, folder)
    click.echo("\n".join([*table, "", f"{len(files)} files in {output}"]))
