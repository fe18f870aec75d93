"""The documentation as HTML and the notebook: built without network, complete, and leading nowhere else."""

import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser

import pytest
from docs.blocks import ROOT

import prb3r
from prb3r.schema import FILES, schema_of

SITE = ROOT / "docs/site"
VOID = {"meta", "link", "img", "br", "hr", "input", "mspace"}


class Outline(HTMLParser):
    """Addresses, anchors and elements that are left open."""

    def __init__(self):
        super().__init__()
        self.targets, self.loaded, self.ids, self.open, self.wrong = [], [], set(), [], []

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.ids |= {attrs["id"]} if "id" in attrs else set()
        self.targets += [attrs["href"]] if "href" in attrs else []
        self.loaded += [attrs["src"]] if "src" in attrs else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID and (not self.open or self.open.pop() != tag):
            self.wrong.append((tag, self.getpos()))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    for library in ("latex2mathml", "mdit_py_plugins"):
        pytest.importorskip(library, reason="the documentation needs `pip install -e .[docs]`")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, str(SITE / "build.py"), "-o", str(folder), "--results", str(folder / "none")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])}
    subprocess.run(command, check=True, cwd=ROOT, env=environment, timeout=120)
    outlines = {}
    for page in folder.glob("*.html"):
        outlines[page.name] = Outline()
        outlines[page.name].feed(page.read_text())
    return folder, outlines


@pytest.mark.long
def test_pages_are_well_formed_and_load_nothing_from_elsewhere(site):
    folder, outlines = site
    assert len(outlines) > 25
    for name, outline in outlines.items():
        assert not outline.open, name
        assert not outline.wrong, name
        for source in outline.loaded:
            assert (folder / source).is_file(), (name, source)
        assert "@import" not in (folder / name).read_text()


def test_links_lead_to_pages_and_headings(site):
    folder, outlines = site
    for name, outline in outlines.items():
        for target in outline.targets:
            path, _, anchor = target.partition("#")
            if not re.match("[a-z]+:", target):
                assert (folder / path).is_file() or not path, (name, target)
                assert not anchor or anchor in outlines[path or name].ids, (name, target)


def test_the_reference_has_every_name_command_and_key(site):
    folder, _ = site
    python, commands = ((folder / f"reference-{name}.html").read_text() for name in ("python", "commands"))
    for name in set(prb3r.__all__) - {"__version__"}:
        assert f"prb3r.{name}</code>" in python
    for name in prb3r.cli.main.commands:
        assert f"<code>prb3r {name}</code>" in commands
    for file in FILES:
        text = (folder / f"reference-{file}.html").read_text()
        for part in (schema_of(file), *schema_of(file).get("$defs", {}).values()):
            assert all(f"<code>{key}</code>" in text for key in part.get("properties", {}))


def test_nothing_is_escaped_twice(site):
    folder, _ = site
    assert "<code>cable_&lt;name&gt;_n</code>" in (folder / "reference-manipulator.html").read_text()
    assert not [page.name for page in folder.glob("*.html") if re.search("&amp;(lt|gt|amp);", page.read_text())]


def test_formulas_become_mathml(site):
    folder, _ = site
    text = (folder / "theory.html").read_text()
    assert text.count("<math") > 10
    assert "$$" not in text


def test_the_notebook_runs():
    sys.path.insert(0, str(SITE))
    try:
        from notebook import executed
    finally:
        sys.path.remove(str(SITE))
    shipped = json.loads((ROOT / "docs/from-nothing-to-a-decision.ipynb").read_text())
    run = executed(shipped)
    assert [_kinds(cell) for cell in run["cells"]] == [_kinds(cell) for cell in shipped["cells"]]
    assert _recommendation(run) == _recommendation(shipped)


def _kinds(cell):
    return [sorted(output.get("data", output)) for output in cell.get("outputs", [])]


def _recommendation(notebook):
    shown = [
        "".join(out.get("data", {}).get("text/plain", ""))
        for cell in notebook["cells"]
        for out in cell.get("outputs", [])
    ]
    return next(text for text in shown if text.startswith("Recommendation"))
