"""What goes with the program: version, citation, continuous integration, schemas of the shipped files."""

import json
import tomllib
from pathlib import Path

import pytest
import yaml

import prb3r
from prb3r.schema import FILES, schema_of

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text())
KINDS = {"studies": "study", "studies/manipulators": "manipulator"}
SHIPPED = [(path, kind) for folder, kind in KINDS.items() for path in sorted((ROOT / folder).glob("*.toml"))]


def test_the_version_stands_in_the_package_and_is_cited():
    assert PROJECT["project"]["dynamic"] == ["version"]
    assert prb3r.__version__ in (ROOT / PROJECT["tool"]["hatch"]["version"]["path"]).read_text()
    assert CITATION["version"] == prb3r.__version__


def test_the_citation_names_the_paper_that_the_readme_names():
    readme = " ".join((ROOT / "README.md").read_text().split())
    assert all(reference["title"] in readme for reference in CITATION["references"])
    assert CITATION["authors"] == PROJECT["project"]["authors"]


def test_public_ci_runs_what_the_classifiers_promise():
    jobs = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]
    named = [text.rsplit(" ", 1)[1] for text in PROJECT["project"]["classifiers"] if "Python :: 3." in text]
    assert jobs["test"]["strategy"]["matrix"]["python"] == named
    targets = {line.split(":")[0] for line in (ROOT / "Makefile").read_text().splitlines()}
    steps = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    assert {step.split()[1] for step in steps if step.startswith("make ")} <= targets


def test_no_licence_is_claimed_before_one_is_chosen():
    assert "license" not in PROJECT["project"]
    assert "license" not in CITATION
    assert "None has been chosen yet" in (ROOT / "README.md").read_text()


@pytest.mark.parametrize("file", FILES)
def test_shipped_schemas_say_of_files_what_the_program_does(file):
    shipped = json.loads((ROOT / f"schemas/{file}.json").read_text())
    assert _described(shipped) == _described(schema_of(file)), "run `make schemas`"


def _described(schema):
    """Every key of every table, what it means and whether it is needed; the rest depends on the version of pydantic."""
    tables = {"": schema, **schema.get("$defs", {})}
    return {
        (table, key): (field["description"], key in part.get("required", []), field.get("const", field.get("enum")))
        for table, part in tables.items()
        for key, field in part.get("properties", {}).items()
    }


@pytest.mark.parametrize(("path", "kind"), SHIPPED, ids=lambda value: getattr(value, "stem", None))
def test_shipped_files_name_their_schema_for_editors(path, kind):
    mark, _, target = path.read_text().splitlines()[0].partition(" ")
    assert mark == "#:schema"
    assert (path.parent / target).resolve() == ROOT / f"schemas/{kind}.json"
