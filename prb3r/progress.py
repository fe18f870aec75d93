"""Progress on stderr: a live bar on a terminal, plain lines elsewhere."""

import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Sequence

PLAIN_EVERY_S = 10.0


class Lines:
    """Progress as plain lines on stderr: one when a study starts, one every few seconds, and one when it ends.

    `begin` takes the number of cases in all and of those done before, `advance` the numbers of further cases done and
    of those among them that failed.
    """

    def begin(self, name: str, cases: int, done: int, what: str = "cases") -> None:
        self.name, self.cases, self.done, self.failed = name, cases, done, 0
        self.what = what.removesuffix("s") if cases == 1 else what
        self.started = self.said = time.monotonic()
        self.first = done
        if done < cases:
            rest = f", {cases - done} to compute" if done else ""
            self._say(f"{cases} {self.what}{rest}")

    def advance(self, cases: int, failed: int) -> None:
        self.done, self.failed = self.done + cases, self.failed + failed
        now = time.monotonic()
        if now - self.said > PLAIN_EVERY_S and self.done < self.cases:
            self.said = now
            rate = (self.done - self.first) / (now - self.started)
            left = f", {rate:.3g} a second, {(self.cases - self.done) / rate:.0f} s left" if rate > 0 else ""
            self._say(f"{self.done} of {self.cases}{left}")

    def end(self) -> None:
        if self.done > self.first:
            failed = f", {self.failed} failed" if self.failed else ""
            self._say(f"{self.done} of {self.cases} {self.what} in {time.monotonic() - self.started:.1f} s{failed}")

    def _say(self, what: str) -> None:
        print(f"{self.name}: {what}", file=sys.stderr, flush=True)


class Bar:
    """Progress as a rich bar with rate and time left; the methods are those of `Lines`."""

    def __init__(self, progress) -> None:
        self.progress = progress

    def begin(self, name: str, cases: int, done: int, what: str = "cases") -> None:
        self.failed = 0
        self.task = self.progress.add_task(name, total=cases, completed=done, note="")

    def advance(self, cases: int, failed: int) -> None:
        self.failed += failed
        note = f"{self.failed} failed" if self.failed else ""
        self.progress.update(self.task, advance=cases, note=note)

    def end(self) -> None:
        self.progress.stop_task(self.task)


@contextlib.contextmanager
def stages(name: str, steps: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """Show the progress of a task through its `steps`: as a bar on a terminal, as a line for each step elsewhere.

    The context is a function to be called with the name of each step as it begins.
    """
    if not sys.stderr.isatty():
        started = time.monotonic()

        def say(step: str) -> None:
            number = f" ({steps.index(step) + 1} of {len(steps)})" if step in steps else ""
            print(f"{name}: {step}{number}, {time.monotonic() - started:.1f} s", file=sys.stderr, flush=True)

        yield say
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = [
        TextColumn(name),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.description}"),
        TimeElapsedColumn(),
    ]
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task("", total=len(steps))

        def show(step: str) -> None:
            done = steps.index(step) if step in steps else progress.tasks[task].completed
            progress.update(task, description=step, completed=done)

        yield show
        progress.update(task, description="done", completed=len(steps))


@contextlib.contextmanager
def reporter() -> Iterator[Lines | Bar]:
    """The listener to the progress of studies that suits stderr: a `Bar` on a terminal, `Lines` elsewhere."""
    if not sys.stderr.isatty():
        yield Lines()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TextColumn, TimeRemainingColumn
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task) -> Text:
            speed = task.finished_speed or task.speed
            return Text(f"{speed:.3g}/s" if speed else "")

    columns = [
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        Rate(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    ]
    with Progress(*columns, console=Console(stderr=True)) as progress:
        yield Bar(progress)
