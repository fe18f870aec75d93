"""The index page over a folder of results: everything in it is listed, with its answer, and nothing else."""

import json
import re
from html import unescape

import pytest
from click.testing import CliRunner
from matplotlib.figure import Figure
from present.browser import needs_chromium, visit

from prb3r.cli import main
from prb3r.present.index import write_index

STUDY = {"name": "a", "title": "How far <it> bends", "question": "How far?", "plot": [{"name": "tips"}]}
PAGE = '<title>t</title><meta name="description" content="It bends 3 mm."><style>'


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "results"
    for name in ("a study", "inner/b", "cmp", "diagnoses/rig", "proof", ".hidden"):
        (folder / name).mkdir(parents=True)
    written = {"written": "2026-11-22T16:05:24Z"}
    for name in ("a study", "inner/b", ".hidden"):
        told = written | {"study": STUDY, "cases": 5, "outcomes": {"converged": 3, "no equilibrium": 2}}
        (folder / name / "manifest.json").write_text(json.dumps(told))
    (folder / "a study/report.html").write_text(PAGE)
    figure = Figure(figsize=(4, 3))
    figure.subplots().plot([0, 1])
    figure.savefig(folder / "a study/tips.png")
    (folder / "inner/b/tips.png").write_bytes(b"damaged")
    (folder / "inner/b/summary.md").write_text("# b")
    (folder / "cmp/comparison.md").write_text("\n**Recommendation:** the thin one.\n")
    effects = [{"statement": "Plate 4 is weak."}]
    (folder / "diagnoses/rig/diagnosis.json").write_text(json.dumps({"verdict": "explained", "effects": effects}))
    scores = {"prb3r": [{"met": True}, {"met": False}]}
    (folder / "proof/proof.json").write_text(json.dumps({"scores": scores, "recordings": 60, "environment": written}))
    return folder


def test_everything_is_listed_with_its_answer_and_a_link_that_leads_there(results):
    page, count = write_index(results)
    text = unescape(page.read_text())
    assert count == 5
    assert "2 studies, 1 comparison, 1 diagnosis, 1 proof." in text
    links = {link.replace("%20", " ") for link in re.findall(r'href="([^"]*)"', text)}
    assert links == {
        "a study/report.html", "inner/b/summary.md", "cmp/comparison.md", "diagnoses/rig/diagnosis.json",
        "proof/proof.json",
    }  # fmt: skip
    assert all((results / link).exists() for link in links)
    for answer in (
        "It bends 3 mm.", "5 cases, 2 of them without a stable equilibrium.", "Recommendation: the thin one.",
        "Explained. Plate 4 is weak.", "1 of 2 goals are met, over 60 recordings", "How far <it> bends",
    ):  # fmt: skip
        assert answer in text
    assert text.count("data:image/png") == 1
    assert "2026-11-22 16:05" in text


def test_the_same_results_give_the_same_index(results):
    first = write_index(results)[0].read_bytes()
    assert write_index(results)[0].read_bytes() == first


def test_damaged_results_are_passed_over(results):
    (results / "proof/proof.json").write_text("{")
    (results / "diagnoses/rig/diagnosis.json").write_text("[]")
    (results / "inner/b/manifest.json").write_text('{"study": 3}')
    assert write_index(results)[1] == 2


def test_where_there_is_nothing_the_command_says_so_and_ends_with_2(results, tmp_path):
    done = CliRunner().invoke(main, ["report", str(results)])
    assert done.exit_code == 0, done.output
    assert "5 results in" in done.output
    (tmp_path / "empty").mkdir()
    for folder, what in (("empty", "holds no study, comparison, diagnosis or proof"), ("none", "no such folder")):
        done = CliRunner().invoke(main, ["report", str(tmp_path / folder)])
        assert done.exit_code == 2
        assert what in done.output
    assert list((tmp_path / "empty").iterdir()) == []


@needs_chromium
def test_nothing_overlaps_in_the_index(results, tmp_path):
    found, console = visit({"index": write_index(results)[0]}, tmp_path)
    assert console == []
    assert [kept["wrong"] for kept in found.values()] == [[], []]
