"""Options, checks and messages that several commands share."""

import os
from pathlib import Path

import click

from prb3r.errors import Problem, SpecError


def existing(_context: click.Context, _parameter: click.Parameter, paths: tuple[str, ...]) -> tuple[str, ...]:
    """The paths of an argument, which must all exist; a callback of click.

    Raises
    ------
    SpecError
        With every path that does not.
    """
    problems = [Problem(path, "no such file or folder") for path in paths if not os.path.exists(path)]
    if problems:
        raise SpecError(*problems)
    return paths


def ensure_spared(output: str | Path, *inputs: str | Path | None) -> None:
    """Check that writing to `output` would not replace one of the files that a command reads.

    Raises
    ------
    SpecError
        If it would.
    """
    for path in inputs:
        if path is not None and os.path.exists(output) and os.path.exists(path) and os.path.samefile(output, path):
            raise SpecError(Problem(str(output), "is read by this command; write to another file"))


def say_what_is_compiled() -> None:
    """Say on stderr that the first use takes longer, if the kernels of the mechanics are not in the cache yet."""
    from prb3r.mechanics.code_cache import is_prepared

    if not is_prepared():
        click.echo("prb3r: compiling the mechanics for its first use, some ten seconds; it is kept", err=True)


JOBS = click.option(
    "-j",
    "--jobs",
    type=click.IntRange(1),
    default=None,
    callback=lambda _context, _parameter, jobs: jobs or os.cpu_count() or 1,
    help="Worker processes [default: all cores].",
)
"""Option `-j`: number of worker processes, at least 1, by default all cores."""
