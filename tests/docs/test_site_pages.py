"""Pages that lead somewhere: links, anchors, navigation, length of the README."""

import re
import tomllib
from pathlib import Path
from urllib.parse import unquote

import pytest
from docs.blocks import PAGES, ROOT
from markdown_it import MarkdownIt

LINKED = [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "results/README.md", ROOT / "schemas/README.md"]
NAVIGATION = tomllib.loads((ROOT / "docs/site/navigation.toml").read_text())["group"]


def links(page: Path):
    for token in MarkdownIt("commonmark").enable("table").parse(page.read_text()):
        for child in token.children or []:
            target = child.attrs.get("href") or child.attrs.get("src")
            if target and not re.match("[a-z]+:", target):
                yield target


def anchors(page: Path):
    """Anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", LINKED, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files_and_headings(page):
    for target in links(page):
        path, _, anchor = target.partition("#")
        file = (page.parent / unquote(path)).resolve() if path else page
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), target


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text().splitlines()) < 200


def test_the_navigation_has_every_page_once():
    named = [name for group in NAVIGATION for name in group.get("pages", [])]
    assert sorted(named) == sorted(page.stem for page in PAGES if page.parent.name == "docs")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_is_reached_from_the_index_or_the_readme(page):
    start = {ROOT / "README.md", ROOT / "docs/index.md"}
    reached = {(entry.parent / target.partition("#")[0]).resolve() for entry in start for target in links(entry)}
    assert page in reached | start


def test_numbers_that_the_readme_quotes_are_those_of_the_tables():
    readme = (ROOT / "README.md").read_text()
    quoted = {
        "speed": ["0.077", "0.0378", "1,039", "16,239", "e1c4e48"],
        "proof": ["2.0e-6", "1.1e-4", "7900e61", "61.7 %", "38.3 %", "62 of 70"],
        "diagnosis": ["0bee38d", "0.45", "0.94", "11.1", "2.3"],
    }
    quoted["proof"].extend(["90.7 %", "3.4 %", "98.1 %", "97.0 %", "39.1 %", "76.4 %", "879e0e0"])
    for page, numbers in quoted.items():
        text = (ROOT / f"docs/{page}.md").read_text()
        for number in numbers:
            assert number in readme, number
            assert number in text, number


def test_every_shipped_study_is_listed():
    listed = re.findall(
        r"^\| `([\w-]+)` \|", (ROOT / "docs/studies.md").read_text().split("## The shipped studies")[1], re.M
    )
    assert sorted(listed) == sorted(study.stem for study in (ROOT / "studies").glob("*.toml"))
