"""A name has one meaning: no public function, class or constant of a module stands in another one too."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest

import prb3r

ROOT = Path(prb3r.__file__).parent


def defined_names(text):
    """Public names that the text of a module defines at its top level."""
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names = [node.name]
        elif isinstance(node, ast.Assign):
            parts = [part for target in node.targets for part in ast.walk(target) if isinstance(part, ast.Name)]
            names = [part.id for part in parts if isinstance(part.ctx, ast.Store)]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names = [node.target.id]
        else:
            continue
        yield from (name for name in names if not name.startswith("_"))


@pytest.fixture(scope="module")
def homes():
    """The modules that define each public name, as paths below the package without suffix."""
    homes = defaultdict(set)
    for path in ROOT.rglob("*.py"):
        for name in defined_names(path.read_text()):
            homes[name].add(path.relative_to(ROOT).with_suffix("").as_posix())
    return homes


def test_a_name_has_one_meaning(homes):
    assert len(homes) > 500
    twice = {name: sorted(modules) for name, modules in homes.items() if len(modules) > 1}
    assert not twice


def test_the_test_sees_functions_classes_and_constants_that_are_public():
    text = "A, (B, _c) = 1, (2, 3)\nD: int = 4\nclass E:\n    f = 5\ndef g():\n    h = 6\ndef _i(): ...\nA.x = 7\n"
    assert list(defined_names(text)) == ["A", "B", "D", "E", "g"]
