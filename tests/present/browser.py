"""Pages opened in headless Chromium: what their scripts do, what they complain of, and where their parts stand."""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NARROW, WIDE = 400, 1400
HARNESS = (Path(__file__).parent / "browser.js").read_text()

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no chromium: pages are not opened")


def visit(pages: dict[str, Path], folder: Path, act: str = "") -> tuple[dict, list[str]]:
    """Open each page in a frame of 400 px and in one of 1,400 px.

    Parameters
    ----------
    act : body of a function of `page` (its name), `view` (its window) and `doc`, whose result is kept.

    Returns
    -------
    By `name width` what stands wrongly in the page (`wrong`) and what `act` returned (`found`); the console's messages.
    """
    texts = json.dumps({name: path.read_text() for name, path in pages.items()}).replace("</", "<\\/")
    script = f"const PAGES = {texts}, WIDTHS = [{NARROW}, {WIDE}];\nconst act = (page, view, doc) => {{\n{act}\n}};\n"
    harness = folder / "harness.html"
    harness.write_text(f'<!doctype html><body><pre id="found"></pre><script>{script}{HARNESS}</script></body>')
    words = ["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--virtual-time-budget=20000"]
    own = {"HOME": str(folder), "PATH": os.environ["PATH"]}
    done = subprocess.run(
        [CHROMIUM, *words, f"--user-data-dir={folder / 'profile'}", "--dump-dom", harness.as_uri()],
        capture_output=True, text=True, timeout=90, env=own,
    )  # fmt: skip
    told = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.S)
    assert told, done.stderr[-2000:]
    found = json.loads(told[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
    return found, re.findall(r"CONSOLE[^\n]*", done.stderr)


def stands(page: Path, folder: Path) -> None:
    """Assert that a page is silent and that nothing in it lies on anything else, wherever a browser is there."""
    if CHROMIUM is None:
        return
    found, console = visit({"page": page}, folder)
    assert console == []
    assert {width: kept["wrong"] for width, kept in found.items() if kept["wrong"]} == {}
