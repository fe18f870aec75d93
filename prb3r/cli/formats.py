"""Commands on files: check, schema."""

import json
from pathlib import Path

import click

from prb3r.errors import Prb3rError, Problem, SpecError


@click.command("check")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
def check_command(files) -> None:
    """Validate studies, manipulators, recordings (folders), requirements, and tables of steps, readings or targets.

    Tables are checked against a manipulator that is named beside them.
    """
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


@click.command("schema")
@click.argument("what", type=click.Choice(["study", "manipulator", "recording"]))
def schema_command(what) -> None:
    """JSON Schema of a file format, for editors."""
    from prb3r.schema import schema_of

    click.echo(json.dumps(schema_of(what), indent=1))
