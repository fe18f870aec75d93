"""From a study file to its checked cases, or to a list of all problems with them."""

import itertools
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.inverse.target import target_rows
from prb3r.model.files.toml import place_of, read_toml
from prb3r.model.files.toml_lines import Keys
from prb3r.model.files.validation import KeyedError
from prb3r.model.manipulator import Manipulator
from prb3r.study.axes import axes, count_cases
from prb3r.study.case_problems import OF_MANIPULATOR, family_problems
from prb3r.study.cases import Cases, Family, label_columns, unchecked_cases
from prb3r.study.factors import MAX_CASES
from prb3r.study.rounding import short
from prb3r.study.spec import Study
from prb3r.study.tree import Tree, setting_at, with_setting

MAX_PROBLEMS = 20
"""Number of different problems after which no more cases are checked."""
NUMBER = re.compile(r"-?\d+(\.\d+)?(e[-+]?\d+)?")
"""Numbers in problems of the manipulators of cases: what differs in numbers alone is told once."""


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
            for row, keys, what in itertools.chain(not_set, family_problems(family, study, checked)):
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
        raise SpecError(
            *(
                Problem(f"{place_of(path, in_file(keys)) if keys else path} ({of[number] or 'the only case'})", what)
                for keys, what, number in _told_once(first)
            )
        )
    return Cases(labels, tuple(families))


def _told_once(first: dict[tuple[Keys, str], int]) -> Iterator[tuple[Keys, str, int]]:
    """Problems with the number of the case that has each first; of those of manipulators that differ in numbers alone
    the first one, with how many are like it."""
    alike: dict[str, list[tuple[Keys, str]]] = {}
    for keys, what in sorted(first, key=lambda known: first[known]):
        kind = NUMBER.sub("#", what) if what.startswith(OF_MANIPULATOR) else what
        alike.setdefault(kind, []).append((keys, what))
    for members in alike.values():
        (keys, what), more = members[0], len({what for _, what in members}) - 1
        yield keys, what + (f"; {more} more like this" if more else ""), first[keys, what]


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
