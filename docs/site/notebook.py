"""Run a notebook without Jupyter: `python docs/site/notebook.py NOTEBOOK` runs its cells and stores what they show.

Code cells run in order in one namespace, in a fresh folder that has `studies/` of the repository.
"""

import ast
import base64
import contextlib
import io
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

ROOT = Path(__file__).parents[2]


def executed(notebook: dict[str, Any]) -> dict[str, Any]:
    """The notebook with the outputs of its cells; an error in a cell is raised."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    cells, number = [], 0
    with fresh_folder():
        for cell in notebook["cells"]:
            if cell["cell_type"] == "code":
                number += 1
                cell = cell | {
                    "execution_count": number,
                    "outputs": _outputs("".join(cell["source"]), number, namespace),
                }
            cells.append(cell)
    return notebook | {"cells": cells}


@contextlib.contextmanager
def fresh_folder() -> Iterator[Path]:
    """A temporary folder to work in, with a copy of the shipped studies."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        shutil.copytree(ROOT / "studies", Path(name) / "studies")
        os.chdir(name)
        try:
            yield Path(name)
        finally:
            os.chdir(before)


def _outputs(source: str, number: int, namespace: dict[str, Any]) -> list[dict[str, Any]]:
    """What a cell prints, and the value of its last line."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, f"<cell {number}>", "exec"), namespace)
        value = eval(compile(ast.Expression(last.value), f"<cell {number}>", "eval"), namespace) if last else None
    outputs = []
    if printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue().splitlines(True)})
    if value is not None:
        shown = {"output_type": "execute_result", "execution_count": number, "metadata": {}, "data": _shown(value)}
        outputs.append(shown)
    return outputs


def _shown(value: Any) -> dict[str, Any]:
    """A value by media type, as notebooks show it."""
    data: dict[str, Any] = {"text/plain": repr(value).splitlines(True)}
    for kind, name in (("text/html", "_repr_html_"), ("text/markdown", "_repr_markdown_")):
        if text := getattr(value, name, lambda: None)():
            data[kind] = text.splitlines(True)
    if isinstance(value, Figure):
        picture = io.BytesIO()
        value.savefig(picture, format="png", dpi=110)
        data["image/png"] = base64.b64encode(picture.getvalue()).decode()
    return data


def main() -> None:
    """Run the notebooks named on the command line."""
    for name in sys.argv[1:]:
        path = Path(name).resolve()
        path.write_text(json.dumps(executed(json.loads(path.read_text())), indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
