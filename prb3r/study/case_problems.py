"""Problems of the cases of a study: of their manipulators, loads, metrics and targets, with their keys in its file."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from prb3r.errors import did_you_mean
from prb3r.inverse.reach import lag_problem
from prb3r.inverse.target import out_of_reach
from prb3r.model.files.toml_lines import Keys, dotted
from prb3r.model.files.validation import validate
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import history_problem
from prb3r.model.step_checks import refused, step_problems
from prb3r.study.cases import Family
from prb3r.study.loading import Cloud, LoadSweep, TargetPath
from prb3r.study.loads import in_other_unit, load_columns, load_rows, steps_frame
from prb3r.study.spec import Study
from prb3r.study.tree import Tree

OF_MANIPULATOR = "manipulator "
"""How problems of the manipulator of a case begin."""
MAX_TOLD = 200
"""Largest number of cases of a family whose problems with loads are listed."""


def family_problems(family: Family, study: Study, checked: dict) -> Iterator[tuple[int, Keys, str]]:
    """Problems of the cases of a family: row of the case, keys in the study file (empty if none), and words.

    Parameters
    ----------
    checked : cache of the last manipulator checked, with its problems, by identity of its settings.
    """
    settings = family.settings
    part = settings["manipulator"]
    if id(part) not in checked:  # trees share their equal parts
        checked.clear()
        manipulator, wrong = validate(part, Manipulator)
        told = [
            (_keys_of_path(study, dotted(keys, part)), f"{OF_MANIPULATOR}{dotted(keys)} {what}") for keys, what in wrong
        ]
        checked[id(part)] = part, manipulator, told
    _, manipulator, problems = checked[id(part)]
    if manipulator is None or problems:
        yield from ((0, keys, what) for keys, what in problems)
        return
    structure: list[tuple[Keys, str]] = list(_broken_problems(study, settings, manipulator))
    structure += (((), what) for what in _structure_problems(settings, manipulator))
    yield from ((0, keys, what) for keys, what in structure)
    yield from ((0, keys, what) for keys, what in _asked_problems(study, settings, manipulator))
    if structure or settings["cloud"] or settings["reach"]:
        return
    if _plain_numbers(settings):
        rows = np.flatnonzero(refused(manipulator, load_columns(settings, len(family))))
    else:
        rows = np.zeros(1, int)
    for row in rows[:MAX_TOLD].tolist():
        frame = steps_frame(family.settings_of(row))
        for problem in step_problems(manipulator, frame, "", keys=()):
            place = problem.where.strip()
            yield row, _keys_of_load(study, place.removeprefix("column ")), str(replace(problem, where=place))


def _keys_of_load(study: Study, column: str) -> Keys:
    """The keys in the study file of what first gives loads of a `column`; empty if nothing does by this name."""
    for number, step in enumerate(study.step):
        if column in step:
            return "step", number, column
    for number, factor in enumerate(study.factor):
        if any(path.endswith(f".{column}") for path in factor.changed):
            return "factor", number
        for which, level in enumerate(factor.level or ()):
            keys: Keys = ("factor", number, "level", which)
            for place, step in enumerate(level.step or ()):
                if column in step:
                    return *keys, "step", place, column
            if column in (level.initial or ()):
                return *keys, "initial", column
    return ("initial", column) if column in study.initial else ()


def _keys_of_path(study: Study, path: str) -> Keys:
    """The keys in the study file of what last sets a `path` of the manipulator, empty if nothing does; of a ratio, of
    what sets the number that it is taken of, where something does."""
    for number, factor in reversed(list(enumerate(study.factor))):
        if path in factor.changed:
            of = factor.ratio[1] if factor.ratio else ""
            return (of and _keys_of_path(study, of)) or ("factor", number)
        for which, level in enumerate(factor.level or ()):
            if path in level.set:
                return "factor", number, "level", which, "set", path
    return ("set", path) if path in study.set else ()


def _broken_problems(study: Study, settings: Tree, manipulator: Manipulator) -> Iterator[tuple[Keys, str]]:
    """Broken cables that do not exist, with the keys in the study file of what names them."""
    for name in settings["broken"] if isinstance(settings["broken"], list) else ():
        if name not in manipulator.cable_names:
            levels = [
                ("factor", number, "level", which, "broken")
                for number, factor in enumerate(study.factor)
                for which, level in enumerate(factor.level or ())
                if name in (level.broken or ())
            ]
            keys: Keys = levels[0] if levels else ("broken",) if name in study.broken else ()
            yield keys, f"there is no cable {name!r} to break{did_you_mean(str(name), manipulator.cable_names)}"


def _structure_problems(settings: Tree, manipulator: Manipulator) -> Iterator[str]:
    """Problems that all cases of a family share: types of their settings, cloud, targets and sweep."""
    lists = {"broken": isinstance(settings["broken"], list), "step": isinstance(settings["step"], list)}
    tables = {"initial": settings["initial"], "sweep": settings["sweep"], "cloud": settings["cloud"]}
    tables |= {f"step.{k}": step for k, step in enumerate(settings["step"], 1)} if lists["step"] else {}
    example = {"broken": '["up"]', "step": "[[step]] tables"}
    wrong = [f"{name} must be a list: {example[name]}" for name, good in lists.items() if not good]
    wrong += [
        f"{name} must be a table of loads: {{ cable_up_n = 5.0 }}"
        for name, part in tables.items()
        if not isinstance(part, dict)
    ]
    if wrong:
        yield from wrong
        return
    if manipulator.follows_history and (what := history_problem(manipulator.chain())):
        yield what
        return
    loads = [name for name in ("initial", "step", "sweep") if settings[name]]
    for kind in ("cloud", "reach"):
        if settings[kind] and loads:
            yield f"{kind} excludes {' and '.join(loads)}: loads of both are set, and those of {kind} alone would act"
    if settings["cloud"]:
        yield from _cloud_problems(settings["cloud"], manipulator)
    elif settings["reach"]:
        yield from _reach_problems(settings, manipulator)
    elif not settings["initial"] and not settings["step"] and not settings["sweep"]:
        yield "no loads: give [[step]], [initial], [sweep], [cloud] or [reach]"
    elif settings["sweep"]:
        sweep, invalid = validate(settings["sweep"], LoadSweep)
        yield from (f"sweep {dotted(keys)} {what}" for keys, what in invalid)
        other = in_other_unit(sweep.column) if sweep else ""
        if sweep and other and any(other in step for step in [settings["initial"], *settings["step"]]):
            yield f"the sweep of {sweep.column} goes on from {other}: give both in one unit"


def _asked_problems(study: Study, settings: Tree, manipulator: Manipulator) -> Iterator[tuple[Keys, str]]:
    """Metrics and disks in the spec that a manipulator or its kind of loads does not allow, with their keys."""
    for number, metric in enumerate(study.metric):
        wrong = list(metric.problems(manipulator, bool(settings["cloud"])))
        if metric.of_paths and not settings["reach"]:
            wrong.append("needs [reach], a path of targets")
        yield from ((("metric", number), f"metric {metric.kind}: {what}") for what in wrong)
    for number, disk in enumerate(study.state_disks or ()):
        if disk > manipulator.plates:
            yield (
                ("state_disks", number),
                f"state_disks: there is no disk {disk}, the tip is disk {manipulator.plates}",
            )


def _cloud_problems(settings: Tree, manipulator: Manipulator) -> Iterator[str]:
    cloud, wrong = validate(settings, Cloud)
    yield from (f"cloud {dotted(keys)} {what}" for keys, what in wrong)
    for name in cloud.tension_n if cloud and not wrong else ():
        if name not in manipulator.cable_names:
            yield f"cloud drives cable {name!r}, which does not exist{did_you_mean(name, manipulator.cable_names)}"


def _reach_problems(settings: Tree, manipulator: Manipulator) -> Iterator[str]:
    reach, wrong = validate(settings["reach"], TargetPath)
    yield from (f"reach {dotted(keys)} {what}" for keys, what in wrong)
    if reach and reach.disk != "tip" and reach.disk > manipulator.plates:
        yield f"reach: there is no disk {reach.disk}, the tip is disk {manipulator.plates}"
    if not set(manipulator.cable_names) - set(settings["broken"]):
        yield "reach: no cable is left to pull"
    if settings["reach"]["least"] == "stress" and np.isnan(manipulator.outer_fibre).all():
        yield "reach: least = 'stress' needs thickness_m or outer_fibre_m of a segment"
    if lags := lag_problem(manipulator.chain()):
        yield f"reach: {lags}"
    if reach and not wrong:
        yield from (f"reach: {what}" for what in out_of_reach(manipulator.chain(), settings["reach"]["target"]))


def _plain_numbers(settings: Tree) -> bool:
    """Whether all loads of the settings are numbers or arrays of numbers."""
    values = [value for step in load_rows(settings) for value in step.values()]
    return all(isinstance(value, float | int | np.ndarray) and not isinstance(value, bool) for value in values)
