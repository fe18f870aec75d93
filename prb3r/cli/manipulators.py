"""Commands on one manipulator: solve, reach."""

import math
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from prb3r.cli.group import ExitCode
from prb3r.cli.shared import ensure_spared, say_what_is_compiled
from prb3r.errors import Problem, SpecError

if TYPE_CHECKING:
    from prb3r.study.plan import Progress

FOUND = ("converged", "detour")
"""Outcomes of steps with a stable equilibrium."""


@click.command("solve")
@click.argument("manipulator", metavar="MANIPULATOR.toml")
@click.argument("steps", metavar="STEPS")
@click.option("--model", type=click.Choice(["prb3r", "elastica", "constant-curvature"]), help="Instead of the file's.")
@click.option("-o", "--output", metavar="MARKERS", help="A .csv or .parquet file instead of CSV on stdout.")
@click.option("--as-measured", is_flag=True, help="As read with the observation effects of the file.")
@click.option("--image-centre", nargs=2, type=float, default=None, metavar="X Y", help="Of the camera, m.")
@click.pass_context
def solve_command(ctx, manipulator, steps, model, output, as_measured, image_centre) -> None:
    """Equilibria along each sequence of load steps: positions, angles and outcome of every disk as a table."""
    from prb3r.model.files.cells import count
    from prb3r.model.files.table import ensure_table_place
    from prb3r.model.manipulator import load_manipulator
    from prb3r.model.solve import POSITION_COLUMNS, as_read, peak_stress, solve_in_blocks
    from prb3r.model.step_checks import let_go_as_drawn

    if image_centre is not None and not (as_measured and all(map(math.isfinite, image_centre))):
        raise SpecError(Problem("--image-centre", "goes with --as-measured, and takes two numbers"))
    image_centre = image_centre or (0.0, 0.0)
    place = ensure_table_place(output) if output else None
    if place:
        ensure_spared(place, manipulator, steps)
    say_what_is_compiled()
    arm = load_manipulator(manipulator)
    limit = arm.yield_stress_pa
    blocks = solve_in_blocks(arm, steps, model, also=["stress_pa"] if limit else [])
    outcomes: Counter[str] = Counter()
    yielding: list[float] = []

    def told() -> Iterator[Any]:
        """The table of each block as it is solved; progress and outcomes are counted on the way."""
        with _progress(blocks.steps) as progress:
            before = 0
            for block in blocks:
                steps = block["outcome"].iloc[:: blocks.manipulator.plates + 1]
                elapsed = blocks.elapsed[before : before + len(steps)]
                table = as_read(block, blocks.manipulator, image_centre, elapsed) if as_measured else block
                if limit:
                    stress = peak_stress(block, len(steps))
                    yielding.extend(stress[stress > limit].tolist())
                outcomes.update(steps.value_counts().to_dict())
                before += len(steps)
                progress.advance(len(steps), int((~steps.isin(FOUND)).sum()))
                yield table[POSITION_COLUMNS]

    _write(told(), place)
    if remark := let_go_as_drawn(blocks.manipulator, blocks.table.let_go_as_drawn.tolist()):
        click.echo(f"prb3r: {remark}", err=True)
    failed = blocks.steps - sum(outcomes[name] for name in FOUND)
    if output:
        click.echo(f"{count(blocks.steps, 'step')}, {failed} without a stable equilibrium, in {output}")
    else:
        if failed:
            have = "has" if blocks.steps == 1 else "have"
            click.echo(f"prb3r: {failed} of {count(blocks.steps, 'step')} {have} no stable equilibrium", err=True)
        if detours := outcomes["detour"]:
            click.echo(
                f"prb3r: {detours} after them {'is' if detours == 1 else 'are'} reached by leaving them out", err=True
            )
    if limit and yielding:
        stress = f"bending stress of up to {1e-6 * max(yielding):.4g} MPa, yield stress {1e-6 * limit:.4g} MPa"
        click.echo(f"prb3r: plates would yield in {len(yielding)} of {count(blocks.steps, 'step')}: {stress}", err=True)
    ctx.exit(ExitCode.SOME_FAILED if failed else ExitCode.DONE)


@contextmanager
def _progress(steps: int) -> Iterator["Progress"]:
    """A listener that shows how many steps are solved, or a silent one for no more than a block of steps."""
    from prb3r.model.solve import BLOCK
    from prb3r.progress import reporter
    from prb3r.study.plan import Silent

    if steps <= BLOCK:
        yield Silent()
        return
    with reporter() as progress:
        progress.begin("solve", steps, 0, "steps")
        try:
            yield progress
        finally:
            progress.end()


def _write(tables: Iterator[Any], place: Path | None) -> None:
    """Write tables one below another to the file `place`, which appears only when it is whole; without it to stdout."""
    from prb3r.model.files.comma_separated import csv_text
    from prb3r.model.files.table import is_parquet
    from prb3r.runs.files import replaced
    from prb3r.runs.store import write_one_below_another

    texts = (csv_text(table, header=not number) for number, table in enumerate(tables))
    if place is None:
        for text in texts:
            click.echo(text, nl=False)
    elif is_parquet(place):
        write_one_below_another((dict(table.items()) for table in tables), place)
    else:
        with replaced(place) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
            file.writelines(texts)


@click.command("reach")
@click.argument("manipulator", metavar="MANIPULATOR.toml")
@click.option("--disk", default="tip", show_default=True, metavar="K", help="Number of the disk, or tip.")
@click.option("--x", "x_m", type=float, metavar="M", help="Where its centre should be, m.")
@click.option("--y", "y_m", type=float, metavar="M")
@click.option("--angle", "angle_rad", type=float, metavar="RAD", help="Its angle, rad.")
@click.option("--path", metavar="TABLE", help="Instead: a table of x_m, y_m, angle_rad, one target after the other.")
@click.option("--most", type=float, metavar="N", help="Largest tension of a cable [default: bends by a whole turn].")
@click.option(
    "--least", type=click.Choice(["force", "stress"]), default="force", show_default=True, help="Of all pulls."
)
@click.option("--broken", multiple=True, metavar="CABLE", help="A cable that carries nothing; may be repeated.")
@click.option("-o", "--output", metavar="STEPS", help="A .csv or .parquet file instead of CSV on stdout.")
@click.pass_context
def reach_command(ctx, manipulator, disk, path, most, output, **asked) -> None:
    """Tensions of least sum or stress that bring a disk to a place or an angle, as a table of steps that `solve` takes.

    Exit code 1, and the nearest it comes, where that cannot be; exit code 1, too, where plates would yield.
    """
    from prb3r.inverse.reach import pulls_to
    from prb3r.model.files.cells import count
    from prb3r.model.files.comma_separated import csv_text
    from prb3r.model.files.table import ensure_table_place, write_table
    from prb3r.model.manipulator import load_manipulator

    place = ensure_table_place(output) if output else None
    if place:
        ensure_spared(place, path)
    wanted = {name: value for name, value in asked.items() if value is not None}
    if path is None and not wanted.keys() & {"x_m", "y_m", "angle_rad"}:
        raise SpecError(Problem("reach", "say where to: --x and --y, --angle, or all of them, or --path TABLE"))
    number = int(disk) if disk.isdecimal() else disk
    say_what_is_compiled()

    def tell(what: str) -> None:
        """Say what is odd about targets before the search, which may be long."""
        click.echo(f"prb3r: {path or 'target'}: {what}", err=True)

    answer = pulls_to(load_manipulator(manipulator), disk=number, path=path, most_n=most, tell=tell, **wanted)
    if place:
        write_table(answer.steps, place)
    else:
        click.echo(csv_text(answer.steps), nl=False)
    for sentence in answer.sentences:
        click.echo(sentence, err=not output)
    if answer.beyond_yield:
        targets = f"{answer.beyond_yield} of {count(len(answer.table), 'target')}"
        spared = "" if asked["least"] == "stress" else "; --least stress looks for pulls that spare them"
        click.echo(f"prb3r: plates would yield at {targets}{spared}", err=True)
    ctx.exit(ExitCode.DONE if answer.reached and not answer.beyond_yield else ExitCode.SOME_FAILED)
