"""A few hundred mutated files; `make fuzz` tries a hundred thousand."""

from pathlib import Path

import fuzz
import pytest


@pytest.mark.skipif(not hasattr(fuzz.signal, "SIGALRM"), reason="needs alarms")
def test_every_mutated_file_is_right_or_refused_in_a_sentence(tmp_path):
    found = {(number, path.name): result for number, path, result in fuzz.tried(range(250), tmp_path)}
    assert {key: result for key, result in found.items() if result not in ("right", "refused")} == {}
    assert list(found.values()).count("refused") > 50


def test_what_fails_is_found(monkeypatch):
    monkeypatch.setattr(fuzz, "check_file", lambda path, manipulator: 1 / 0)
    assert fuzz.outcome(Path("x.toml")).endswith("ZeroDivisionError: division by zero")
