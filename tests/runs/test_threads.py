"""Threads of linear algebra on the command line and in Python."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import prb3r
from prb3r.runs.threads import LINEAR_ALGEBRA

SCRIPT = """
from click.testing import CliRunner
from prb3r.cli import main
assert CliRunner().invoke(main, ["schema", "manipulator"]).exit_code == 0
import numpy as np, threadpoolctl
np.ones((4, 4)) @ np.ones((4, 4))
print({pool["num_threads"] for pool in threadpoolctl.threadpool_info()})
"""

FROM_PYTHON = """
import numpy as np, threadpoolctl
import prb3r
used = lambda: {pool["num_threads"] for pool in threadpoolctl.threadpool_info()}
class Seen(Exception): pass
def seen(step): raise Seen(used())
def within():
    try: prb3r.diagnose("studies/recordings/bench-example", report=seen)
    except Seen as s: return s.args[0]
before = used()
print(within(), used() == before)
"""
ROOT = Path(prb3r.__file__).parents[1]


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one thread is all that there are")
@pytest.mark.parametrize(("asked", "used"), [(None, "{1}"), ("2", "{2}")])
def test_commands_and_diagnoses_use_one_thread_unless_asked_for_more(asked, used):
    environment = {name: value for name, value in os.environ.items() if name not in LINEAR_ALGEBRA}
    environment |= dict.fromkeys(LINEAR_ALGEBRA, asked) if asked else {}
    ended = subprocess.run([sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, timeout=60)
    assert ended.stdout.strip() == used, ended.stderr
    call = [sys.executable, "-c", FROM_PYTHON]
    ended = subprocess.run(call, env=environment, capture_output=True, text=True, timeout=60, cwd=ROOT)
    assert ended.stdout.strip() == f"{used} True", ended.stderr
