"""Every number that was chosen says what it means: the settings of the diagnosis and of its benchmark."""

import ast
from pathlib import Path

import pytest

import prb3r

ROOT = Path(prb3r.__file__).parent
FOLDERS = ROOT / "diagnosis/settings", ROOT / "proof/settings"
FILES = [path for folder in FOLDERS for path in sorted(folder.glob("*.py")) if path.stem != "__init__"]


def undescribed(text):
    """Fields of the classes in the text of a module without a docstring below them."""
    for part in ast.parse(text).body:
        body = part.body if isinstance(part, ast.ClassDef) else []
        for field, below in zip(body, [*body[1:], None], strict=False):
            described = isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
            if isinstance(field, ast.AnnAssign) and not (described and isinstance(below.value.value, str)):
                yield field.target.id


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parts[-3]}-{path.stem}")
def test_every_setting_says_what_it_means(path):
    assert not list(undescribed(path.read_text()))


def test_a_setting_without_a_word_is_seen():
    assert list(undescribed('class A:\n    b: int = 1\n    c: int = 2\n    """Two."""\n    d: int\n')) == ["b", "d"]
