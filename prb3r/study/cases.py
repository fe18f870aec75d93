"""From a study file to its cases: every factor value applied to a plain tree of settings, then checked.

A case is a tree of plain values (manipulator, broken cables, initial loads, load steps, cloud), so that it can be
hashed, sent to a worker and written down; the same spec and seed always give the same cases in the same order.
"""

import copy
import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import qmc

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.model.files.toml import read_toml
from prb3r.model.files.toml_lines import dotted
from prb3r.model.files.validation import validate
from prb3r.model.manipulator import Manipulator
from prb3r.model.steps import step_problems
from prb3r.study.spec import MAX_CASES, Cloud, Factor, Level, LoadSweep, Sampling, Study

MAX_PROBLEMS = 20
"""Problems of cases that are listed; more of them only say the same again."""

Tree = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A case as resolved: its factors, and all that they set."""

    number: int
    factors: dict[str, Any]
    """Value or label of each factor: columns of the table of cases."""
    settings: Tree
    """`manipulator, broken, initial, step, sweep, cloud`, all plain values."""

    def manipulator(self) -> Manipulator:
        """The manipulator of the case, checked already when the case was resolved."""
        return Manipulator.model_validate(self.settings["manipulator"])


def axis_values(factor: Factor) -> list[Any]:
    """The values that a factor of the grid takes, in the order of the spec.

    Raises
    ------
    ValueError
        For a factor that is sampled.
    """
    if factor.level is not None:
        return list(factor.level)
    if factor.values is not None:
        numbers = all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in factor.values)
        return [float(value) for value in factor.values] if numbers else list(factor.values)
    if (span := factor.linspace) is not None:
        return [_short(value) for value in np.linspace(span.start, span.stop, span.count)]
    if (span := factor.geomspace) is not None:
        return [_short(value) for value in np.geomspace(span.start, span.stop, span.count)]
    raise ValueError(f"factor {factor.name!r} is sampled, it has no grid")


def _short(value: float) -> float:
    """To twelve digits: 0.3 instead of 0.30000000000000004."""
    return float(f"{value:.12g}")


def axes(study: Study) -> list[list[dict[str, Any]]]:
    """The axes of the grid: factors alone, zipped together, or sampled together; each entry sets some factors.

    Raises
    ------
    ValueError
        If zipped factors differ in length.
    """
    grouped: dict[str, list[dict[str, Any]]] = {}
    for factor in study.factor:
        if factor.range is not None:
            continue
        values = [{factor.name: value} for value in axis_values(factor)]
        group = factor.zip or f"alone {factor.name}"
        if group not in grouped:
            grouped[group] = values
        elif len(grouped[group]) != len(values):
            raise ValueError(
                f"factors zipped as {factor.zip!r} need one length: {factor.name!r} has {len(values)} values, "
                f"those before it {len(grouped[group])}"
            )
        else:
            grouped[group] = [before | value for before, value in zip(grouped[group], values, strict=True)]
    sampled = [factor for factor in study.factor if factor.range is not None]
    if sampled and study.sampling is not None:
        points = qmc.scale(
            _unit_points(study.sampling, study.seed, len(sampled)),
            [factor.range.low for factor in sampled if factor.range],
            [factor.range.high for factor in sampled if factor.range],
        )
        grouped["sampled"] = [dict(zip((f.name for f in sampled), point, strict=True)) for point in points.tolist()]
    return list(grouped.values())


def _unit_points(sampling: Sampling, seed: int, dimensions: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    if sampling.method == "sobol":
        return qmc.Sobol(dimensions, rng=rng).random_base2(int(np.ceil(np.log2(sampling.count))))[: sampling.count]
    return qmc.LatinHypercube(dimensions, rng=rng).random(sampling.count)


def count_cases(study: Study) -> int:
    """Number of cases of a study, found without making them."""
    lengths: dict[str, int] = {}
    for factor in study.factor:
        span = factor.linspace or factor.geomspace
        length = span.count if span else len(factor.values or factor.level or ())
        if factor.range is None:
            lengths[factor.zip or f"alone {factor.name}"] = length
    sampled = study.sampling.count if study.sampling else 1
    return int(np.prod([float(n) for n in (*lengths.values(), sampled)]))


def resolve(path: str | Path, study: Study) -> list[Case]:
    """All cases of a study file.

    Raises
    ------
    SpecError
        With every problem, by factor and case.
    """
    path = Path(path)
    count = count_cases(study)
    if count > MAX_CASES:
        what = f"the factors make {count:.3g} cases, at most {MAX_CASES:,} are run; sample them or split the study"
        raise SpecError(Problem(f"{path} factor", what))
    manipulator = read_toml(path.parent / study.manipulator, Manipulator)
    base: Tree = {
        "manipulator": manipulator.model_dump(exclude_none=True),
        "broken": list(study.broken),
        "initial": dict(study.initial),
        "step": [dict(step) for step in study.step],
        "sweep": study.sweep.model_dump() if study.sweep else {},
        "cloud": study.cloud.model_dump(exclude_none=True) if study.cloud else {},
    }
    if study.model is not None:
        base["manipulator"]["model"] = study.model
    try:
        for target, value in study.set.items():
            put(base, target, value)
        grid = axes(study)
    except (KeyError, TypeError, ValueError) as error:
        raise SpecError(Problem(str(path), str(error.args[0]))) from None
    factors = {factor.name: factor for factor in study.factor}
    cases = []
    problems_found: dict[str, Problem] = {}
    checked: dict[str, list[str]] = {}
    for number, combination in enumerate(itertools.product(*grid)):
        values = {name: value for entry in combination for name, value in entry.items()}
        values = {name: values[name] for name in factors}
        labels = {name: value.label if isinstance(value, Level) else value for name, value in values.items()}
        where = ", ".join(f"{name} = {value}" for name, value in labels.items()) or "the only case"
        settings = copy.deepcopy(base)
        problems = list(_apply(settings, factors, values))
        if not problems:
            key = repr(settings)
            problems = checked[key] if key in checked else checked.setdefault(key, list(_check(settings)))
        for what in problems:
            problems_found.setdefault(what, Problem(f"{path} ({where})", what))
        cases.append(Case(number, labels, settings))
        if len(problems_found) >= MAX_PROBLEMS:
            break
    if problems_found:
        raise SpecError(*problems_found.values())
    return cases


def _apply(settings: Tree, factors: Mapping[str, Factor], values: Mapping[str, Any]) -> Iterator[str]:
    """Set every factor; yields what cannot be set."""
    for name, value in values.items():
        factor = factors[name]
        try:
            if isinstance(value, Level):
                _apply_level(settings, value)
            elif factor.ratio is not None:
                put(settings, factor.ratio[0], value * fetch(settings, factor.ratio[1]))
            elif factor.path is not None:
                put(settings, factor.path, value)
        except (KeyError, TypeError) as error:
            yield f"factor {name!r}: {error.args[0]}"


def _apply_level(settings: Tree, level: Level) -> None:
    for part in ("broken", "initial", "step"):
        if getattr(level, part) is not None:
            settings[part] = copy.deepcopy(getattr(level, part))
    if level.model is not None:
        settings["manipulator"]["model"] = level.model
    for path, value in level.set.items():
        put(settings, path, value)


def _enter(tree: Any, part: str, path: str) -> tuple[Any, Any]:
    """Container and key for one part of a path: segments and steps by number from 1, cables by name."""
    if isinstance(tree, dict):
        return tree, part
    if not isinstance(tree, list):
        raise KeyError(f"path {path!r} leads into a plain value at {part!r}")
    if tree and isinstance(tree[0], dict) and "ends_at_segment" in tree[0]:
        names = [cable["name"] for cable in tree]
        if part not in names:
            raise KeyError(f"path {path!r}: there is no cable {part!r}{did_you_mean(part, names)}")
        return tree, names.index(part)
    if not part.isdigit() or not 1 <= int(part) <= len(tree):
        raise KeyError(f"path {path!r}: {part!r} is not a number from 1 to {len(tree)}")
    return tree, int(part) - 1


def _locate(settings: Tree, path: str) -> tuple[Any, Any]:
    parts = path.removeprefix("manipulator.").split(".")
    tree: Any = settings if parts[0] in ("initial", "step", "sweep", "cloud", "broken") else settings["manipulator"]
    for part in parts[:-1]:
        container, key = _enter(tree, part, path)
        if isinstance(container, dict) and key not in container:
            raise KeyError(f"path {path!r}: there is no {part!r}{did_you_mean(part, container)}")
        tree = container[key]
    return _enter(tree, parts[-1], path)


def put(settings: Tree, path: str, value: Any) -> None:
    """Set the value at `path`.

    Raises
    ------
    KeyError
        If the path leads nowhere.
    """
    container, key = _locate(settings, path)
    container[key] = value


def fetch(settings: Tree, path: str) -> Any:
    """The value at `path`.

    Raises
    ------
    KeyError
        If there is none.
    """
    container, key = _locate(settings, path)
    if isinstance(container, dict) and key not in container:
        raise KeyError(f"path {path!r} has no value to take a ratio of")
    return container[key]


def _check(settings: Tree) -> Iterator[str]:
    """What is wrong with a case once all factors are set."""
    manipulator, wrong = validate(settings["manipulator"], Manipulator)
    if manipulator is None or wrong:
        yield from (f"manipulator {dotted(keys)} {what}" for keys, what in wrong)
        return
    for name in settings["broken"]:
        if name not in manipulator.cable_names:
            yield f"there is no cable {name!r} to break{did_you_mean(name, manipulator.cable_names)}"
    if settings["cloud"]:
        cloud, wrong = validate(settings["cloud"], Cloud)
        if cloud is None or wrong:
            yield from (f"cloud {dotted(keys)} {what}" for keys, what in wrong)
            return
        for name in cloud.tension_n:
            if name not in manipulator.cable_names:
                yield f"cloud drives cable {name!r}, which does not exist{did_you_mean(name, manipulator.cable_names)}"
    elif not settings["initial"] and not settings["step"] and not settings["sweep"]:
        yield "no loads: give [[step]], [initial], [sweep] or [cloud]"
    else:
        if settings["sweep"]:
            sweep, wrong = validate(settings["sweep"], LoadSweep)
            yield from (f"sweep {dotted(keys)} {what}" for keys, what in wrong)
            if sweep is None or wrong:
                return
            if other := _other_unit(sweep.column, [settings["initial"], *settings["step"]]):
                yield f"the sweep of {sweep.column} goes on from {other}: give both in one unit"
        yield from (problem.what for problem in step_problems(manipulator, steps_frame(settings), "", keys=()))


def _in_other_unit(name: str) -> str:
    """The column that gives the same load in kilograms instead of newtons, or the reverse; nothing for others."""
    pairs = (("_n", "_kg"), ("_kg", "_n"))
    return next((name.removesuffix(ending) + other for ending, other in pairs if name.endswith(ending)), "")


def _other_unit(column: str, steps: list[dict[str, float]]) -> str:
    other = _in_other_unit(column)
    return other if any(other in step for step in steps) else ""


def _swept(sweep: Tree | None, before: list[dict[str, float]]) -> Iterator[dict[str, float]]:
    """The steps of a sweep, which begins where the steps before it have left its column."""
    if not sweep:
        return
    column, value = sweep["column"], 0.0
    for step in before:
        value = step.get(column, value)
    for turn in sweep["turns"]:
        for share in np.arange(1, sweep["count"] + 1) / sweep["count"]:
            yield {column: _short(value + share * (turn - value))}
        value = turn


def steps_frame(settings: Tree) -> pd.DataFrame:
    """Initial loads, steps and sweep as a table: each row keeps what it does not name from the row before."""
    rows: list[dict[str, float]] = []
    steps = ([settings["initial"]] if settings["initial"] else []) + settings["step"]
    for step in [*steps, *_swept(settings.get("sweep"), steps)]:
        replaced = {_in_other_unit(name) for name in step}
        before = rows[-1] if rows else {}
        rows.append({name: value for name, value in before.items() if name not in replaced} | step)
    absent = {name: -1.0 if name.startswith("slip_") else 0.0 for row in rows for name in row}
    return pd.DataFrame(rows).fillna(absent)
