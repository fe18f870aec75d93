"""Errors of rigs in a report: shares of rigs that keep the requirements, quantiles, Sobol indices; with figures."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from prb3r.markdown import listed
from prb3r.model.files.cells import count
from prb3r.present import canvas, rc, style
from prb3r.present.figure_files import save_figure
from prb3r.present.legends import without_repeats
from prb3r.present.page import Table
from prb3r.present.study.section import Section
from prb3r.quantities import Quantity, describe, label
from prb3r.study.designs import design_names, known_values
from prb3r.study.phrases import bound_in_words, known_in_words, wish_in_words
from prb3r.study.rigs import (
    ALL_REQUIREMENTS,
    Rigs,
    metrics_of,
    quantile_column,
    rig_numbers,
    sampled_cases,
    share_in_words,
    share_sentences,
)
from prb3r.study.run import Result
from prb3r.study.spec import Study
from prb3r.study.wishes import Requirement

RIGS_CAPTIONS = {
    "rigs": "Share of the rigs below each value. For a requirement the value of a rig is the number that is bounded, "
    "over all its circumstances (the worst, if nothing else is said); the bound is red, and its far side shaded.",
    "indices": "Which error matters: share of the variance that it makes by itself (dark) and with others (pale).",
}
MOST_PANELS = 6
"""Metrics that are drawn at most; all of them are in the tables."""
MOST_CURVES = 8
"""Settings that have a curve of their own at most, where there are no requirements; else designs have one."""
TOLD_QUANTILES = (0.05, 0.5, 0.95)
"""Quantiles in the report; `quantiles.parquet` has more."""
ENDS = "", "_low", "_high"
"""Endings of column names: an estimate and the ends of its interval."""
MATTERS = 0.05
"""Errors with smaller indices are left to `indices.parquet`: total ones in the table, first-order ones in sentences."""


def rigs_section(result: Result) -> Section:
    """The section on the errors of a study's rigs: sentences and tables."""
    study, rigs = result.plan.study, result.rigs
    assert rigs is not None
    tables = [("Quantiles over the rigs", _quantile_table(study, rigs))]
    if not rigs.shares.empty:
        tables.insert(0, ("Share of the rigs that keep each requirement", _share_table(study, rigs)))
    if not rigs.indices.empty:
        tables.append(("Share of the variance that each error makes", _index_table(study, rigs)))
    sentences = [*(f"**{sentence}.**" for sentence in share_sentences(rigs)), *index_sentences(study, rigs)]
    missing = rigs.indices[rigs.indices["total"].isna()]["metric"].unique() if len(rigs.indices) else []
    sentences += [f"{_title(study, name)}: no indices, as {_no_number(result.cases, name)}." for name in missing]
    note = (
        "Shares with Wilson's 95 % intervals, which are wide for samples that fill space more evenly than chance. "
        "Each requirement is asked of every rig by itself, over the circumstances that it stands in. "
    )
    if not rigs.indices.empty:
        note += (
            f"Shares of the variance are estimates, cut off at 0 and 100 %, between which they lie (not in "
            f"indices.parquet, which also has errors below {100 * MATTERS:g} %)."
        )
    return Section("Errors of the rigs", sentences, tables, note)


def _no_number(cases: pd.DataFrame, metric: str) -> str:
    """In how many cases a metric is without bound, and in how many it has no value."""
    values = known_values(cases, metric)
    counts = [("no bound was found in", np.isinf(values).sum()), ("there is no value in", np.isnan(values).sum())]
    return listed([f"{words} {number:,} of {count(len(values), 'case', ',')}" for words, number in counts if number])


def index_sentences(study: Study, rigs: Rigs) -> list[str]:
    """A sentence for each metric: the errors with a first-order index above `MATTERS`, largest first."""
    if rigs.indices.empty:
        return []
    said = []
    for number, part in _by_setting(study, rigs.indices):
        for metric, rows in part.groupby("metric", sort=False):
            told = rows[rows["first_order"] > MATTERS].sort_values("first_order", ascending=False)
            names = [f"{_error(row['error'])} {_percent(row, 'first_order')}" for row in told.to_dict("records")]
            if names:
                said.append(f"{_title(study, metric)}{number}: {', '.join(names)} of the variance.")
    return said


def _by_setting(study: Study, table: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """The rows of a table for each setting of the factors that are no errors, with the setting in words (in brackets).

    The words are empty if the study has no such factors.
    """
    errors = {error.name for error in study.errors}
    fixed = [f.name for f in study.factor if f.name not in errors and f.name in table]
    if not fixed:
        return [("", table)]
    return [
        (f" ({design_names(part[:1], fixed)[0]})", part) for _, part in table.groupby(fixed, sort=False, dropna=False)
    ]


def _percent(row: dict[str, Any], kind: str) -> str:
    """An index with its interval in percent; `kind` is `first_order` or `total`."""
    numbers = within_bounds(np.array([row[f"{kind}{end}"] for end in ENDS]))
    rounded = [round(100 * number) for number in numbers] if np.isfinite(numbers).all() else []
    return "{} % ({} to {} %)".format(*rounded) if rounded else "–"


def within_bounds(indices: np.ndarray) -> np.ndarray:
    """Estimates of indices, or ends of their intervals, clipped to [0, 1], where the true index lies."""
    return np.clip(indices, 0.0, 1.0)


def _title(study: Study, metric: str) -> str:
    """The title of a metric, with its unit if another metric of the study has the same title."""
    quantities = metrics_of(study)
    quantity = next(quantity for quantity in quantities if quantity.name == metric)
    alike = sum(other.title == quantity.title for other in quantities) > 1
    return label(quantity) if alike else quantity.title


def _error(name: str) -> str:
    """The title of an error."""
    return style.quantity_of(name, ()).title


def _share_table(study: Study, rigs: Rigs) -> Table:
    """A row for each design and requirement with the share of rigs that keep it."""
    quantities = {quantity.name: quantity for quantity in metrics_of(study)}
    words = {ALL_REQUIREMENTS: "every requirement"}
    for number, requirement in enumerate(study.requirement, 1):
        quantity = _of(requirement, quantities)
        words[number] = f"{wish_in_words(requirement, quantity)}, {bound_in_words(requirement, quantity)}"
    rows = [
        [*([row["design"]] if study.design_factors else []), words[row["requirement"]], share_in_words(row)]
        for row in rigs.shares.to_dict("records")
    ]
    head = [*(["design"] if study.design_factors else []), "requirement", "rigs that keep it"]
    return Table(head, rows, range(len(head) - 1))


def _of(requirement: Requirement, quantities: dict[str, Quantity]) -> Quantity:
    """The quantity that a requirement bounds."""
    return quantities.get(requirement.metric) or describe(requirement.metric)


def _quantile_table(study: Study, rigs: Rigs) -> Table:
    """A row for each setting and metric with its quantiles and standard deviation over the rigs."""
    quantities = {quantity.name: quantity for quantity in metrics_of(study)}
    rows = []
    for setting, part in _by_setting(study, rigs.quantiles):
        for row in part.to_dict("records"):
            quantity = quantities[row["metric"]]
            numbers = [row.get(name, np.nan) for name in (*map(quantile_column, TOLD_QUANTILES), "sd")]
            cells = [known_in_words(number, quantity, numbers) for number in numbers]
            rows.append([_title(study, quantity.name) + setting, *cells, str(row["failed"] or "")])
    return Table(["", *(f"{100 * q:g} %" for q in TOLD_QUANTILES), "standard deviation", "without a value"], rows)


def _index_table(study: Study, rigs: Rigs) -> Table:
    """A row for each setting, metric and error with its Sobol indices, the errors with the smallest left out."""
    rows = [
        [
            _title(study, row["metric"]) + setting,
            _error(row["error"]),
            _percent(row, "first_order"),
            _percent(row, "total"),
        ]
        for setting, part in _by_setting(study, rigs.indices)
        for row in part[~(part["total"] < MATTERS)].to_dict("records")
    ]
    return Table(["", "error", "by itself", "with others"], rows, (0, 1))


def rigs_pictures(result: Result) -> list[Path]:
    """Draw the figures `rigs` and, with indices, `indices`; the files written."""
    assert result.rigs is not None
    with rc.in_use():
        files = save_figure(spread_figure(result.plan.study, result.cases), result.folder, "rigs")
        if not result.rigs.indices.empty:
            files += save_figure(indices_figure(result.plan.study, result.rigs), result.folder, "indices")
    return files


def _drawn(study: Study, most: int) -> list[tuple[Quantity, Requirement | None]]:
    """What has a panel: each requirement with its quantity or, without requirements, each metric; the first `most`."""
    quantities = {quantity.name: quantity for quantity in metrics_of(study)}
    asked: list[tuple[Quantity, Requirement | None]] = [(_of(r, quantities), r) for r in study.requirement]
    return (asked or [(quantity, None) for quantity in quantities.values()])[:most]


def spread_figure(study: Study, cases: pd.DataFrame) -> Figure:
    """Empirical distribution over the rigs, a panel each: of the number that each requirement bounds, for each design,
    or without requirements of each metric, for each setting of the factors that are no errors."""
    drawn = cases[sampled_cases(study, cases) < 2]
    errors = {error.name for error in study.errors}
    apart, fixed = study.design_factors, [factor.name for factor in study.factor if factor.name not in errors]
    if whole := not study.requirement and len(drawn[fixed].drop_duplicates()) <= MOST_CURVES:
        apart = fixed
    drawn = drawn.assign(_group=design_names(drawn, apart))
    looks = style.looks(list(dict.fromkeys(drawn["_group"])))
    panels = _drawn(study, MOST_PANELS)
    handles = [
        Line2D([], [], color=look.colour, ls=look.line, label=style.literal(name))
        for look, name in zip(looks.values(), without_repeats(list(looks)), strict=True)
    ]
    handles = handles if apart else []
    if study.requirement:
        handles.append(Line2D([], [], color=style.ALARM, lw=1.0, label="bound of the requirement"))
    figure, axes = canvas.panels([""] * len(panels), handles, 0.7, shared=False)
    for panel, (quantity, requirement) in zip(axes, panels, strict=True):
        shown = style.shown(quantity, drawn[quantity.name])
        for name, look in looks.items():
            values, height = rigs_below(study, drawn[drawn["_group"] == name], quantity, requirement)
            panel.step(values * shown.factor, height, where="post", color=look.colour, ls=look.line)
        if requirement is not None:
            _bound(panel, requirement, shown.factor)
        panel.set(xlabel=shown.label, ylim=(0, 1))
        panel.locator_params(axis="x", nbins=4)
        panel.yaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %")
    for panel in axes[:: canvas.panels_in_row(axes)]:
        panel.set_ylabel(f"share of {'rigs' if whole or study.requirement else 'cases'} below")
    return figure


def rigs_below(
    study: Study, part: pd.DataFrame, quantity: Quantity, requirement: Requirement | None
) -> tuple[np.ndarray, np.ndarray]:
    """Finite values in rising order, each with the share of the rigs among the cases `part` at or below it.

    Rigs without a value count beyond all others, on the side that breaks the requirement.
    """
    if requirement is None:
        values, missing = known_values(part, quantity.name), np.inf
    else:
        values, missing = rig_numbers(study, part, requirement), -requirement.sign * np.inf
    values = np.sort(np.where(np.isnan(values), missing, values))
    finite = np.isfinite(values)
    return values[finite], (np.arange(1, len(values) + 1) / len(values))[finite]


def _bound(axes: Axes, requirement: Requirement, factor: float) -> None:
    """Draw the bound of a requirement as a line, with the side that breaks it shaded."""
    at, (low, high) = requirement.limit * factor, axes.get_xlim()
    axes.axvline(at, color=style.ALARM, lw=1.0)
    low, high = min(low, at), max(high, at)
    margin = 0.04 * (high - low)
    if requirement.sign > 0:
        low -= margin
        axes.axvspan(low, at, color="#f3e3e5", lw=0)
    else:
        high += margin
        axes.axvspan(at, high, color="#f3e3e5", lw=0)
    axes.set_xlim(low, high)


def indices_figure(study: Study, rigs: Rigs) -> Figure:
    """First-order and total indices of every error, a panel for each metric (of the first setting of other factors)."""
    part = _by_setting(study, rigs.indices)[0][1].dropna(subset=["first_order", "total"])
    metrics = [quantity for quantity, _ in _drawn(study, 10**6)]
    metrics = [q for q in dict.fromkeys(metrics) if (part["metric"] == q.name).any()][:MOST_PANELS]
    errors = list(dict.fromkeys(rigs.indices["error"]))
    looks = style.PALETTE[0], style.pale(style.PALETTE[0], 0.3)
    handles = [Patch(fc=looks[0], label="by itself"), Patch(fc=looks[1], label="with others")]
    titles = [_title(study, quantity.name) for quantity in metrics] or [""]
    figure, axes = canvas.panels(titles, handles, max(0.35, 0.09 * len(errors) + 0.12), shared=True)
    rows = np.arange(len(errors))[::-1]
    for panel, quantity in zip(axes, metrics, strict=False):
        table = part[part["metric"] == quantity.name].set_index("error").reindex(errors)
        for kind, colour, shift in (("first_order", looks[0], 0.19), ("total", looks[1], -0.19)):
            values, low, high = (within_bounds(table[f"{kind}{end}"].to_numpy(float)) for end in ENDS)
            panel.barh(rows + shift, values, 0.36, color=colour, lw=0)
            ends = np.maximum([values - low, high - values], 0.0)
            panel.errorbar(values, rows + shift, xerr=ends, fmt="none", ecolor=style.INK, elinewidth=0.7, capsize=1.5)
        panel.set_yticks(rows, [style.literal(_error(name)) for name in errors])
        panel.xaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %")
        panel.grid(False, axis="y")
    canvas.outer_labels(axes, "share of the variance", "")
    return figure
