"""The command line, called as a user calls it."""

import contextlib
import io
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from prb3r.cli import main

ROOT = Path(__file__).parents[1]
PROTOTYPE = ROOT / "studies/manipulators/two-segment.toml"


class Done(NamedTuple):
    """What a command left behind."""

    returncode: int
    stdout: str
    stderr: str


def prb3r(*words, cwd=ROOT):
    """The command in this process, which spares most of the time that it takes: to load libraries."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), contextlib.chdir(cwd):
        try:
            main([str(word) for word in words], prog_name="prb3r")
        except SystemExit as end:
            code = end.code or 0
    return Done(code, out.getvalue(), err.getvalue())


def process(*words):
    """The command as a shell runs it."""
    command = [sys.executable, "-m", "prb3r", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=240)
