"""Checks of what a spec asks of its cases: that some are selected, and that wishes and loops have a value there."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from prb3r.inverse.target import out_of_reach
from prb3r.model.files.toml_lines import Keys
from prb3r.model.manipulator import Manipulator
from prb3r.study.cases import Cases
from prb3r.study.columns import criteria_of, described
from prb3r.study.compare import select
from prb3r.study.loads import load_columns
from prb3r.study.metrics.response import last_loop
from prb3r.study.spec import Study

VALUES_LISTED = 6
"""Values that a message lists at most."""


def selection_problems(study: Study, cases: Cases) -> Iterator[tuple[Keys, str]]:
    """Problems of selections whose values of factors and broken cables no case has, with their keys in the spec.

    Conditions on metrics and searched factors are not checked, as their values are not known before cases are solved.
    """
    selections = list(_selections(study))
    searched = {factor.name for factor in study.searched}
    names = {name for _, where in selections for name in where} - searched
    known = {name: pd.Series(cases.factors[name].tolist()) for name in names & cases.factors.keys()}
    if "broken_cables" in names:
        broken = np.empty(len(cases), object)
        for family in cases.families:
            broken[family.numbers] = ",".join(family.settings["broken"])
        known["broken_cables"] = pd.Series(broken.tolist())
    frame = pd.DataFrame(known)
    for keys, where in selections:
        wanted = {name: value for name, value in where.items() if name in known}
        if wanted and select(frame, wanted).empty:
            had = "; ".join(f"{name} is {_some(frame[name])}" for name in wanted)
            yield keys, f"no case has {', '.join(f'{name} = {_said(value)}' for name, value in wanted.items())}: {had}"


def lacking_problems(study: Study, cases: Cases) -> Iterator[tuple[Keys, str]]:
    """Problems of requirements and preferences whose column no case can have, with their keys in the spec.

    The manipulator of every case then lacks what the column is computed from.
    """
    sources = {comparison.name: comparison.of for comparison in study.comparison}
    wished = [(keys, criterion.metric) for keys, criterion in criteria_of(study)]
    for metric in study.metric:
        columns = {quantity.name for quantity in metric.quantities()}
        asked = [(keys, name, sources.get(name, name)) for keys, name in wished if sources.get(name, name) in columns]
        lacking: dict[str, str] = {}
        for number, manipulator in enumerate(_manipulators(cases) if asked else ()):
            found = metric.lacking(manipulator)
            lacking = {name: field for name, field in found.items() if not number or name in lacking}
            if not lacking:
                break
        for keys, name, source in asked:
            if source in lacking:
                what = f"column {name!r} has no value in any case: it needs {lacking[source]} of the manipulator"
                yield (*keys, "metric"), f"{what}; give it in {study.manipulator}"


def far_bound_problems(study: Study, cases: Cases) -> Iterator[tuple[Keys, str]]:
    """Problems of requirements on lengths and angles far beyond what the manipulator of any case can make, most likely
    given in another unit, with their keys in the spec."""
    units = {quantity.name: quantity.unit for quantity in described(study)[len(study.factor) :]}
    for number, requirement in enumerate(study.requirement):
        name = {"m": "x_m", "rad": "angle_rad"}.get(units.get(requirement.metric, ""))
        if name is None:
            continue
        said: list[str] = []
        for manipulator in _manipulators(cases):
            said = out_of_reach(manipulator.chain(), [{name: requirement.limit}])
            if not said:
                break
        side = "at_most" if requirement.at_least is None else "at_least"
        yield from ((("requirement", number, side), what.replace(name, side, 1)) for what in said)


def closed_loop_problems(study: Study, cases: Cases) -> Iterator[tuple[Keys, str]]:
    """Problems of metrics and plots of loops where no case can open one, with their keys in the spec.

    With declared slip a cable keeps its direction along a sweep, and letting go retraces pulling.
    """
    asked = [(("metric", number), metric.cable) for number, metric in enumerate(study.metric) if metric.kind == "loop"]
    plots = [(("plot", number), plot.x) for number, plot in enumerate(study.plot) if plot.kind == "loops"]
    asked += [(keys, str(x).removeprefix("cable_").removesuffix("_n")) for keys, x in plots]
    for keys, cable in asked:
        if _all_closed(cases, cable):
            yield (
                keys,
                f"no case opens a loop: slip is declared, so that letting cable {cable} go retraces pulling it and all "
                f'that is told of loops is 0; give direction = "history" under [friction] in {study.manipulator}, or '
                'here set = { "friction.direction" = "history" }',
            )


def _all_closed(cases: Cases, cable: str) -> bool:
    """Whether there are loops of the tension of a cable, and in none of them anything but this tension changes."""
    retraces: dict[int, bool] = {}
    closed = False
    for family in cases.families:
        part, own = family.settings["manipulator"], {f"cable_{cable}_n", f"cable_{cable}_kg"}
        if family.settings["cloud"] or family.settings["reach"]:
            continue
        if id(part) not in retraces:  # trees share their equal parts
            retraces[id(part)] = family.manipulator().chain().retraces
        if not retraces[id(part)]:
            return False
        columns = load_columns(family.settings, len(family))
        pulled = np.sum([columns[name] for name in own & columns.keys()] or np.empty((1, 0, 0)), axis=0)
        for row, tension in enumerate(pulled):
            top, bottom, end = last_loop(tension)
            others = (values[row, top : end + 1] for name, values in columns.items() if name not in own)
            if tension[top] > tension[bottom]:
                if any(map(np.ptp, others)):
                    return False
                closed = True
    return closed


def _manipulators(cases: Cases) -> Iterator[Manipulator]:
    """The manipulators of all cases, each once."""
    seen = set()
    for family in cases.families:
        part = family.settings["manipulator"]
        if id(part) not in seen:  # trees share their equal parts
            seen.add(id(part))
            yield family.manipulator()


def _selections(study: Study) -> Iterator[tuple[Keys, Mapping[str, Any]]]:
    """Every selection of cases, as values by column, with its keys in the spec."""
    for number, plot in enumerate(study.plot):
        yield ("plot", number), plot.where
        yield ("plot", number), plot.behind
    yield from ((("fit", number), fit.where) for number, fit in enumerate(study.fit))
    yield from ((("comparison", number), comparison.to) for number, comparison in enumerate(study.comparison))
    yield from ((keys, criterion.where) for keys, criterion in criteria_of(study))


def _some(values: pd.Series) -> str:
    """Up to `VALUES_LISTED` of the values that cases have, each once."""
    known = list(dict.fromkeys(values))
    more = f" or one of {len(known) - VALUES_LISTED} more" if len(known) > VALUES_LISTED else ""
    return ", ".join(map(repr, known[:VALUES_LISTED])) + more


def _said(value: Any) -> str:
    return " or ".join(map(_said, value)) if isinstance(value, list) else repr(value)
