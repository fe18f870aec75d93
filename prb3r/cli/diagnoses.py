"""Commands on recordings and on diagnoses of them: diagnose, predict."""

from pathlib import Path

import click

from prb3r.cli.group import ExitCode
from prb3r.cli.shared import JOBS, ensure_spared, say_what_is_compiled
from prb3r.errors import Problem, SpecError


@click.command("diagnose")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@click.option("-o", "--output", metavar="DIR", help="Folder for all files [default: results/diagnoses/<name>].")
@click.option("--together", is_flag=True, help="Several recordings of rigs that share material and friction.")
@click.option("--holdout", multiple=True, metavar="RECORDING", help="Judge on this recording; may be repeated.")
@click.option("--assume", metavar="MANIPULATOR", help="Effects found before, such as explained.toml; refitted.")
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Of thresholds and of the sequences that are set aside.",
)
@JOBS
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
        "jobs": jobs,
    }
    verdicts = _together(loaded, output, asked) if together else _alone(loaded[0], output, asked)
    ctx.exit(ExitCode.SOME_FAILED if {"unexplained", "set-up"} & set(verdicts) else ExitCode.DONE)


def _alone(loaded, output: str | None, asked: dict) -> list[str]:
    """Diagnose one recording, write its files and print the summary; the verdict as a list of one.

    `asked` holds the options of `prb3r.front.diagnoses.diagnose`.
    """
    from prb3r.diagnosis.investigate import STAGES
    from prb3r.diagnosis.result.files import default_folder
    from prb3r.diagnosis.result.projection import summary_lines
    from prb3r.front.diagnoses import diagnose as diagnosed
    from prb3r.model.files.cells import count
    from prb3r.progress import stages
    from prb3r.runs.files import ensure_writable

    folder = Path(output) if output else default_folder(loaded.name)
    ensure_writable(folder)
    say_what_is_compiled()
    with stages(loaded.name, (*STAGES, "write")) as report:
        diagnosis = diagnosed(loaded, report=report, **asked)
        report("write")
        files = diagnosis.report(folder)
    click.echo("\n".join(summary_lines(diagnosis)))
    click.echo(f"{count(len(files), 'file')} in {folder}, the page to read is {folder / 'report.html'}")
    return [diagnosis.verdict]


def _together(loaded, output: str | None, asked: dict) -> list[str]:
    """Diagnose several recordings together, write the files and print the summaries; the verdict on each recording."""
    from prb3r.diagnosis.result.files import default_folder
    from prb3r.diagnosis.result.projection import summary_lines
    from prb3r.diagnosis.together import joint_steps
    from prb3r.front.diagnoses import diagnose as diagnosed
    from prb3r.model.files.cells import count
    from prb3r.progress import stages
    from prb3r.runs.files import ensure_writable

    names = [recording.name for recording in loaded]
    folder = Path(output) if output else default_folder("together-" + "-".join(names))
    ensure_writable(folder)
    with stages("together", (*joint_steps(names), "write")) as report:
        joint = diagnosed(loaded, together=True, report=report, **asked)
        report("write")
        files = joint.report(folder)
    for diagnosis in joint.diagnoses:
        click.echo("\n".join([*summary_lines(diagnosis), ""]))
    click.echo("\n".join(["together:", *(f"- {sentence}" for sentence in joint.common.sentences)]))
    click.echo(f"{count(len(files), 'file')} in {folder}, the page to read is {folder / 'report.html'}")
    return [diagnosis.verdict for diagnosis in joint.diagnoses]


@click.command("predict")
@click.argument("diagnosis", metavar="DIAGNOSIS")
@click.argument("design", metavar="MANIPULATOR.toml|STUDY.toml")
@click.argument("steps", metavar="[STEPS]", required=False)
@click.option("-o", "--output", metavar="FILE", help="A .toml or, with STEPS, a .csv or .parquet, instead of stdout.")
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the draws behind bands and studies."
)
@click.option(
    "--same-bench/--other-bench",
    default=None,
    help="Whether the design stands on the bench of the recording, mounted alike (unsaid: yes, and bands hold both).",
)
@click.option(
    "--another-copy", is_flag=True, help="The design is another rig, even if its file is that of the recorded one."
)
def predict_command(diagnosis, design, steps, output, seed, same_bench, another_copy) -> None:
    """What a diagnosis teaches about another design: its manipulator file or, with STEPS, positions with 95 % bands.

    Of a study, the study with 64 rigs that the diagnosis leaves possible, as a factor that nobody chooses.
    """
    from prb3r.check import kind_of_file
    from prb3r.diagnosis.result.design_prediction import predict_design
    from prb3r.diagnosis.result.learnt_study import learnt_study
    from prb3r.model.files.comma_separated import csv_text
    from prb3r.model.files.table import ensure_table_place, write_table
    from prb3r.runs.files import ensure_writable, write_whole

    if output and steps is None and Path(output).suffix.lower() != ".toml":
        raise SpecError(Problem(output, "without STEPS a manipulator or a study is written: a .toml file"))
    if output:
        ensure_spared(output, design, steps)
    if kind_of_file(Path(design)) == "study":
        if steps is not None:
            raise SpecError(Problem(steps, "a study has its own loads; give the table with a manipulator"))
        study = learnt_study(
            diagnosis, design, output or design, seed=seed, same_bench=same_bench, another_copy=another_copy
        )
        if output:
            ensure_writable(Path(output).parent)
            write_whole(Path(output), study.text.encode())
        else:
            click.echo(study.text, nl=False)
        for remark in study.remarks:
            click.echo(f"prb3r: {remark}", err=True)
        return
    if output and steps is not None:
        ensure_table_place(output)
    say_what_is_compiled()
    learnt = predict_design(diagnosis, design, steps, same_bench=same_bench, another_copy=another_copy, seed=seed)
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
