"""How every command ends: its exit code, errors as messages, signals as interrupts."""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from enum import IntEnum

import click

from prb3r.errors import Prb3rError

RESUMED = frozenset({"run", "prove"})
"""Commands that, run again after an interrupt, go on where they stopped."""
TRACEBACK = "set PRB3R_DEBUG=1 for the traceback"
"""What is said with an internal error."""


class ExitCode(IntEnum):
    """Exit codes of commands; refused input (2) and engine failures (3) carry theirs in `Prb3rError.exit_code`."""

    DONE = 0
    SOME_FAILED = 1
    """Some cases, steps or targets failed, no design keeps the requirements, or a diagnosis is unexplained or finds a
    blunder of the set-up."""
    INTERNAL = 3
    INTERRUPTED = 130


class Commands(click.Group):
    """A group of commands whose errors become messages and exit codes; tracebacks are shown only with PRB3R_DEBUG."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Refuse empty arguments, which shells make of variables that are not set, and which would name this folder."""
        if "" in args:
            raise click.UsageError("an argument is empty; is a variable of the shell not set?", ctx)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context):
        """Run a command; print its errors to stderr and exit with their code."""
        try:
            with _stoppable():
                return super().invoke(ctx)
        except Prb3rError as error:
            for problem in error.problems:
                click.echo(f"prb3r: {problem}", err=True)
            ctx.exit(error.exit_code)
        except KeyboardInterrupt:
            kept = "; what is computed is kept, run the same command to go on"
            click.echo(f"prb3r: interrupted{kept if ctx.invoked_subcommand in RESUMED else ''}", err=True)
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
                f"prb3r: internal error: {type(error).__name__}: {error} ({TRACEBACK})",
                err=True,
            )
            ctx.exit(ExitCode.INTERNAL)


@contextlib.contextmanager
def _stoppable() -> Iterator[None]:
    """Within the block SIGTERM and SIGHUP raise KeyboardInterrupt as SIGINT does; signals that are ignored stay so.

    (`nohup` ignores SIGHUP.)  Outside the main thread, where handlers cannot be set, nothing changes.
    """
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
