"""What the columns of a study mean, and whether plots and comparisons name columns that exist."""

from collections.abc import Iterator, Sequence, Set
from dataclasses import replace
from pathlib import Path

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.quantities import Quantity, describe, scale
from prb3r.study.factors import Factor
from prb3r.study.spec import CaseComparison, Study

FIXED_COLUMNS = (
    "case_id",
    "broken_cables",
    "outcome",
    "reason",
    "iterations",
    "residual_n_m",
    "lowest_eigenvalue_n_m_per_rad",
)
"""Columns of the cases of every study, beside its factors, metrics and comparisons."""


def described(study: Study) -> list[Quantity]:
    """What the columns of a study mean beyond the nomenclature: its factors, metrics and comparisons."""
    metrics = [quantity for metric in study.metric for quantity in metric.quantities()]
    return [*map(_factor, study.factor), *metrics, *map(_comparison, study.comparison)]


def _factor(factor: Factor) -> Quantity:
    if not factor.target or factor.path == "model":
        return Quantity(factor.name, "", "", "factor: named alternatives")
    if factor.ratio is not None or factor.times:
        return Quantity(factor.name, "", "1", f"factor: {factor.target}")
    return replace(describe(factor.name), meaning=f"factor: {factor.target}")


def _comparison(comparison: CaseComparison) -> Quantity:
    unit = "1" if comparison.relative_to_length or comparison.kind == "ratio" else describe(comparison.name).unit
    to = " and ".join(
        f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}"
        for name, value in comparison.to.items()
    )
    of = f"the position of {comparison.of}" if comparison.kind == "distance" else comparison.of
    return Quantity(comparison.name, "", unit, f"{comparison.kind} of {of} to the case with {to}")


def _named(study: Study) -> Iterator[tuple[str, str | None]]:
    """Every column that the spec names, with the place where it does."""
    for plot in study.plot:
        yield from ((f"plot {plot.name}", name) for name in plot.columns())
    for fit in study.fit:
        yield from (("fit", name) for name in (fit.x, fit.y, *fit.where))
    for comparison in study.comparison:
        of = [f"{comparison.of}_x_m", f"{comparison.of}_y_m"] if comparison.kind == "distance" else [comparison.of]
        yield from ((f"comparison {comparison.name}", name) for name in (*of, *comparison.to))
    if study.designs is not None:
        yield from (("designs", name) for name in study.designs.factors)
    for criterion in study.wishes.criteria:
        place = type(criterion).__name__.lower()
        yield from ((place, name) for name in (criterion.metric, *criterion.where))


def named_columns(study: Study) -> set[str]:
    """Every column that plots, fits, comparisons and wishes of a study name."""
    return {name for _, name in _named(study) if name is not None}


def _twice(study: Study) -> Iterator[tuple[str, str]]:
    """Columns of cases that would have one name, with their place in the spec."""
    metrics = [quantity.name for metric in study.metric for quantity in metric.quantities()]
    for name in sorted({name for name in metrics if metrics.count(name) > 1}):
        yield "metric", f"two metrics give the column {name!r}"
    taken = dict.fromkeys(FIXED_COLUMNS, "a column of every study") | dict.fromkeys(metrics, "a column of a metric")
    for factor in study.factor:
        if factor.name in taken:
            yield f"factor {factor.name}", f"is the name of {taken[factor.name]}; choose another one"
    taken |= {factor.name: "a factor" for factor in study.factor}
    for comparison in study.comparison:
        if comparison.name in taken:
            yield f"comparison {comparison.name}", f"is the name of {taken[comparison.name]}; choose another one"


def check_columns(path: Path, study: Study, columns: Set[str], quantities: Sequence[Quantity]) -> None:
    """Refuse two columns of one name, names without a column, units that do not fit and plots without states.

    Raises
    ------
    SpecError
        With all of them.
    """
    problems = [Problem(f"{path} {place}", what) for place, what in _twice(study)]
    for place, name in _named(study):
        if name is not None and name not in columns:
            problems.append(Problem(f"{path} {place}", f"there is no column {name!r}{did_you_mean(name, columns)}"))
    known = {quantity.name: quantity for quantity in quantities}
    for plot in study.plot:
        place = f"{path} plot {plot.name}"
        for column, unit in plot.units():
            try:
                scale(known.get(column, column), unit)
            except ValueError as error:
                problems.append(Problem(place, str(error)))
        units = {known[name].unit if name in known else describe(name).unit for name in plot.stacked if name in columns}
        if len(units) > 1:
            what = f"y holds columns of several units ({', '.join(sorted(units))}), which one axis cannot show"
            problems.append(Problem(place, f"{what}; bars have a panel for each"))
        problems += [Problem(place, what) for what in plot.needs(study.kept)]
    if problems:
        raise SpecError(*dict.fromkeys(problems))
