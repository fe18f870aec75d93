"""Its presence puts this folder on the import path: `prototype.py` builds the chains that many tests share."""

import compileall
import gc
import os
import random
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

PLACES = {
    "mechanics/test_constant_curvature": 5,  # of the elastica, whose kernels share parts with those of rank 4
    "mechanics/": 0,
    "model/test_toml": 3,  # no kernels: the middle
    "model/": 1,
    "study/": 2,
    "proof/": 4,
    "diagnosis/": 5,
    "recording/": 5,
    "runs/": 2,
    "docs/test_code_blocks": 5,  # long: not at the end, where one worker would wait for the other
    "test_cli_diagnose": 5,
    "present/": 6,
    "": 7,
}
"""By how the path of a test begins."""
ENDS_AT, REVISION = "PRB3R_TESTS_END_AT", "PRB3R_TESTS_REVISION"
"""Where these are set: the time of day, s since 1970, from which on no test is begun, and a text that tells in which
order they come, so that what one revision leaves out for want of time another one takes."""


def pytest_collection_modifyitems(items):
    """Two workers begin at the start and in the middle, each with its own kernels to compile, which are cached."""
    here = Path(__file__).parent

    def place(item):
        path = item.path.relative_to(here).as_posix()
        return next(rank for start, rank in PLACES.items() if path.startswith(start))

    items.sort(key=place)
    if revision := os.environ.get(REVISION):
        random.Random(revision).shuffle(items)


def pytest_runtest_setup(item):
    if time.time() > float(os.environ.get(ENDS_AT, "inf")):
        pytest.skip("left out: the time for these tests is up")


def pytest_collection():
    """Modules are read and nothing is thrown away: there is no garbage to search for."""
    gc.disable()


def pytest_collection_finish():
    """What modules hold stays to the end: no search for garbage need go through it again and again."""
    gc.freeze()
    gc.enable()


def pytest_configure(config):
    """A folder for what the workers compute once for all of them, which they are told of by the environment.

    Each of them calculates in one thread, as the program's own workers do: more wait for each other, busily.  The
    package is compiled once, as `make setup` does: where nothing may write bytecode, some sixty processes would do so.
    """
    if not hasattr(config, "workerinput"):
        compileall.compile_dir(Path(__file__).parents[1] / "prb3r", quiet=2)
        os.environ |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"), "1")
        shared = TemporaryDirectory(prefix="prb3r-tests-")
        os.environ["PRB3R_TESTS_SHARED"] = shared.name
        config.add_cleanup(shared.cleanup)
