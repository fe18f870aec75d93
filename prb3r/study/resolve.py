"""From a study file to its checked cases, or to a list of all problems with them."""

import itertools
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.inverse.reach import lag_problem
from prb3r.inverse.target import out_of_reach, target_rows
from prb3r.model.files.toml import place_of, read_toml
from prb3r.model.files.toml_lines import Keys, dotted
from prb3r.model.files.validation import KeyedError, validate
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import history_problem
from prb3r.model.step_checks import refused, step_problems
from prb3r.study.axes import axes, count_cases
from prb3r.study.cases import Cases, Family, label_columns, unchecked_cases
from prb3r.study.factors import MAX_CASES
from prb3r.study.loading import Cloud, LoadSweep, TargetPath
from prb3r.study.loads import in_other_unit, load_columns, load_rows, steps_frame
from prb3r.study.rounding import short
from prb3r.study.spec import Study
from prb3r.study.tree import Tree, setting_at, with_setting

MAX_PROBLEMS = 20
"""Number of different problems after which no more cases are checked."""
OF_MANIPULATOR, NUMBER = "manipulator ", re.compile(r"-?\d+(\.\d+)?(e[-+]?\d+)?")
"""How problems of the manipulator of a case begin, and numbers in them: what differs in numbers alone is told once."""
MAX_TOLD = 200
"""Largest number of cases of a family whose problems with loads are listed."""


def resolve(
    path: str | Path,
    study: Study,
    advance: Callable[[int], None] = lambda cases: None,
    designs: np.ndarray | None = None,
    in_file: Callable[[Keys], Keys] = lambda keys: keys,
) -> Cases:
    """All cases of a study file, checked.

    Parameters
    ----------
    path : of the study file, to which paths within it are relative.
    advance : called with the number of cases of each family when they are checked.
    designs : (n, factors) values of the searched factors; None: the first generation of the search.
    in_file : the keys in the file of keys in the study, where these differ (`Rest.in_file`).

    Raises
    ------
    SpecError
        With the problems found, each with the first case that has it.
    """
    path = Path(path)
    count = count_cases(study, None if designs is None else len(designs))
    if count > MAX_CASES:
        what = f"the factors make {count:.3g} cases, at most {MAX_CASES:,} are run; sample them or split the study"
        raise SpecError(Problem(f"{path} factor", what))
    manipulator = _manipulator(path, study.manipulator)
    families: list[Family] = []
    first: dict[tuple[Keys, str], int] = {}
    checked: dict[int, tuple[Tree, Manipulator | None, list[tuple[Keys, str]]]] = {}
    try:
        base = base_settings(study, manipulator) | {"reach": _reach(path, study)}
        if wide := list(_wide_errors(study, base)):
            raise KeyedError(*wide)
        grid = axes(study, designs)
        for family, wrong in unchecked_cases(base, study, grid):
            families.append(family)
            not_set = [(0, keys, what) for keys, what in wrong]
            for row, keys, what in itertools.chain(not_set, _problems(family, study, checked)):
                first[keys, what] = min(first.get((keys, what), count), int(family.numbers[row]))
            advance(len(family))
            if len(first) >= MAX_PROBLEMS:
                break
    except KeyedError as error:
        raise SpecError(*(Problem(place_of(path, in_file(keys)), what) for keys, what in error.places)) from None
    except (KeyError, TypeError, ValueError) as error:
        raise SpecError(Problem(str(path), str(error.args[0]))) from None
    labels = label_columns(study, grid)
    if first:
        of = {k: ", ".join(f"{name} = {labels[name][k]}" for name in labels) for k in set(first.values())}
        alike: dict[str, list[tuple[Keys, str]]] = {}
        for known in sorted(first, key=lambda known: first[known]):
            alike.setdefault(NUMBER.sub("#", known[1]) if known[1].startswith(OF_MANIPULATOR) else known[1], []).append(
                known
            )
        told = [(members[0], len({what for _, what in members}) - 1) for members in alike.values()]
        cases = [of[first[known]] or "the only case" for known, _ in told]
        places = [place_of(path, in_file(keys)) if keys else str(path) for (keys, _), _ in told]
        words = [what + (f"; {more} more like this" if more else "") for (_, what), more in told]
        raise SpecError(
            *(Problem(f"{place} ({case})", what) for place, case, what in zip(places, cases, words, strict=True))
        )
    return Cases(labels, tuple(families))


def _manipulator(path: Path, named: str) -> Manipulator:
    """The manipulator whose file is `named` in the study file `path`.

    Raises SpecError for a wrong file, or, if there is none, with the place of its name in the study file.
    """
    file = path.parent / named
    if not file.exists():
        others = [other.name for other in file.parent.glob("*.toml") if other != path]
        what = f"{named}: no such file{did_you_mean(file.name, others)}"
        raise SpecError(Problem(place_of(path, ("manipulator",)), what))
    return read_toml(file, Manipulator)


def base_settings(study: Study, manipulator: Manipulator) -> Tree:
    """The settings that all cases begin with, before any factor is set.

    Raises
    ------
    KeyError
        If a path in the study's `set` leads nowhere.
    """
    settings: Tree = {
        "manipulator": manipulator.model_dump(exclude_none=True),
        "broken": list(study.broken),
        "initial": dict(study.initial),
        "step": [dict(step) for step in study.step],
        "sweep": study.sweep.model_dump() if study.sweep else {},
        "cloud": study.cloud.model_dump(exclude_none=True) if study.cloud else {},
    }
    if study.model is not None:
        settings["manipulator"]["model"] = study.model
    for target, value in study.set.items():
        settings = with_setting(settings, target, value)
    return settings


def _wide_errors(study: Study, base: Tree) -> Iterator[tuple[Keys, str]]:
    """Errors added to lengths that scatter by more than these lengths are, most likely in another unit, with their
    keys; an offset is held against the largest of all cables, as some may lie in the middle."""
    cables = [np.ravel(cable["offset_m"]) for cable in base["manipulator"]["cable"]]
    for number, factor in enumerate(study.factor):
        paths = factor.changed if factor.added_to and factor.normal else []
        sd = factor.normal.sd if factor.normal else 0.0
        for path in paths:
            offset, length = "offset_m" in path.split("."), re.search(r"_m(\.\d+)?$", path)
            try:
                stands = np.ravel(setting_at(base, path))
            except KeyError:
                continue  # told with the cases
            stands = np.concatenate(cables) if offset else stands
            if length and stands.dtype == float and 0 < (largest := float(np.abs(stands).max(initial=0.0))) < sd:
                what = f"{path}, of at most {largest:g} m, with a standard deviation of {sd:g} m: lengths are given in"
                yield ("factor", number, "normal"), f"an error of {what} metres, and {sd:g} mm is {sd / 1e3:g}"
                break


def _reach(path: Path, study: Study) -> Tree:
    """The entry `reach` of the settings, with every target of the path listed; empty for a study without `[reach]`.

    Raises
    ------
    SpecError
        With every problem of the table of targets.
    """
    if study.reach is None:
        return {}
    rows = [place.model_dump(exclude_none=True) for place in study.reach.target or ()]
    if study.reach.path is not None:
        if not (table := path.parent / study.reach.path).exists():
            others = [other.name for other in table.parent.glob(f"*{table.suffix}")] if table.suffix else []
            what = f"{study.reach.path}: no such file{did_you_mean(table.name, others)}"
            raise SpecError(Problem(place_of(path, ("reach", "path")), what))
        rows = target_rows(table)
    elif study.reach.count > 1:
        rows = rows[:1] + [
            {name: short(first[name] + share * (then[name] - first[name])) for name in then}
            for first, then in itertools.pairwise(rows)
            for share in np.arange(1, study.reach.count + 1) / study.reach.count
        ]
    most = {} if study.reach.most_n is None else {"most_n": study.reach.most_n}
    return {"disk": study.reach.disk, "target": rows, "least": study.reach.least, **most}


def _problems(family: Family, study: Study, checked: dict) -> Iterator[tuple[int, Keys, str]]:
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
    broken = list(_broken_problems(study, settings, manipulator))
    yield from ((0, keys, what) for keys, what in broken)
    structure = [*(what for _, what in broken), *_structure_problems(settings, manipulator)]
    yield from ((0, (), what) for what in structure[len(broken) :])
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
    """Problems that all cases of a family share: types of their settings, broken cables, cloud, targets and sweep."""
    lists = {"broken": isinstance(settings["broken"], list), "step": isinstance(settings["step"], list)}
    tables = {"initial": settings["initial"], "sweep": settings["sweep"], "cloud": settings["cloud"]}
    tables |= {f"step.{k}": step for k, step in enumerate(settings["step"], 1)} if lists["step"] else {}
    wrong = [f"{name} must be a list" for name, good in lists.items() if not good]
    wrong += [f"{name} must be a table of loads" for name, part in tables.items() if not isinstance(part, dict)]
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
