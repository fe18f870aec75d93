"""Stored results are those of the program that made them: whatever its text decides is computed anew."""

import re
import shutil
from pathlib import Path

import pytest

import prb3r
from prb3r.runs import provenance
from prb3r.runs.provenance import fingerprint, text_hash

PACKAGE = Path(prb3r.__file__).parent


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.fixture
def room(tmp_path):
    for place in ("room/one.py", "room/inner/two.py", "room/inner/deeper/three.py"):
        write(tmp_path / place, f"# {place}\n")
    return tmp_path / "room"


@pytest.mark.parametrize("place", ["one.py", "inner/two.py", "inner/deeper/three.py"])
def test_the_hash_follows_the_text_of_every_file_at_any_depth(room, place):
    before = text_hash(room)
    (room / place).write_text("other = 1\n")
    assert text_hash(room) != before


def test_the_hash_follows_files_that_come_go_and_move_but_not_what_is_no_program(room):
    before = text_hash(room)
    write(room / "inner/notes.txt", "no program")
    write(room / "inner/__pycache__/two.cpython-311.pyc", "compiled")
    assert text_hash(room) == before
    (room / "inner/two.py").rename(room / "two.py")
    moved = text_hash(room)
    write(room / "inner/empty/__init__.py", "")
    added = text_hash(room)
    (room / "one.py").unlink()
    assert len({before, moved, added, text_hash(room)}) == 4


def imported(folder):
    """Names of the parts of prb3r that the files below a folder import."""
    return {name for path in folder.rglob("*.py") for name in re.findall(r"from prb3r\.(\w+)", path.read_text())}


def test_the_fingerprint_of_stored_results_covers_all_that_a_study_computes_with(tmp_path, monkeypatch):
    """An edit of any file that a study imports, in whatever sub-folder, is another fingerprint."""
    copy = shutil.copytree(PACKAGE, tmp_path / "prb3r", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(provenance, "PACKAGE", copy)
    rooms, before = {"study"}, fingerprint()
    while missing := {name for room in rooms for name in imported(copy / room) if (copy / name).is_dir()} - rooms:
        rooms |= missing
    assert before == text_hash(*(PACKAGE / room for room in rooms))
    for path in sorted(path for room in rooms for path in (copy / room).rglob("*.py")):
        text = path.read_bytes()
        path.write_bytes(text + b"\n")
        assert fingerprint() != before, path
        path.write_bytes(text)
    with (copy / "present/style.py").open("a") as file:
        file.write("# figures are drawn anew in any case\n")
    assert fingerprint() == before
    assert fingerprint("present") != before
