"""Every code block of the README and the documentation runs, page by page, in a folder with the shipped studies.

Studies of many draws make few of them there; `tests/study` has their numbers.

Blocks that take long are marked `<!-- long: why -->` and run where PRB3R_LONG is set; those that need what a test has
not are marked `<!-- not run: why -->`.
"""

import os
import re
import shutil
import sys

import matplotlib as mpl
import pytest
from docs.blocks import PAGES, ROOT, Session, blocks_of

BLOCKS = [block for page in PAGES for block in blocks_of(page)]
LANGUAGES = {"python", "toml", "csv", "sh", "text"}
MOST_MARKED, MOST_NEVER_RUN = 12, 4


@pytest.fixture
def session(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "studies", tmp_path / "studies")
    for study in ("tolerances.toml", "sensitivity.toml"):
        path = tmp_path / "studies" / study
        text, drawn = re.subn(r"^count = \d+$", "count = 32", path.read_text(), flags=re.MULTILINE)
        assert drawn == 1
        path.write_text(text)
    program = tmp_path / ".venv/bin/prb3r"
    program.parent.mkdir(parents=True)
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m prb3r "$@"\n')
    program.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setattr(os, "cpu_count", lambda: 1)  # workers would load kernels anew
    with mpl.rc_context():
        yield Session(tmp_path)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_run(page, session):
    for block in blocks_of(page):
        if not block.marker or (block.marker == "long" and "PRB3R_LONG" in os.environ):
            try:
                session.run(block)
            except BaseException as error:
                error.add_note(f"in the block at {block}")
                raise


def test_every_block_has_a_language_that_can_be_run():
    assert {str(block): block.language for block in BLOCKS if block.language not in LANGUAGES} == {}
    assert len(BLOCKS) > 50


def test_few_blocks_are_left_out_and_all_of_them_say_why():
    marked = [block for block in BLOCKS if block.marker]
    never = [block for block in marked if block.marker == "not run"]
    assert len(marked) <= MOST_MARKED, list(map(str, marked))
    assert len(never) <= MOST_NEVER_RUN, list(map(str, never))
    assert all(len(block.reason.split()) > 1 for block in marked)


def test_every_marker_stands_before_a_block():
    markers = sum(page.read_text().count("\n<!-- not run:") + page.read_text().count("\n<!-- long:") for page in PAGES)
    assert markers == sum(bool(block.marker) for block in BLOCKS)
