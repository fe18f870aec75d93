"""Every number that was chosen says what it means: the settings of the diagnosis and of its benchmark, and what stands
beside the code that needs it."""

import ast
import re
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


BESIDE = [
    path
    for room in ("mechanics", "diagnosis", "recording", "inverse", "study", "runs")
    for path in sorted((ROOT / room).rglob("*.py"))
    if "settings" not in path.parts
]


def unsaid(text):
    """Constants of the text of a module that are numbers, or some of them, without a docstring below."""
    body = ast.parse(text).body
    for part, below in zip(body, [*body[1:], None], strict=False):
        if isinstance(part, ast.Assign | ast.AnnAssign) and part.value is not None:
            parts = [
                node for node in ast.walk(part.value) if not isinstance(node, ast.operator | ast.unaryop | ast.Load)
            ]
            plain = all(
                isinstance(node, ast.Constant | ast.Tuple | ast.List | ast.BinOp | ast.UnaryOp) for node in parts
            )
            number = any(isinstance(node, ast.Constant) and isinstance(node.value, int | float) for node in parts)
            described = isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
            if plain and number and not described:
                yield ast.unparse(part.targets[0] if isinstance(part, ast.Assign) else part.target)


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parts[-3]}-{path.stem}")
def test_every_setting_says_what_it_means(path):
    assert not list(undescribed(path.read_text()))


def test_a_setting_without_a_word_is_seen():
    assert list(undescribed('class A:\n    b: int = 1\n    c: int = 2\n    """Two."""\n    d: int\n')) == ["b", "d"]


def test_every_setting_is_read():
    """By its name, in some other file: a number that nothing depends on would be listed in every result."""
    texts = {path: path.read_text() for path in ROOT.rglob("*.py")}
    for path in FILES:
        others = " ".join(text for other, text in texts.items() if other != path)
        read = set(re.findall(r"\.(\w+)", others))
        parts = [part for part in ast.parse(texts[path]).body if isinstance(part, ast.ClassDef)]
        fields = {field.target.id for part in parts for field in part.body if isinstance(field, ast.AnnAssign)}
        assert fields <= read, (path, fields - read)


def test_every_number_beside_the_code_says_what_it_means():
    assert len(BESIDE) > 80
    assert not {path.relative_to(ROOT): left for path in BESIDE if (left := list(unsaid(path.read_text())))}


def test_a_number_without_a_word_is_seen():
    assert list(unsaid('A = 1\nB, C = 2.0, -3\n"""Both."""\nD: float = 1 / 2**3\nE = "1"\nF = f(4)\n')) == ["A", "D"]
