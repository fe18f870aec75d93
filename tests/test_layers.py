"""Imports go in one direction, between the layers and inside them, and each layer imports only its packages."""

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import prb3r

ROOT = Path(prb3r.__file__).parent
ORDER = {
    "": "errors markdown quantities mechanics model effects inverse runs study recording diagnosis proof present "
    "front bench progress check schema cli",
    "mechanics": "code_cache budget lanes kernel slip elimination bundle angle plate plate_law chain block_eigenvalue "
    "reference acting load_row records accepted bending relaxation state cable balance variation stability march "
    "newton tangent eigenvalue complementarity stick_slip turning attempt ramp history_path path_output side_by_side "
    "same_way path definite equilibrium strain limit derivatives",
    "mechanics.lanes": "number table",
    "mechanics.derivatives": "relaxing response feedback partials loops differentiate solved_path sensitivity",
    "model": "files laws effects parts paths manipulator given step_checks steps solve parameter sensitivity",
    "model.laws": "section moment_law self_consistent derivatives",
    "inverse": "target pull descent search applied reached reach",
    "runs": "threads files secret store sealed states pending part parts provenance tasks backends engine journal",
    "runs.backends": "process_map shield loky aside dask",
    "study": "rounding workspace metrics wishes plots distributions factors loading spec unasked axes tree loads "
    "cases case_problems resolve columns compare converged selections chunk measure cloud work stored plan tables "
    "manifest designs rigs search compute explore run decision settled decide phrases recommend advice",
    "study.metrics": "base strength response reach position drive",
    "recording": "recording times thinning serial_noise smoothing frozen at_odds holds findings units steps markers "
    "reading writing let_go plausibility",
    "diagnosis": "chance confidence settings library fit evidence search checks result known check stages blunders "
    "investigate together run",
    "diagnosis.fit": "spans least_squares constants chains prediction response belief basis covariance tolerance "
    "parameters model profile joint calibrate",
    "diagnosis.evidence": "smooth_moments repeated_loads repeatability noise_level neighbours model_evidence "
    "linearised score_test outliers rig_as_made renewal stated_accuracy missing_moments detectable constants_by_part",
    "diagnosis.search": "twins experiment empirical_law linear_selection columns unknown_law joint_columns confounded "
    "assumed apply search exchange pool small_loads saturated selection worth rivals contradicted coarser pairs "
    "dissipating starts joint_odds joint_pool together agreement",
    "diagnosis.checks": "unread tolerated repeats setup set_aside odd_part heldout doubt unseen residuals verdict "
    "predicting frame statements",
    "diagnosis.result": "rig_remarks spread starting_anew discrepancy numbers largest_bending workshop "
    "constant_remarks statements effects proposals named remarks investigation tables mismatch same_rig "
    "carried_constants as_made posterior shared_parameter diagnosis common transfer unexplained surviving tell "
    "learnt_design other_recordings answer projection design_prediction learnt_study files",
    "proof": "arguments rig example settings concealed again judging tasks attained prove sweep",
    "proof.rig": "pull section arrays draft effects build bending plate imbalance iteration balance relaxing path "
    "simulate",
    "proof.concealed": "labels sealing blundering design blunders foreign designs candidates camera responses "
    "recordings distances sizing pairs outside build elsewhere drawing worth apart real composition folder",
    "proof.judging": "forecast verdict missed opened methods experiments intervals goals scores real_scores breakdown",
    "front": "studies prediction inverse diagnoses comparison",
    "present": "legends style canvas rc framing page figure_files accuracy spots study diagnosis proof entries index",
    "present.diagnosis": "panels misfits fits sentences together evidence belief report",
    "bench": "prototype counting methods arithmetic scaling jacobians paths commands diagnosis measure tables",
    "cli": "group shared studies manipulators diagnoses formats measurements",
}
"""By folder: what is in it may import only what stands before it.  Of other folders only circles are excluded."""
ALLOWED = {
    "errors": set(),
    "markdown": set(),
    "quantities": set(),
    "mechanics": {"numpy", "scipy", "numba"},
    "model": {"numpy", "pandas", "pydantic", "scipy", "tomli_w"},
    "inverse": {"numpy", "pandas", "scipy"},
    "runs": {"numpy", "pyarrow", "threadpoolctl"},
    "runs/backends": {"joblib", "distributed"},
    "study": {"numpy", "pandas", "scipy", "pydantic"},
    "recording": {"numpy", "pandas", "pydantic"},
    "diagnosis": {"numpy", "pandas", "scipy", "pydantic"},
    "proof": {"numpy", "scipy", "numba", "pandas"},
    "present": {"numpy", "pandas", "scipy", "jinja2", "matplotlib"},
    "effects": set(),
    "front": {"matplotlib", "pandas"},
    "bench": {"numpy", "scipy", "numba", "pandas", "threadpoolctl"},
    "progress": {"rich"},
    "check": {"pandas"},
    "schema": {"pydantic"},
    "cli": {"click"},
}
STANDARD = __import__("sys").stdlib_module_names


@cache
def modules():
    """(dotted name below the package, imported modules) of every file, imports for type checkers included."""
    known = []
    for path in sorted(ROOT.rglob("*.py")):
        name = path.relative_to(ROOT).with_suffix("").as_posix().removesuffix("/__init__").replace("/", ".")
        if name in ("__init__", "__main__"):
            continue
        found = set()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                assert not node.level, f"{name}: relative import"
                inner = {f"{node.module}.{alias.name}" for alias in node.names}
                files = {module for module in inner if is_module(module)}
                found |= files | ({node.module} if len(files) < len(inner) else set())
        known.append((name, frozenset(found)))
    return known


def is_module(dotted):
    place = ROOT.parent / dotted.replace(".", "/")
    return place.with_suffix(".py").exists() or (place / "__init__.py").exists()


def own(found):
    """Modules of the package among those imported, below the package."""
    return {module.removeprefix("prb3r.") for module in found if module.startswith("prb3r.")}


@pytest.mark.parametrize("folder", ORDER)
def test_imports_go_downward_only(folder):
    order, depth = ORDER[folder].split(), folder.count(".") + 1 if folder else 0
    prefix, seen = f"{folder}." if folder else "", set()
    for name, found in modules():
        if not name.startswith(prefix):
            continue
        room = name.split(".")[depth]
        assert room in order, f"{name} has no place in the order"
        seen.add(room)
        for module in own(found):
            if module.startswith(prefix):
                assert order.index(module.split(".")[depth]) <= order.index(room), f"{name} imports {module}"
    assert seen == set(order)


def test_no_imports_in_a_circle():
    graph = {name: own(found) - {name} for name, found in modules()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" <- ".join(error.args[1]))


def test_layers_import_their_packages_only():
    for name, found in modules():
        words = name.split(".")
        allowed = ALLOWED[words[0]] | ALLOWED.get("/".join(words[:2]), set())
        for module in found:
            package = module.split(".")[0]
            assert package in STANDARD | {"prb3r"} | allowed, f"{name} imports {package}"


def test_only_progress_prints():
    for path in ROOT.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
        printing = any(isinstance(call.func, ast.Name) and call.func.id == "print" for call in calls)
        assert not printing or path.stem == "progress", path
