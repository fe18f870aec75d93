"""A few hundred mutated files; `make fuzz` tries a hundred thousand."""

import time
from pathlib import Path

import fuzz
import numpy as np
import pytest


@pytest.mark.long
@pytest.mark.skipif(not hasattr(fuzz.signal, "SIGALRM"), reason="needs alarms")
def test_every_mutated_file_is_right_or_refused_in_a_sentence(tmp_path):
    found = {(number, path.name): result for number, path, result in fuzz.tried(range(250), tmp_path)}
    assert {key: result for key, result in found.items() if result not in ("right", "refused")} == {}
    assert list(found.values()).count("refused") > 50


def test_what_fails_is_found(monkeypatch):
    monkeypatch.setattr(fuzz, "check_file", lambda path, manipulator: 1 / 0)
    assert fuzz.outcome(Path("x.toml")).endswith("ZeroDivisionError: division by zero")


def test_a_warning_is_no_answer(monkeypatch):
    monkeypatch.setattr(fuzz, "check_file", lambda path, manipulator: np.degrees(np.float64(1e308)))
    assert "RuntimeWarning: overflow" in fuzz.outcome(Path("x.toml"))


def test_what_calculates_for_ever_is_found_and_what_waits_for_ever(monkeypatch):
    def busy(path, manipulator):
        while True:
            pass

    monkeypatch.setattr(fuzz, "LONGEST_S", 0.2)
    monkeypatch.setattr(fuzz, "check_file", busy)
    assert "no answer within 0.2 s of the processor" in fuzz.outcome(Path("x.toml"))
    monkeypatch.setattr(fuzz, "LONGEST_WAIT_S", 1)
    monkeypatch.setattr(fuzz, "check_file", lambda path, manipulator: time.sleep(30))
    assert "1 s by the clock" in fuzz.outcome(Path("x.toml"))
