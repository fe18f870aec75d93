"""What the columns of a study mean, and whether plots and comparisons name columns that exist."""

from collections.abc import Iterable, Iterator, Set
from dataclasses import replace

from prb3r.errors import did_you_mean
from prb3r.model.files.toml_lines import Keys
from prb3r.quantities import Quantity, describe, scale
from prb3r.study.factors import Factor
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


def known_columns(study: Study, cables: Iterable[str]) -> set[str]:
    """All columns of cases and states of a study that plots, comparisons and wishes may name."""
    names = {
        *FIXED_COLUMNS,
        *(factor.name for factor in study.factor),
        *(comparison.name for comparison in study.comparison),
    }
    names |= {quantity.name for metric in study.metric for quantity in metric.quantities()}
    return names | ({f"cable_{name}_n" for name in cables} | {"step"} if study.states != "none" else set())


def _named(study: Study) -> Iterator[tuple[Keys, str | None]]:
    """Every column that the spec names, with the place where it does."""
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


def criteria_of(study: Study) -> Iterator[tuple[Keys, Criterion]]:
    """Requirements and preferences with their places in the spec."""
    for kind, criteria in (("requirement", study.requirement), ("preference", study.preference)):
        yield from (((kind, number), criterion) for number, criterion in enumerate(criteria))


def named_columns(study: Study) -> set[str]:
    """Every column that plots, fits, comparisons and wishes of a study name."""
    return {name for _, name in _named(study) if name is not None}


def _twice(study: Study) -> Iterator[tuple[Keys, str]]:
    """Columns of cases that would have one name, with their place in the spec."""
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


def column_problems(study: Study, columns: Set[str]) -> Iterator[tuple[Keys, str]]:
    """Two columns of one name, names without a column, units that do not fit and plots without states."""
    yield from _twice(study)
    for keys, name in _named(study):
        if name is not None and name not in columns:
            yield keys, f"there is no column {name!r}{did_you_mean(name, columns)}"
    known = {quantity.name: quantity for quantity in described(study)}
    for number, plot in enumerate(study.plot):
        keys = "plot", number
        for column, unit in plot.units():
            try:
                scale(known.get(column, column), unit)
            except ValueError as error:
                yield keys, str(error)
        units = {known[name].unit if name in known else describe(name).unit for name in plot.stacked if name in columns}
        if len(units) > 1:
            what = f"y holds columns of several units ({', '.join(sorted(units))}), which one axis cannot show"
            yield keys, f"{what}; bars have a panel for each"
        yield from ((keys, what) for what in plot.needs(study.kept))
