"""Commands that measure the program itself: bench, prove."""

from functools import partial
from pathlib import Path

import click

from prb3r.cli.shared import JOBS


@click.command("bench")
@click.option("--json", "as_json", is_flag=True, help="Numbers as JSON.")
@click.option("--diagnosis", type=click.IntRange(0), default=0, metavar="N", help="Also time N diagnoses of each kind.")
@click.option("--commands", type=click.IntRange(0), default=3, show_default=True, help="Rounds of whole commands.")
@click.option("-o", "--output", default="results/bench", show_default=True, help="Folder for the table.")
def bench_command(as_json, diagnosis, commands, output) -> None:
    """Speed and accuracy against `fsolve` on Eq. 12 and the integral model of the paper, measured in one run."""
    from prb3r.bench.measure import measure
    from prb3r.bench.methods import COMPARED
    from prb3r.bench.tables import bench_json, bench_page
    from prb3r.present.accuracy import publish_accuracy
    from prb3r.runs.files import ensure_writable

    folder = Path(output)
    ensure_writable(folder)
    lasts = [
        "a minute",
        *(["a minute a round of commands"] if commands else []),
        *(["minutes a diagnosis"] * bool(diagnosis)),
    ]
    click.echo(f"prb3r: measuring, {', '.join(lasts)}", err=True)
    result = measure(designs=diagnosis, commands=commands, say=lambda text: click.echo(f"prb3r: {text}", err=True))
    page, numbers = bench_page(result), bench_json(result)
    (folder / "bench.md").write_text(page)
    (folder / "bench.json").write_text(numbers)
    compared = result.methods[result.methods["method"].isin(COMPARED)]
    publish_accuracy(compared, folder)
    click.echo(numbers if as_json else f"{page}\nin {folder}")


@click.command("prove")
@click.option("-o", "--output", default="results/proof", show_default=True, help="Folder for tables and figures.")
@click.option("--cases", type=click.IntRange(1), default=None, help="Recordings [default: all of a full run].")
@click.option("--class", "classes", multiple=True, metavar="CLASS", help="Of these classes alone; may be repeated.")
@JOBS
@click.option("--seed", type=click.IntRange(0), default=2, show_default=True, help="Of everything; 1 is for tuning.")
@click.option("--settings", is_flag=True, help="Instead: how scores move with each number among the settings.")
@click.option("--only", multiple=True, metavar="SETTING", help="Of these settings alone; may be repeated.")
def prove_command(output, cases, classes, jobs, seed, settings, only) -> None:
    """Benchmark of the diagnosis on concealed effects: labels are sealed, and opened after the last verdict.

    An interrupted run goes on where it stopped when it is started again.
    """
    from prb3r.model.files.cells import count
    from prb3r.proof.settings import SETTINGS
    from prb3r.runs.files import ensure_writable

    folder = Path(output)
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
    click.echo("\n".join([*table, "", f"{count(len(files), 'file')} in {output}"]))
