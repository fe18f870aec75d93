"""From a study to its cases: the value of every factor is set in a tree of settings.  `resolve` checks the results.

A case is a tree of plain values (manipulator, broken cables, initial loads, load steps, cloud), so that it can be
hashed, sent to a worker and written down; the same spec and seed always give the same cases in the same order.  Cases
that differ only in the values of their loads form a family: one tree, in which such a load is an array over the cases.
"""

import hashlib
import itertools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, overload

import numpy as np

from prb3r.model.files.toml_lines import Keys
from prb3r.model.manipulator import Manipulator
from prb3r.runs.part import KEY_TYPE
from prb3r.runs.store import canonical
from prb3r.study.axes import Axis
from prb3r.study.factors import Factor, Level
from prb3r.study.spec import Study
from prb3r.study.tree import Tree, setting_at, with_setting


@dataclass(frozen=True)
class Case:
    """One case: the values of its factors, and the settings that follow from them."""

    number: int
    """Number of the case in the study, from 0."""
    factors: dict[str, Any]
    """Value or label of each factor by name, as in the table of cases."""
    settings: Tree
    """Tree with the entries `manipulator, broken, initial, step, sweep, cloud, reach`, all plain values."""

    def manipulator(self) -> Manipulator:
        """The manipulator of the case, made from its settings, which were checked when the case was resolved."""
        return Manipulator.model_validate(self.settings["manipulator"])


@dataclass(frozen=True)
class Family:
    """`c` cases that differ in the values of their loads alone."""

    numbers: np.ndarray
    """(c,) numbers of the cases in the study, ascending."""
    settings: Tree
    """As in `Case`, but a load in `initial` or `step` that differs between the cases is an array (c,)."""

    def __len__(self) -> int:
        return len(self.numbers)

    @property
    def loads(self) -> int:
        """Number of cases, or of the loads in their clouds if they have clouds."""
        cloud = self.settings["cloud"]
        return len(self) * (int(cloud["count"]) if cloud else 1)

    def manipulator(self) -> Manipulator:
        """The manipulator that all cases of the family share, made and checked from their settings."""
        return Manipulator.model_validate(self.settings["manipulator"])

    def part(self, rows: slice | np.ndarray) -> "Family":
        """The cases at some rows of the family, as a family of their own."""
        return Family(self.numbers[rows], _with_loads(self.settings, lambda values: values[rows]))

    def single(self) -> Iterator["Family"]:
        """Each case as a family of its own, in the same order."""
        return (self.part(slice(row, row + 1)) for row in range(len(self)))

    def settings_of(self, row: int) -> Tree:
        """The settings of the case at `row` of the family, with plain numbers as loads."""
        return _with_loads(self.settings, lambda values: float(values[row]))

    def keys(self) -> np.ndarray:
        """(c,) the key of each case: 16 bytes, a hash of its settings."""
        loads = [self.settings["initial"], *self.settings["step"]]
        named = self.settings | {"initial": list(loads[0]), "step": [list(step) for step in loads[1:]]}
        begin = hashlib.blake2b(canonical(named).encode(), digest_size=KEY_TYPE.itemsize)
        values = np.empty((len(self), sum(map(len, loads))))
        for column, value in enumerate(value for step in loads for value in step.values()):
            values[:, column] = value
        keys, content, width = [], memoryview(values.tobytes()), values.itemsize * values.shape[1]
        for place in range(0, len(self) * width, width) if width else [0] * len(self):
            key = begin.copy()
            key.update(content[place : place + width])
            keys.append(key.digest())
        return np.frombuffer(b"".join(keys), KEY_TYPE)


def _with_loads(settings: Tree, pick: Callable[[np.ndarray], Any]) -> Tree:
    """The settings with `pick(array)` in place of each load that is an array over the cases."""

    def picked(step: Tree) -> Tree:
        return {name: pick(value) if isinstance(value, np.ndarray) else value for name, value in step.items()}

    return settings | {"initial": picked(settings["initial"]), "step": [picked(step) for step in settings["step"]]}


@dataclass(frozen=True, eq=False)
class Cases(Sequence[Case]):
    """All cases of a study in the order of their numbers; a `Case` object is made on access."""

    factors: dict[str, np.ndarray]
    """(cases,) values or labels of each factor, by name."""
    families: tuple[Family, ...]
    """Families that together hold every case once."""

    def __len__(self) -> int:
        return len(self._place[0])

    @overload
    def __getitem__(self, number: int) -> Case: ...
    @overload
    def __getitem__(self, number: slice) -> list[Case]: ...
    def __getitem__(self, number):
        if isinstance(number, slice):
            return [self[k] for k in range(*number.indices(len(self)))]
        number = range(len(self))[number]
        family, row = (int(places[number]) for places in self._place)
        return Case(number, self.labels(number), self.families[family].settings_of(row))

    @cached_property
    def cables(self) -> tuple[str, ...]:
        """Names of the cables of all manipulators, those of the first case first."""
        parts = {id(part): part for part in (family.settings["manipulator"]["cable"] for family in self.families)}
        return tuple(dict.fromkeys(cable["name"] for part in parts.values() for cable in part))

    def labels(self, number: int) -> dict[str, Any]:
        """Value or label of each factor of the case `number`, as plain Python values."""
        values = {name: column[number] for name, column in self.factors.items()}
        return {name: value.item() if isinstance(value, np.generic) else value for name, value in values.items()}

    def between(self, start: int, stop: int) -> tuple[Family, ...]:
        """Families of the cases with numbers from `start` to before `stop`, cut so that they hold no others."""
        families, rows = (places[start:stop] for places in self._place)
        order = np.argsort(families, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(families[order])) + 1)
        return tuple(self.families[families[part[0]]].part(rows[part]) for part in parts)

    @cached_property
    def _place(self) -> tuple[np.ndarray, np.ndarray]:
        """(cases,) index of the family of each case and (cases,) row of the case in it."""
        count = sum(map(len, self.families))
        family, row = np.empty(count, np.int64), np.empty(count, np.int64)
        for index, members in enumerate(self.families):
            family[members.numbers], row[members.numbers] = index, np.arange(len(members))
        return family, row


def unchecked_cases(base: Tree, study: Study, grid: Sequence[Axis]) -> Iterator[tuple[Family, list[tuple[Keys, str]]]]:
    """The families of a study's cases, each with the problems met in setting its factors, as :func:`applied` has them.

    The cases are the product of the axes `grid`, the first axis slowest.  Axes whose factors set loads alone vary
    within a family, all others between families.

    Parameters
    ----------
    base : settings that all cases begin with.
    """
    factors = {factor.name: factor for factor in study.factor}
    shape = [len(axis) for axis in grid]
    numbers = np.arange(int(np.prod(shape, dtype=np.int64))).reshape(shape)
    within = [all(_sets_a_load(factors[name], values) for name, values in axis.values.items()) for axis in grid]
    members = _columns([axis for axis, inside in zip(grid, within, strict=True) if inside])
    between: list[Any] = [
        [slice(None)] if inside else range(len(axis)) for axis, inside in zip(grid, within, strict=True)
    ]
    for place in itertools.product(*between):
        entries = [(axis, k) for axis, k in zip(grid, place, strict=True) if not isinstance(k, slice)]
        shared = {name: values[k] for axis, k in entries for name, values in axis.values.items()}
        settings, wrong = applied(base, factors, shared | members)
        yield Family(np.ravel(numbers[place]), settings), wrong


def _columns(grid: Sequence[Axis]) -> dict[str, np.ndarray]:
    """(cases,) values of each factor over the product of axes, the last axis fastest; of levels, their labels."""
    columns = {}
    for axis, rows in zip(grid, np.indices([len(axis) for axis in grid]), strict=True):
        for name, values in axis.values.items():
            if _numbers(values):
                labels = np.array(values)
            else:
                labels = np.array([v.label if isinstance(v, Level) else v for v in values], object)
            columns[name] = labels[rows.ravel()]
    return columns


def _numbers(values: list[Any]) -> bool:
    """Whether all values are floats."""
    return {float}.issuperset(map(type, values))


def label_columns(study: Study, grid: Sequence[Axis]) -> dict[str, np.ndarray]:
    """(cases,) values or labels of each factor, in the order of the spec; the cases are the product of the axes."""
    columns = _columns(grid)
    return {factor.name: columns[factor.name] for factor in study.factor}


def _sets_a_load(factor: Factor, values: list[Any]) -> bool:
    """Whether a factor sets nothing but values of loads, and all its values are numbers."""
    paths = [*factor.changed, *(factor.ratio or ())]
    loads = bool(paths) and all(_is_load(path) for path in paths)
    return loads and _numbers(values)


def _is_load(path: str) -> bool:
    """Whether a path leads to a single load of `initial` or of a step."""
    return bool(re.fullmatch(r"(manipulator\.)?(initial|step\.[^.]+)\..+", path))


def applied(
    settings: Tree, factors: Mapping[str, Factor], values: Mapping[str, Any]
) -> tuple[Tree, list[tuple[Keys, str]]]:
    """The settings with every factor set, in the order of the spec, and the problems of those that cannot be set, with
    their keys in the spec."""
    wrong = list[tuple[Keys, str]]()
    for number, (name, factor) in enumerate(factors.items()):
        value = values[name]
        try:
            if isinstance(value, Level):
                settings = _with_level(settings, value)
            elif factor.ratio is not None:
                settings = with_setting(settings, factor.ratio[0], _changed(settings, factor.ratio[1], value, True))
            elif factor.path is not None:
                settings = with_setting(settings, factor.path, value)
            for path in factor.changed if factor.added_to or factor.times else ():
                settings = with_setting(settings, path, _changed(settings, path, value, bool(factor.times)))
        except (KeyError, TypeError) as error:
            wrong.append((("factor", number), f"factor {name!r}: {error.args[0]}"))
    return settings, wrong


def _changed(settings: Tree, path: str, by: Any, multiplied: bool) -> Any:
    """The number or list of numbers at `path`, each multiplied by `by` or with `by` added.

    Raises KeyError without a value at `path`, and TypeError if it is not a number.
    """
    stands = setting_at(settings, path)
    numbers = stands if isinstance(stands, list) else [stands]
    if not numbers or any(isinstance(n, bool) or not isinstance(n, int | float | np.ndarray) for n in numbers):
        raise TypeError(f"path {path!r} leads to no number that could be changed: {stands!r}")
    changed = [number * by if multiplied else number + by for number in numbers]
    return changed if isinstance(stands, list) else changed[0]


def _with_level(settings: Tree, level: Level) -> Tree:
    """The settings with everything that a level sets."""
    parts = {part: getattr(level, part) for part in ("broken", "initial", "step")}
    settings = settings | {part: value for part, value in parts.items() if value is not None}
    if level.model is not None:
        settings = with_setting(settings, "model", level.model)
    for path, value in level.set.items():
        settings = with_setting(settings, path, value)
    return settings
