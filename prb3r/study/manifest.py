"""Entries of a study's manifest besides provenance: changes since the last run, and time per equilibrium."""

import json
import time
from typing import Any

import numpy as np

from prb3r.mechanics.chain import Loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.steps import loads_of
from prb3r.study.cases import Case
from prb3r.study.loads import steps_frame

TIMED_EQUILIBRIA = 2000
"""Number of equilibria that are timed together, roughly."""
REPEATS = 5
"""Number of times that the timing is repeated; the shortest time counts."""


def _flat(tree: Any, path: str = "") -> dict[str, Any]:
    """The plain values of nested dicts and lists, by their dotted paths; list positions count from 0."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else None
    if items is None:
        return {path: tree}
    return {key: value for name, inner in items for key, value in _flat(inner, f"{path}.{name}".lstrip(".")).items()}


def changes(before: dict[str, Any], after: dict[str, Any]) -> list[str]:
    """Differences between the manifests of two runs of a study, in words; empty if their tables have the same key.

    Plots, designs, requirements and preferences are left out, as tables do not depend on them.
    """
    if before.get("key") == after["key"]:
        return []
    said = []
    for part in ("study", "manipulator"):
        old, new = (_flat(json.loads(json.dumps(run.get(part, {}), default=str))) for run in (before, after))
        for key in [*new, *(key for key in old if key not in new)]:
            if old.get(key) != new.get(key) and not key.startswith(("plot", "designs", "requirement", "preference")):
                said.append(f"{part} {key}: {old.get(key, 'absent')} -> {new.get(key, 'absent')}")
    if before.get("engine") != after["engine"]:
        said.append("the program text of the engine")
    return said


def timing(cases: list[Case]) -> list[dict[str, Any]]:
    """Time per equilibrium of each model, microseconds, when the loads of its cases are solved many times in one call.

    All cases of a model are timed on the manipulator of the first of them.
    """
    groups: dict[str, list[Case]] = {}
    for case in cases:
        description = case.settings["manipulator"]
        name = description["model"] + (f" ({description['hinges']})" if description["model"] == "prb3r" else "")
        groups.setdefault(str(case.factors.get("model", name)), []).append(case)
    rows = []
    for model, members in groups.items():
        manipulator = members[0].manipulator()
        chain = manipulator.chain(members[0].settings["broken"])
        loads_of_cases = [loads_of(manipulator, chain, steps_frame(case.settings)) for case in members]
        once = Loads(*(np.concatenate(parts) for parts in zip(*loads_of_cases, strict=True)))
        times = max(1, TIMED_EQUILIBRIA // once.steps)
        bulk = Loads(*(np.concatenate([part] * times) for part in once))
        best = np.inf
        for _ in range(REPEATS):
            begin = time.perf_counter()
            solve_chain(chain, bulk)
            best = min(best, time.perf_counter() - begin)
        rows.append({"model": model, "microseconds_per_equilibrium": round(best / bulk.steps * 1e6, 3)})
    return rows
