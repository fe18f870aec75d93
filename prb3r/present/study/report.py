"""The report of a study: a short Markdown summary and one self-contained HTML page, from its tables and manifest."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from prb3r.markdown import listed
from prb3r.model.files.cells import count
from prb3r.present import style
from prb3r.present.page import Table, picture, templates
from prb3r.present.study.section import Section
from prb3r.present.study.source import Source
from prb3r.runs.files import write_whole
from prb3r.study.compare import select
from prb3r.study.phrases import failures_in_words

if TYPE_CHECKING:
    from prb3r.present.study.comparison import Advice
    from prb3r.present.study.pointing import Pointed

WHOLE_TABLE, MOST_LISTED, FEW = 500, 20, 8
"""Cases that the table of all cases has at most; failed cases, and values of a factor in words, that are listed at
most; numbers of a factor that are listed one by one, and groups of cases in a table of many columns, at most."""
IN_SUMMARY = 24
"""Cases that the table of all cases in `summary.md` has at most."""
MOST_APART, MOST_DIFFERENCES = 3, 4
"""Factors that are named of a case in a sentence at most, and comparisons that the first lines tell at most."""
READABLE = 60
"""Rows that a table of groups of cases has at most, unless it takes more for `FEW` groups."""


class Ranges(NamedTuple):
    """Least, median and greatest values of columns."""

    table: Table
    note: str
    """Which named alternatives the rows do not tell apart; empty if they tell all of them apart."""


@dataclass(frozen=True)
class Answers:
    """Parts of a report beyond tables and figures."""

    counsel: "Advice | None" = None
    """Which design to build, if the study decides."""
    designs: Table | None = None
    """The designs that it was decided between."""
    note: str = ""
    """What is to be known of that table."""
    sections: Sequence[Section] = ()
    """Those of this kind of study: search, path, errors of rigs, convergence of workspaces."""
    pointed: "Pointed | None" = None
    """What the page shows of spots in its figures, if there are any."""


def write_report(
    folder: str | Path, source: Source, figures: Iterable[tuple[str, str]] = (), answers: Answers | None = None
) -> list[Path]:
    """Write `summary.md` and `report.html` whole or not at all; figures (name, caption) are in `folder` already.

    Raises
    ------
    FileNotFoundError
        If a figure has neither PNG nor SVG.
    """
    folder, study, cases, manifest = Path(folder), source.study, source.cases, source.manifest
    answers = answers or Answers()
    kinds = {plot.name: plot.kind for plot in study.plot}
    spots = answers.pointed.figures if answers.pointed else {}
    content = {
        "study": study,
        "figures": [picture(folder, name, caption, kinds.get(name, ""), spots.get(name)) for name, caption in figures],
        "pointed": answers.pointed.plain if answers.pointed else None,
        "answer": _answer(source, answers),
        "counsel": answers.counsel,
        "designs": answers.designs,
        "note": answers.note,
        "cases": len(cases),
        "sections": answers.sections,
        "count": in_short(source),
        "differences": comparison_sentences(source),
        "varied": [_varied(source, name) for name in source.factors],
        "metrics": _ranges(source, _results(source)),
        "comparisons": _ranges(source, source.compared),
        "every_case": every_case(source) if len(cases) <= WHOLE_TABLE else None,
        "each": every_case(source) if len(cases) <= IN_SUMMARY else None,
        "fits": list(_fits(source)),
        "failed": _failed(source),
        "more_failed": max(0, len(source.failed) - MOST_LISTED),
        "timing": _timing(manifest.get("timing") or ()),
        "made": _made(source),
    }
    return [
        write_whole(folder / name, templates().get_template(f"{name}.j2").render(content).encode())
        for name in ("summary.md", "report.html")
    ]


def _answer(source: Source, answers: Answers) -> str:
    """The answer of the study: its recommendation, else the first sentence of a section, else the number of cases and
    what differs between them."""
    said = [answers.counsel.recommendation] if answers.counsel else []
    said += [section.sentences[0] for section in answers.sections if section.sentences]
    said += [" ".join([f"{in_short(source)}.", *comparison_sentences(source)])]
    return said[0].replace("**", "")


def comparison_sentences(source: Source) -> list[str]:
    """A sentence for each comparison: what differs, from what, and by how much in which cases."""
    said = []
    for comparison in source.study.comparison:
        name, others = comparison.name, source.cases.drop(select(source.cases, comparison.to).index)
        known = others[np.isfinite(others[name].to_numpy(float))].sort_values(name, kind="stable")
        if known.empty:
            continue
        apart = [factor for factor in source.factors if others[factor].nunique() > 1]
        ends = [source.cell(name, float(known[name].iloc[k]), unit=True) for k in (0, -1)]
        if len(apart) <= MOST_APART:
            cases = [", ".join(source.named(factor, known[factor].iloc[k]) for factor in apart) for k in (0, -1)]
            ends = [f"{end} ({case})" if case else end for end, case in zip(ends, cases, strict=True)]
        base = ", ".join(source.named(factor, value) for factor, value in comparison.to.items())
        words = f"from {ends[0]} to {ends[1]}, median {source.cell(name, float(known[name].median()), unit=True)}"
        told = words if len(known) > 1 else ends[0]
        said.append(f"{source.quantity(name).title}, against {base}: {told} ({count(len(known), 'case', ',')}).")
    return said[:MOST_DIFFERENCES]


def in_short(source: Source) -> str:
    """The number of cases, and how many of them failed, in words."""
    total, outcomes = len(source.cases), source.cases["outcome"].value_counts().to_dict()
    which = failures_in_words(outcomes, "of them ") or "all in stable equilibrium"
    return f"{total:,} case{'s' * (total != 1)}, {which}"


def _varied(source: Source, name: str) -> tuple[str, str, str]:
    """A factor in words: its title, the path that it sets, and its values."""
    factor = next(factor for factor in source.study.factor if factor.name == name)
    values = source.cases[name].drop_duplicates()
    if not factor.chosen:
        return source.quantity(name).title, factor.target, f"{len(values)} alternatives that nobody chooses"
    if len(values) > FEW and pd.api.types.is_numeric_dtype(values):
        ends = [source.cell(name, value, unit=True) for value in (values.min(), values.max())]
        return source.quantity(name).title, factor.target, f"{len(values)} values from {ends[0]} to {ends[1]}"
    listed = [source.cell(name, value, unit=True) for value in values[:MOST_LISTED]]
    more = [f"and {len(values) - MOST_LISTED} more"] if len(values) > MOST_LISTED else []
    return source.quantity(name).title, factor.target, "; ".join(listed + more)


def _results(source: Source) -> list[str]:
    """The columns of metrics, but not those that tell of the loads given, unless a requirement or preference is of
    them."""
    given: set[str] = set().union(*(metric.of_loads for metric in source.study.metric))
    wished = {criterion.metric for criterion in source.study.wishes.criteria}
    return [name for name in source.measured if name not in given - wished]


def _ranges(source: Source, columns: Sequence[str]) -> Ranges | None:
    """Least, median and greatest value of each column in each of the groups of :func:`_alternatives`; None without any.

    For a comparison the cases that others are compared with are left out.
    """
    parts, mixed = _alternatives(source, max(FEW, READABLE // max(len(columns), 1)))
    titles, rows = [source.quantity(name).title for name in mixed], []
    note = f"Each row is over all values of {listed(titles)}." if mixed else ""
    for column in columns:
        base = next((comparison.to for comparison in source.study.comparison if comparison.name == column), None)
        for words, part in parts:
            others = part.drop(select(part, base).index) if base else part
            values = others[column].dropna()
            if len(values) or len(parts) == 1:
                ends = [values.min(), values.median(), values.max()] if len(values) else [np.nan] * 3
                numbers = [source.cell(column, float(value)) for value in ends]
                apart = [words] if len(parts) > 1 else []
                rows.append([source.shown(column).label, *apart, *numbers, source.quantity(column).meaning])
    of = ["of"] if len(parts) > 1 else []
    head = ["", *of, "least", "median", "greatest", "meaning"]
    return Ranges(Table(head, rows, (0, len(of), len(head) - 1)), note) if rows else None


def _alternatives(source: Source, most: int) -> tuple[list[tuple[str, pd.DataFrame]], list[str]]:
    """Groups of cases, with words for each, that a median should not mix, and names of the factors that they do mix.

    Groups are by factors whose values are words: broken cables, models or orders, but not one that goes along with a
    numeric factor (`zip`).  Of all sets of them the one with most groups, up to `most`, is taken; if there is none, all
    cases are one group.
    """
    drawn = {factor.name for factor in source.study.factor if not factor.chosen}
    numbers = [name for name in source.factors if pd.api.types.is_numeric_dtype(source.cases[name])]
    names = [
        name
        for name in source.factors
        if name not in numbers
        and name not in drawn
        and source.cases[name].nunique() > 1
        and not any(_goes_along(source.cases, name, number) for number in numbers)
    ]
    chosen = [list(some) for count in range(1, len(names) + 1) for some in itertools.combinations(names, count)]
    sizes = [len(source.cases[some].drop_duplicates()) for some in chosen]
    best = max(range(len(chosen)), key=lambda k: sizes[k] if sizes[k] <= most else 0, default=None)
    if best is None or not 1 < sizes[best] <= most:
        return [("", source.cases)], names
    groups = source.cases.groupby(chosen[best], sort=False, dropna=False)
    mixed = [name for name in names if name not in chosen[best]]
    return [(", ".join(map(str, values)), part) for values, part in groups], mixed


def _goes_along(cases: pd.DataFrame, name: str, number: str) -> bool:
    """Whether the values of the two columns correspond one to one."""
    pairs = len(cases[[name, number]].drop_duplicates())
    return pairs == cases[name].nunique() == cases[number].nunique()


def first_cases(source: Source, most: int = 10) -> Table:
    """A row for each of the first cases, as :func:`every_case`."""
    return every_case(replace(source, cases=source.cases.head(most)))


def every_case(source: Source) -> Table:
    """A row for each case: its factors, metrics, comparisons and outcome."""
    columns = [name for name in (*source.factors, *source.measured, *source.compared) if name in source.cases]
    records = source.cases.to_dict("records")
    rows = [[*(source.cell(name, row[name]) for name in columns), str(row["outcome"])] for row in records]
    words = [k for k, name in enumerate(columns) if not pd.api.types.is_numeric_dtype(source.cases[name])]
    head = [*(source.shown(name).label for name in columns), "Outcome"]
    return Table(head, rows, (*words, len(columns)), sortable=True)


def _fits(source: Source) -> Iterable[str]:
    """Each fitted line in words: `Tip shift: 275 mm per unit μ, within 4.7 mm, 1.2 mm at μ = 0 (7 cases; Plates 6)`."""
    for fit in source.manifest.get("fits") or ():
        x, y = source.shown(fit["x"]), source.shown(fit["y"])
        quantity = source.quantity(fit["x"])
        about = [source.named(name, value) for name, value in fit.get("where", {}).items()]
        counted = [count(fit["points"], "case")] if "points" in fit else []
        over = "; ".join(counted + about)
        law = "too few cases for a line"
        if fit["slope"] is not None:
            per = x.unit or f"unit {quantity.symbol or quantity.title.lower()}"
            law = style.law_in_words(
                fit["slope"] * y.factor / x.factor, fit["largest_deviation"] * y.factor, y.unit, per
            )
            origin = f"{quantity.symbol} = 0" if quantity.symbol else "zero"
            law += f", {style.with_unit(fit['intercept'] * y.factor, y.unit)} at {origin}"
        yield f"{source.quantity(fit['y']).title}: {law}" + (f" ({over})" if over else "")


def _failed(source: Source) -> Table | None:
    """The first failed cases with their factors, outcomes and reasons; None without any."""

    def case(row):
        return ", ".join(source.named(name, row[name]) for name in source.factors)

    records = source.failed.head(MOST_LISTED).to_dict("records")
    rows = [[str(row["case_id"]), case(row), row["outcome"], row.get("reason") or ""] for row in records]
    return Table(["Case", "With", "Outcome", "Reason"], rows, range(4), sortable=True) if rows else None


def _timing(rows: Iterable[Mapping[str, Any]]) -> Table | None:
    """Time per equilibrium of each model, from the manifest; None if it has none."""
    lines = [[str(row["model"]), style.digits(float(row["microseconds_per_equilibrium"]))] for row in rows]
    return Table(["Model", "µs per equilibrium, one core, in bulk"], lines) if lines else None


def _made(source: Source) -> list[tuple[str, str]]:
    """Name and value of each line on how the study was computed, for those who want to repeat it."""
    manifest, git, run = source.manifest, source.manifest.get("git"), source.manifest.get("run") or {}
    revision = f"{git['revision'][:12]}{' with uncommitted changes' if git.get('dirty') else ''}" if git else ""
    versions = ", ".join(f"{name} {version}" for name, version in (manifest.get("versions") or {}).items())
    seconds = (
        f"{style.digits(run['seconds'])} s for {count(run.get('cases_computed', 0), 'case', ',')}"
        if "seconds" in run
        else ""
    )
    lines = {
        "Study file": manifest.get("spec", ""),
        "Manipulator": source.study.manipulator,
        "Hash of cases and engine": str(manifest.get("key", ""))[:16],
        "Seed": str(source.study.seed),
        "Revision": revision,
        "Versions": versions,
        "Platform": manifest.get("platform", ""),
        "Run time": seconds,
        "Written": manifest.get("written", ""),
    }
    return [(name, str(text)) for name, text in lines.items() if text]
