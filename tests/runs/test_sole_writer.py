"""One writer at a time; what others have written is neither believed nor unpickled."""

import json
import os
import pickle
import signal
import subprocess
import sys
import zlib

import pytest

from prb3r.errors import EngineError
from prb3r.runs.files import LOCK, replaced, sole_writer
from prb3r.runs.journal import Journal
from prb3r.runs.provenance import MANIFEST, read_manifest

HOLD = """
import sys, time
from pathlib import Path
from prb3r.runs.files import sole_writer
with sole_writer(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    call = [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(call, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_a_second_writer_is_refused_and_told_which_process_writes(tmp_path, holder):
    with (
        pytest.raises(EngineError, match=rf"another run \(process {holder.pid}\) is writing there"),
        sole_writer(tmp_path),
    ):
        raise AssertionError


def test_a_writer_that_is_killed_leaves_the_folder_free(tmp_path, holder):
    holder.send_signal(signal.SIGKILL)
    holder.wait(timeout=10)
    with sole_writer(tmp_path):
        assert (tmp_path / LOCK).read_text() == f"{os.getpid()}\n"
    with sole_writer(tmp_path):
        pass
    assert (tmp_path / LOCK).read_text() == ""


def test_a_lock_that_is_a_link_is_not_followed(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    (tmp_path / LOCK).symlink_to(victim)
    with pytest.raises(EngineError, match="cannot be written"), sole_writer(tmp_path):
        raise AssertionError
    assert victim.read_text() == "precious"


def test_files_take_the_place_of_links_and_two_writers_never_share_a_temporary_name(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    (tmp_path / "table").symlink_to(victim)
    with replaced(tmp_path / "table") as first, replaced(tmp_path / "table") as second:
        assert first != second
        first.write_text("first")
        second.write_text("second")
    assert (victim.read_text(), (tmp_path / "table").read_text()) == ("precious", "first")
    assert not (tmp_path / "table").is_symlink()


@pytest.mark.parametrize(
    "text",
    ["", "[]", "5", "{", "[" * 100_000, '{"run": 5, "key": [1], "study": 3, "file": {}, "timing": NaN}', b"\xff\xfe{"],
)
def test_a_damaged_manifest_is_none_or_has_only_what_a_run_writes(tmp_path, text):
    (tmp_path / MANIFEST).write_bytes(text if isinstance(text, bytes) else text.encode())
    assert not read_manifest(tmp_path)


def test_a_manifest_keeps_what_is_in_order(tmp_path):
    (tmp_path / MANIFEST).write_text(json.dumps({"run": 5, "key": "a", "cases": 3}))
    assert read_manifest(tmp_path) == {"key": "a", "cases": 3}


class Planted:
    """What runs a command when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def entry(value):
    return zlib.compress(pickle.dumps(value))


@pytest.mark.parametrize("with_code", [False, True])
def test_a_journal_that_others_have_written_is_begun_anew_and_never_unpickled(tmp_path, with_code):
    planted = entry(Planted(tmp_path / "pwned"))
    code = bytes(32) if with_code else b""
    (tmp_path / "journal").write_bytes(len(planted).to_bytes(8, "big") + code + planted)
    journal = Journal(tmp_path / "journal", "key")
    assert journal.known("stage") == {}
    assert not (tmp_path / "pwned").exists()


def test_a_journal_of_another_user_is_begun_anew(tmp_path, monkeypatch):
    Journal(tmp_path / "journal", "key").add("stage", 1, "mine")
    assert Journal(tmp_path / "journal", "key").known("stage") == {1: "mine"}
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))  # where another user's secret would be
    assert Journal(tmp_path / "journal", "key").known("stage") == {}


def test_a_secret_that_others_can_read_is_no_secret(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    Journal(tmp_path / "journal", "key").add("stage", 1, "mine")
    secret = tmp_path / "cache" / "prb3r" / "secret"
    assert secret.stat().st_mode & 0o777 == 0o600
    secret.chmod(0o644)
    assert Journal(tmp_path / "journal", "key").known("stage") == {}


@pytest.mark.parametrize("name", ["SIGHUP", "SIGTERM", "SIGINT"])
def test_a_run_is_stopped_by_every_signal_before_it_has_workers_too(tmp_path, name):
    script = (
        "import signal, sys, time, types\n"
        "signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"  # whatever the shell that runs the tests ignores
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from prb3r.cli import main\n"
        "def slow(*_):\n"
        "    print('up', flush=True)\n"
        "    while True: time.sleep(0.01)\n"  # a signal just before one long sleep would be heard after it
        "sys.modules['prb3r.check'] = types.SimpleNamespace(check_file=slow, only_manipulator=list)\n"
        "main()\n"
    )
    call = [sys.executable, "-c", script, "check", str(tmp_path)]
    with subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "up\n"
        process.send_signal(getattr(signal, name))
        try:
            _, said = process.communicate(timeout=30)
        finally:
            process.kill()
    assert process.returncode == 130, said
    assert said.endswith("interrupted\n"), said  # a check keeps nothing


def test_a_run_under_nohup_outlives_its_terminal(tmp_path):
    script = (
        "import os, signal, sys, types; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from prb3r.runs.engine import stopping_signals\n"
        "assert signal.SIGHUP not in stopping_signals()\n"
        "from prb3r.cli import main\n"
        "hung_up = lambda *a: os.kill(os.getpid(), signal.SIGHUP) or 'in order'\n"
        "sys.modules['prb3r.check'] = types.SimpleNamespace(check_file=hung_up, only_manipulator=list)\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, "check", str(tmp_path)], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, "in order" in done.stdout) == (0, True), done.stderr
