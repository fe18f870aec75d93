"""What the docstrings below the fields of a class say, read from its source where schemas and the reference ask for it.

Pydantic would read them whenever a class is made, which takes a tenth of the time of loading the package.
"""

import ast
import inspect
import textwrap
from itertools import pairwise


def field_docstrings(kind: type) -> dict[str, str]:
    """The docstring of each field of a class that has one, by name; also of fields of its bases within the package."""
    said: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        if base.__module__.startswith("prb3r."):
            said |= _own_docstrings(base)
    return said


def _own_docstrings(kind: type) -> dict[str, str]:
    """The docstrings of the fields that the body of a class states itself."""
    (stated,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    assert isinstance(stated, ast.ClassDef)
    return {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in pairwise(stated.body)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant) and isinstance(text.value.value, str)
    }
