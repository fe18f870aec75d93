"""Imports go in one direction, and each layer imports only the packages it is meant to."""

import ast
from pathlib import Path

import prb3r

ROOT = Path(prb3r.__file__).parent
ORDER = [
    "errors",
    "quantities",
    "mechanics",
    "model",
    "study",
    "recording",
    "proof",
    "present",
    "bench",
    "progress",
    "check",
    "cli",
]
ALLOWED = {
    "errors": set(),
    "quantities": set(),
    "mechanics": {"numpy", "scipy", "numba"},
    "model": {"numpy", "pandas", "pydantic", "scipy"},
    "study": {"numpy", "pandas", "scipy", "pydantic", "pyarrow"},
    "study/engine": {"joblib", "distributed", "threadpoolctl"},
    "recording": {"numpy", "pandas", "scipy", "pydantic"},
    "proof": {"numpy", "scipy", "numba", "pandas"},
    "present": {"numpy", "pandas", "scipy", "jinja2", "matplotlib"},
    "bench": {"numpy", "scipy", "pandas", "threadpoolctl"},
    "progress": {"rich"},
    "check": set(),
    "cli": {"click"},
}
STANDARD = __import__("sys").stdlib_module_names


def imports():
    """(file, layer, imported module) for every import in the package."""
    for path in sorted(ROOT.rglob("*.py")):
        name = path.relative_to(ROOT).with_suffix("").as_posix()
        layer = name.split("/")[0]
        if layer in ("__init__", "__main__"):
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                yield from ((name, layer, alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and not node.level:
                yield name, layer, node.module
            else:
                assert not getattr(node, "level", 0), f"{name}: relative import"


def test_layers_import_downward_only():
    for name, layer, module in imports():
        if module.startswith("prb3r."):
            below = module.split(".")[1]
            assert ORDER.index(below) <= ORDER.index(layer), f"{name} imports {module}"


def test_layers_import_their_packages_only():
    for name, layer, module in imports():
        package = module.split(".")[0]
        if package not in STANDARD and package != "prb3r":
            allowed = ALLOWED[layer] | ALLOWED.get("/".join(name.split("/")[:2]), set())
            assert package in allowed, f"{name} imports {package}"


def test_only_the_command_line_prints():
    for path in ROOT.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
        printing = any(isinstance(call.func, ast.Name) and call.func.id == "print" for call in calls)
        assert not printing or path.stem in ("cli", "progress"), path
