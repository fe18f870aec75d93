"""Units and meanings of the columns of a study, and a check that the spec names only columns that exist."""

from collections.abc import Iterable, Iterator, Set
from dataclasses import replace
from typing import Any, get_args

from prb3r.errors import did_you_mean
from prb3r.model.files.toml_lines import Keys
from prb3r.quantities import Quantity, describe, scale
from prb3r.study.factors import Factor
from prb3r.study.metrics import AnyMetric
from prb3r.study.plots.kinds import BarsPlot, LinesPlot
from prb3r.study.spec import CaseComparison, Study
from prb3r.study.wishes import Criterion

FIXED_COLUMNS = (
    "case_id",
    "broken_cables",
    "outcome",
    "reason",
    "iterations",
    "residual_n_m",
    "lowest_eigenvalue_n_m_per_rad",
)
"""Columns that the table of cases has in every study, besides factors, metrics and comparisons."""


FIXED_WORDS = ("broken_cables", "outcome", "reason")
"""Those of them that hold words."""

EXAMPLE: dict[str, Any] = {"cable": "1", "disk": "tip", "segment": 1, "bend_rad": 1.0}
"""Fields of metrics on which names of their columns may depend, with values as examples."""


def described(study: Study) -> list[Quantity]:
    """Units and meanings of columns that a study adds to the nomenclature: factors, then metrics, then comparisons."""
    metrics = [quantity for metric in study.metric for quantity in metric.quantities()]
    return [*map(_factor, study.factor), *metrics, *map(_comparison, study.comparison)]


def _factor(factor: Factor) -> Quantity:
    """Unit and meaning of the column of a factor."""
    if not factor.target or factor.path == "model":
        return Quantity(factor.name, "", "", "factor: named alternatives")
    if factor.ratio is not None or factor.times:
        return Quantity(factor.name, "", "1", f"factor: {factor.target}")
    return replace(describe(factor.name), meaning=f"factor: {factor.target}")


def _comparison(comparison: CaseComparison) -> Quantity:
    """Unit and meaning of the column of a comparison."""
    unit = "1" if comparison.relative_to_length or comparison.kind == "ratio" else describe(comparison.name).unit
    to = " and ".join(
        f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}"
        for name, value in comparison.to.items()
    )
    of = f"the position of {comparison.of}" if comparison.kind == "distance" else comparison.of
    return Quantity(comparison.name, "", unit, f"{comparison.kind} of {of} to the case with {to}")


def known_columns(study: Study, cables: Iterable[str]) -> set[str]:
    """Names of all columns of cases and states of a study that plots, comparisons and wishes may name.

    Parameters
    ----------
    cables : names of the cables of the manipulator.
    """
    names = {
        *FIXED_COLUMNS,
        *(factor.name for factor in study.factor),
        *(comparison.name for comparison in study.comparison),
    }
    names |= {quantity.name for metric in study.metric for quantity in metric.quantities()}
    return names | ({f"cable_{name}_n" for name in cables} | {"step"} if study.states != "none" else set())


def _named(study: Study) -> Iterator[tuple[Keys, str | None]]:
    """Every column that the spec names, None for absent options, with the keys of the place in the spec."""
    for number, plot in enumerate(study.plot):
        yield from ((("plot", number), name) for name in plot.columns())
    for number, fit in enumerate(study.fit):
        yield from ((("fit", number), name) for name in (fit.x, fit.y, *fit.where))
    for number, comparison in enumerate(study.comparison):
        of = [f"{comparison.of}_x_m", f"{comparison.of}_y_m"] if comparison.kind == "distance" else [comparison.of]
        yield from ((("comparison", number), name) for name in (*of, *comparison.to))
    if study.designs is not None:
        yield from ((("designs",), name) for name in study.designs.factors)
    for keys, criterion in criteria_of(study):
        yield from ((keys, name) for name in (criterion.metric, *criterion.where))


def _words(study: Study) -> set[str]:
    """Names of the columns of cases that hold words."""
    factors = [f.name for f in study.factor if f.level or any(isinstance(value, str) for value in f.values or ())]
    return {*FIXED_WORDS, *factors}


def _numeric(study: Study) -> Iterator[tuple[Keys, str | None]]:
    """Every column that the spec names where numbers are needed, None for absent options, with keys as `_named`."""
    for number, plot in enumerate(study.plot):
        yield from ((("plot", number), name) for name in plot.numeric())
    for number, fit in enumerate(study.fit):
        yield from ((("fit", number), name) for name in (fit.x, fit.y))
    for number, comparison in enumerate(study.comparison):
        yield ("comparison", number), None if comparison.kind == "distance" else comparison.of
    yield from ((keys, criterion.metric) for keys, criterion in criteria_of(study))


def criteria_of(study: Study) -> Iterator[tuple[Keys, Criterion]]:
    """Requirements, then preferences of a study, each with its keys in the spec."""
    for kind, criteria in (("requirement", study.requirement), ("preference", study.preference)):
        yield from (((kind, number), criterion) for number, criterion in enumerate(criteria))


def named_columns(study: Study) -> set[str]:
    """Names of all columns that plots, fits, comparisons, designs and wishes of a study refer to."""
    return {name for _, name in _named(study) if name is not None}


def _twice(study: Study) -> Iterator[tuple[Keys, str]]:
    """Problems of columns of cases that would have the same name, with their keys in the spec."""
    metrics = [quantity.name for metric in study.metric for quantity in metric.quantities()]
    for name in sorted({name for name in metrics if metrics.count(name) > 1}):
        yield ("metric",), f"two metrics give the column {name!r}"
    taken = dict.fromkeys(FIXED_COLUMNS, "a column of every study") | dict.fromkeys(metrics, "a column of a metric")
    for number, factor in enumerate(study.factor):
        if factor.name in taken:
            yield ("factor", number), f"is the name of {taken[factor.name]}; choose another one"
    taken |= {factor.name: "a factor" for factor in study.factor}
    for number, comparison in enumerate(study.comparison):
        if comparison.name in taken:
            yield ("comparison", number), f"is the name of {taken[comparison.name]}; choose another one"


def _mixed(study: Study, columns: Set[str]) -> Iterator[tuple[Keys, str]]:
    """Problems of charts of a number for each case over one for each step, which would repeat it, or the reverse."""
    of_cases = known_columns(study, ()) - {"step"}
    for number, plot in enumerate(study.plot):
        if study.states == "path" and isinstance(plot, LinesPlot | BarsPlot) and {plot.x, *plot.y} <= columns:
            told = {name in of_cases: name for name in (plot.x, *plot.y)}
            if len(told) > 1:
                what = f"{told[True]} is one number for each case, {told[False]} one for each of its steps"
                yield ("plot", number), f"{what}; a plot of loops draws positions along the steps"


def made_by(name: str) -> str:
    """Ending of a message on a column that there is not: the kind of metric that makes it; empty if none does."""
    for metric in get_args(get_args(AnyMetric)[0]):
        example = metric.model_construct(**EXAMPLE)
        if name in (quantity.name for quantity in example.quantities()):
            (kind,) = get_args(metric.model_fields["kind"].annotation)
            return f"; a metric of the kind {kind!r} makes it"
    return ""


def column_problems(study: Study, columns: Set[str]) -> Iterator[tuple[Keys, str]]:
    """Problems of the columns that a spec defines and names, with their keys in the spec.

    These are two columns of one name, columns of cases over columns of steps, names without a column, words where
    numbers are needed, units that do not fit, and plots that lack tables.

    Parameters
    ----------
    columns : names of all columns that may be named, see `known_columns`.
    """
    yield from _twice(study)
    yield from _mixed(study, columns)
    for keys, name in _named(study):
        if name is not None and name not in columns:
            made = made_by(name)
            yield keys, f"there is no column {name!r}{made or did_you_mean(name, columns)}"
    words = _words(study)
    yield from (
        (keys, f"column {name!r} holds words; numbers are needed") for keys, name in _numeric(study) if name in words
    )
    known = {quantity.name: quantity for quantity in described(study)}
    for number, plot in enumerate(study.plot):
        keys = "plot", number
        for column, unit in plot.units():
            try:
                scale(known.get(column, column), unit)
            except ValueError as error:
                yield keys, str(error)
        for column, other in plot.of_one_unit():
            first, second = (known[name].unit if name in known else describe(name).unit for name in (column, other))
            if {column, other} <= columns - words and first != second:
                yield (
                    keys,
                    f"{other} in {second or 'no unit'} cannot stand on the axis of {column} in {first or 'no unit'}",
                )
        units = {known[name].unit if name in known else describe(name).unit for name in plot.stacked if name in columns}
        if len(units) > 1:
            what = f"y holds columns of several units ({', '.join(sorted(units))}), which one axis cannot show"
            yield keys, f"{what}; bars have a panel for each"
        yield from ((keys, what) for what in plot.needs(study.kept))
