"""Checks of what a spec asks of its cases: that it selects at least one of them, and that wishes have a value there."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from prb3r.model.files.toml_lines import Keys
from prb3r.model.manipulator import Manipulator
from prb3r.study.cases import Cases
from prb3r.study.columns import criteria_of
from prb3r.study.compare import select
from prb3r.study.spec import Study


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
            yield keys, f"no case has {', '.join(f'{name} = {_said(value)}' for name, value in wanted.items())}"


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


def _said(value: Any) -> str:
    return " or ".join(map(_said, value)) if isinstance(value, list) else repr(value)
