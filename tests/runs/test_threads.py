"""Threads of linear algebra on the command line."""

import os
import subprocess
import sys

import pytest

from prb3r.runs.threads import LINEAR_ALGEBRA

SCRIPT = """
from click.testing import CliRunner
from prb3r.cli import main
assert CliRunner().invoke(main, ["schema", "study"]).exit_code == 0
import numpy as np, threadpoolctl
np.ones((4, 4)) @ np.ones((4, 4))
print({pool["num_threads"] for pool in threadpoolctl.threadpool_info()})
"""


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one thread is all that there are")
@pytest.mark.parametrize(("asked", "used"), [(None, "{1}"), ("2", "{2}")])
def test_commands_use_one_thread_unless_asked_for_more(asked, used):
    environment = {name: value for name, value in os.environ.items() if name not in LINEAR_ALGEBRA}
    environment |= dict.fromkeys(LINEAR_ALGEBRA, asked) if asked else {}
    ended = subprocess.run([sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, timeout=60)
    assert ended.stdout.strip() == used, ended.stderr
