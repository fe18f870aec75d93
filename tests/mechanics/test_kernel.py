"""Machine code on disk is that of the text that is run, and nobody else's."""

import os
import shutil
import subprocess
import sys
import threading

import numpy as np
import pytest

from prb3r.mechanics import code_cache
from prb3r.mechanics import kernel as compiling
from prb3r.mechanics.code_cache import ROOM, cache_folder, is_prepared, once_at_a_time, text_key
from prb3r.mechanics.kernel import entrance, kernel
from prb3r.runs import provenance


@pytest.fixture
def places(tmp_path, monkeypatch):
    """Folders for the cache and for temporary files, both the user's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(code_cache.tempfile, "tempdir", str(tmp_path / "temporary"))
    for name in ("cache", "temporary"):
        (tmp_path / name).mkdir(mode=0o700)
    return tmp_path


def test_an_edit_in_a_sub_folder_renews_kernels_and_stored_results(places, monkeypatch):
    package = shutil.copytree(ROOM.parent, places / "prb3r", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(provenance, "PACKAGE", package)
    before = cache_folder(package / "mechanics"), provenance.fingerprint()
    assert before[0].name == cache_folder().name
    for file in sorted((package / "mechanics/derivatives").glob("*.py")):
        text = file.read_bytes()
        file.write_bytes(text + b"# edited\n")
        after = cache_folder(package / "mechanics"), provenance.fingerprint()
        assert after[0] != before[0], file
        assert after[1] != before[1], file
        file.write_bytes(text)
    assert (cache_folder(package / "mechanics"), provenance.fingerprint()) == before


def test_a_file_that_moves_is_another_text(tmp_path):
    (tmp_path / "inner").mkdir()
    (tmp_path / "one.py").write_text("x = 1\n")
    before = text_key(tmp_path)
    (tmp_path / "one.py").rename(tmp_path / "inner/one.py")
    assert text_key(tmp_path) != before


def test_the_cache_is_the_users_own_and_the_same_every_time(places):
    folder = cache_folder()
    assert folder.parent == places / "cache/prb3r"
    assert folder.stat().st_mode & 0o777 == 0o700
    assert cache_folder() == folder


@pytest.mark.parametrize("mode", [0o770, 0o702])
@pytest.mark.parametrize("level", [0, 1])
def test_a_folder_that_others_can_write_to_is_not_used(places, mode, level):
    first = cache_folder()
    (first, first.parent)[level].chmod(mode)
    second = cache_folder()
    assert second.is_relative_to(places / "temporary")
    (second, second.parent)[level].chmod(mode)
    third = cache_folder()
    assert third not in (first, second)
    assert third.stat().st_mode & 0o777 == 0o700


def test_a_folder_of_another_user_is_not_used(places, monkeypatch):
    first = cache_folder()
    monkeypatch.setattr(os, "geteuid", lambda: first.stat().st_uid + 1)
    assert not cache_folder().is_relative_to(places / "cache")


def test_a_link_to_a_folder_is_not_used(places):
    first = cache_folder()
    first.rename(places / "elsewhere")
    first.symlink_to(places / "elsewhere")
    assert cache_folder().is_relative_to(places / "temporary")


def test_an_entrance_calls_kernels_that_python_cannot_call(places, monkeypatch):
    for room in (compiling, code_cache):
        monkeypatch.setattr(room, "own_folder", lambda: str(cache_folder()))
    assert not is_prepared()

    def divided(numbers, by):
        numbers[0] += 1.0
        return numbers[0] / by

    inner = kernel(divided)
    outer = entrance(lambda numbers, by: inner(numbers, by) * 2.0)
    assert outer(np.ones(1), 4.0) == 1.0
    assert is_prepared()
    assert outer(np.ones(1), 0.0) == np.inf
    with pytest.raises(TypeError, match="divided is called by compiled code alone"):
        inner(np.ones(1), 4.0)
    assert entrance(inner.py_func)(np.ones(1), 4.0) == 0.5


@pytest.mark.skipif(code_cache.fcntl is None, reason="no locks of files")
def test_those_who_want_the_same_wait_for_the_first_and_then_for_nobody(tmp_path):
    entered, waiting = threading.Semaphore(0), threading.Barrier(3)

    def follow():
        with once_at_a_time(tmp_path / "lock"):
            entered.release()
            waiting.wait(timeout=60)  # both are inside at the same time

    followers = [threading.Thread(target=follow) for _ in range(2)]
    with once_at_a_time(tmp_path / "lock"):
        for follower in followers:
            follower.start()
        assert not entered.acquire(timeout=0.3)
    waiting.wait(timeout=60)
    for follower in followers:
        follower.join(timeout=60)
        assert not follower.is_alive()


def test_where_no_lock_can_be_had_work_goes_on(tmp_path):
    with once_at_a_time(tmp_path / "missing/lock"):
        pass


MODULE = """
import sys
import numpy as np
from prb3r.mechanics import kernel as compiling
compiling.own_folder = lambda: sys.argv[1]
from prb3r.mechanics.kernel import entrance

@entrance
def kind(values):
    return values.size * 100 + values.itemsize
"""


@pytest.mark.skipif(code_cache.fcntl is None, reason="no locks of files")
def test_kinds_that_are_kept_at_the_same_time_do_not_take_each_others_place(tmp_path):
    """Two processes compile one function for two kinds of arguments, and write at the same moment."""
    (tmp_path / "kinds.py").write_text(MODULE)
    (tmp_path / "code").mkdir()
    types = ["int8", "float64"]
    write = """
from numba.core.caching import IndexDataCacheFile
import pathlib, time
choose = IndexDataCacheFile._load_index
def slowly(self):
    found = choose(self)
    time.sleep(0.2)
    return found
import kinds
IndexDataCacheFile._load_index = slowly
pathlib.Path(sys.argv[3] + ".ready").touch()
while len(list(pathlib.Path(".").glob("*.ready"))) < 2:
    time.sleep(0.01)
kinds.kind(np.zeros(3, sys.argv[2]))
"""
    read = """
import kinds
for dtype in sys.argv[2:]:
    print(kinds.kind(np.zeros(3, dtype)), sum(kinds.kind.stats.cache_hits.values()))
"""
    head = "import sys\nimport numpy as np\n"

    def started(text, *words):
        arguments = [sys.executable, "-c", head + text, str(tmp_path / "code"), *words]
        return subprocess.Popen(arguments, cwd=tmp_path, stdout=subprocess.PIPE, text=True)

    for process in [started(write, dtype, dtype) for dtype in types]:
        with process:
            assert process.wait(timeout=120) == 0
    with started(read, *types) as process:
        found = process.communicate(timeout=120)[0].splitlines()
    assert found == [f"{300 + np.dtype(dtype).itemsize} {k}" for k, dtype in enumerate(types, 1)]


PARTS = """
import sys
import numpy as np
from prb3r.mechanics import kernel as compiling
compiling.own_folder = lambda: sys.argv[1]
from prb3r.mechanics.kernel import entrance, kernel

@kernel
def long(row, x):
{lines}
    return x

@entrance
def twice(rows, x):
    return long(rows[0], x) + long(rows[0], x + 1.0)

KINDS = {{
    "one": np.dtype([("low", float), ("high", float)]),
    "other": np.dtype([("high", float), ("between", float), ("low", float)]),
}}
for name in sys.argv[2:]:
    row = np.zeros(1, KINDS[name])
    row["low"], row["high"] = 2.0, 0.25
    print(twice(row, 1.0))
"""


@pytest.mark.long
def test_kernels_from_two_processes_keep_their_parts_apart(tmp_path):
    """Each process numbers the types that it meets from the same number on: so long as parts were shared by their
    names, the second kernel to be loaded read its records as the first one's."""
    lines = [f"    x = x * 1.5 + row.low if x < {k}.0 else x - row.high * {k}.0" for k in range(60)]  # not inlined
    (tmp_path / "parts.py").write_text(PARTS.format(lines="\n".join(lines)))
    (tmp_path / "code").mkdir()

    def answers(*names):
        arguments = [sys.executable, "parts.py", "code", *names]
        environment = os.environ | {"PYTHONHASHSEED": "0"}  # names hold the order of a set too
        run = subprocess.run(arguments, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
        return list(map(float, run.stdout.split()))

    one, other = answers("one"), answers("other")
    assert one == other
    assert answers("one", "other") == answers("other", "one") == one + other
