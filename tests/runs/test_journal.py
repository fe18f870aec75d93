"""What was kept before an interruption is there after it, whole or not at all."""

import time

import numpy as np
import pytest

from prb3r.errors import EngineError
from prb3r.runs.journal import Journal, Stages


def filled(path):
    journal = Journal(path, "one run")
    for number in range(5):
        journal.add("squares", number, np.full(100, number**2))
    return journal


def test_values_come_back_as_they_were(tmp_path):
    filled(tmp_path / "new" / "journal")
    again = Journal(tmp_path / "new" / "journal", "one run")
    assert {k: v[0] for k, v in again.known("squares").items()} == {0: 0, 1: 1, 2: 4, 3: 9, 4: 16}
    assert again.known("cubes") == {}


def test_time_spent_adds_up_over_interruptions(tmp_path):
    for number in range(3):
        journal = Journal(tmp_path / "journal", "one run")
        time.sleep(0.05)
        journal.add("squares", number, number**2)
    assert Journal(tmp_path / "journal", "one run").seconds > 0.15


@pytest.mark.parametrize("torn", [1, 5, 30])
def test_a_torn_last_entry_is_cut_off_and_the_rest_goes_on(tmp_path, torn):
    path = tmp_path / "journal"
    filled(path)
    path.write_bytes(path.read_bytes()[:-torn])
    Journal(path, "one run").add("squares", 7, 49)
    assert sorted(Journal(path, "one run").known("squares")) == [0, 1, 2, 3, 7]


@pytest.mark.parametrize("content", [None, b"", b"something else entirely" * 9])
def test_another_run_begins_anew(tmp_path, content):
    path = tmp_path / "journal"
    filled(path)
    if content is not None:
        path.write_bytes(content)
    Journal(path, "another run").add("squares", 1, 1)
    assert Journal(path, "another run").known("squares") == {1: 1}


def test_what_is_there_is_not_made_again(tmp_path):
    filled(tmp_path / "journal")
    said = []
    kept = Journal(tmp_path / "journal", "one run")
    tasks = [(0, tmp_path)] * 5 + [(6, tmp_path)]
    results = Stages(kept, 1, said.append).results("squares", square, tasks)
    assert [float(np.mean(result)) for result in results] == [0, 1, 4, 9, 16, 36]
    assert [each.name for each in tmp_path.glob("made*")] == ["made-6"]
    kept.discard()
    assert not (tmp_path / "journal").exists()


def square(task):
    number, folder = task
    (folder / f"made-{number}").touch()
    return number**2


def test_where_nothing_can_be_written_nothing_is_begun(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(EngineError, match="cannot be written"):
        Journal(tmp_path / "file" / "journal", "one run")
